from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.cell_box import EMPTY_BOX, CellBox, box_of
from mapping.geometry import Pose2
from mapping.grid import OccupancyGrid
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings
from mapping.team_map import TeamMap
from protocol.map_cells import map_digest, quantise
from tests.unit.mapping.rectangle import rectangle_scan

AUTHORS = (("marian", 0), ("robin", 0), ("robin", 1))
SETTINGS = IntegrationSettings(fill_between=True, hit=0.7, miss=-0.41)
RESOLUTION = 0.15
# Some of the poses lie on corners and edges of cells, where rounding decides.
PLACES = (
    Pose2(0.75, 0.5, 0.0),
    Pose2(2.5, 1.4, 1.0),
    Pose2(3.0, 2.0, 2.0),
    Pose2(1.25, 2.25, 1.5),
    Pose2(-40.5, 31.0, 0.3),
)


def scan_of(author: int, number: int) -> LaserScan:
    rng = np.random.default_rng(7 * author + number)
    return rectangle_scan(PLACES[(author + number) % 4], beams=24, noise=0.02, rng=rng)


SCANS = {(a, n): scan_of(a, n) for a in range(3) for n in range(5)}


def told(author: int, number: int) -> Pose2:
    return PLACES[(author + number) % 4]


def from_scratch(held, poses) -> TeamMap:
    fresh = TeamMap(RESOLUTION, SETTINGS)
    for author, number in sorted(held):
        placed = poses[author].get(number, told(author, number))
        fresh.observe(AUTHORS[author], number, SCANS[author, number], placed)
    return fresh


def cropped(grid: OccupancyGrid) -> tuple[CellBox, bytes]:
    """The known cells: where on the lattice, and their bits."""
    geometry, box = grid.geometry, box_of(grid.log_odds)
    rows = round(geometry.origin_y / geometry.resolution)
    cols = round(geometry.origin_x / geometry.resolution)
    lattice = EMPTY_BOX if box.empty else box.shifted(rows, cols)
    return lattice, grid.log_odds[box.slices].tobytes()


def digest_of(team: TeamMap) -> str:
    grid = team.grid()
    return map_digest(quantise(grid.log_odds), grid.geometry)


KEYS = st.tuples(st.integers(0, 2), st.integers(0, 4))
POSES = st.dictionaries(st.integers(0, 4), st.sampled_from(PLACES))
STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("observe"), KEYS),
        st.tuples(st.just("observe"), KEYS),
        st.tuples(st.just("place"), st.tuples(st.integers(0, 2), POSES)),
        st.tuples(st.just("forget"), st.integers(0, 2)),
        st.just(("ask", None)),
    ),
    max_size=20,
)


@given(steps=STEPS, snapshot_every=st.integers(1, 3))
@settings(max_examples=40)
def test_the_map_is_that_of_its_scans_and_poses_however_it_came_about(steps, snapshot_every):
    grown = TeamMap(RESOLUTION, SETTINGS, snapshot_every=snapshot_every)
    held, poses = {}, {0: {}, 1: {}, 2: {}}
    for what, value in steps:
        if what == "observe":
            author, number = value
            held[value] = None
            assert grown.observe(AUTHORS[author], number, SCANS[value], told(*value))
        elif what == "place":
            author, poses[author] = value
            assert grown.place(AUTHORS[author], poses[author]) == []
        elif what == "forget":
            grown.forget(AUTHORS[value])
            held = {key: None for key in held if key[0] != value}
            poses[value] = {}
        else:
            grown.grid()
    fresh = from_scratch(held, poses)
    assert cropped(grown.grid()) == cropped(fresh.grid())
    assert digest_of(grown) == digest_of(fresh)
    assert list(grown.placed()) == list(fresh.placed())
    assert len(grown) == len(fresh) == len(held)


@given(
    order=st.permutations(list(SCANS) * 2),
    asked=st.sets(st.integers(0, 29)),
    moved=st.lists(st.tuples(st.integers(0, 29), st.integers(0, 2)), max_size=3),
)
@settings(max_examples=25)
def test_members_that_hold_the_same_have_the_same_map(order, asked, moved):
    poses = {0: {2: PLACES[3]}, 1: {n: PLACES[n % 3] for n in range(5)}, 2: {}}
    member = TeamMap(RESOLUTION, SETTINGS, snapshot_every=2)
    for k, key in enumerate(order):
        member.observe(AUTHORS[key[0]], key[1], SCANS[key], told(*key))
        for when, author in moved:
            if when == k:
                member.place(AUTHORS[author], {n: PLACES[(n + k) % 5] for n in range(4)})
        if k in asked:
            member.grid()
    for author in range(3):
        member.place(AUTHORS[author], poses[author])
    fresh = from_scratch(dict.fromkeys(SCANS), poses)
    assert cropped(member.grid()) == cropped(fresh.grid())
    assert digest_of(member) == digest_of(fresh)


@given(steps=STEPS)
@settings(max_examples=25)
def test_changes_tell_of_every_cell_that_changed(steps):
    team = TeamMap(RESOLUTION, SETTINGS)
    for what, value in steps:
        before = OccupancyGrid(team.grid().geometry, team.grid().log_odds.copy())
        team.take_changes()
        if what == "observe":
            team.observe(AUTHORS[value[0]], value[1], SCANS[value], told(*value))
        elif what == "place":
            team.place(AUTHORS[value[0]], value[1])
        elif what == "forget":
            team.forget(AUTHORS[value])
        box, grid = team.take_changes(), team.grid()
        if before.geometry.shape != (1, 1):
            before.log_odds = before.geometry.padding_to(grid.geometry).pad(before.log_odds, 0.0)
            differs = before.log_odds != grid.log_odds
            assert differs.sum() == differs[box.slices].sum()
        assert team.take_changes().empty


def test_the_layers_are_added_up_and_kept_within_the_limits():
    team, alone = TeamMap(RESOLUTION), TeamMap(RESOLUTION)
    for author in (("b", 0), ("a", 0)):
        for number in range(6):
            team.observe(author, number, SCANS[0, 0], told(0, 0))
    for number in range(6):
        alone.observe(("a", 0), number, SCANS[0, 0], told(0, 0))
    both, one = team.grid().log_odds, alone.grid().log_odds
    assert np.array_equal(both, np.clip(one + one, np.float32(-4.0), np.float32(4.0)))
    assert [scan.author for scan in team.placed()] == [("a", 0)] * 6 + [("b", 0)] * 6
    assert [scan.number for scan in team.placed()] == [*range(6), *range(6)]


def test_only_the_layer_of_the_author_that_moved_is_drawn_again():
    team = from_scratch(dict.fromkeys(SCANS), {0: {}, 1: {}, 2: {}})
    assert all(layer.drawn == 0 for layer in team.layers.values())
    team.grid()
    unmoved = {n: told(1, n) for n in range(5)}
    team.place(AUTHORS[1], unmoved)
    assert team.take_changes().empty is False and team.take_changes().empty
    assert [layer.drawn for layer in team.layers.values()] == [5, 5, 5]
    team.place(AUTHORS[1], unmoved | {4: PLACES[0]})
    team.grid()
    assert [layer.drawn for layer in team.layers.values()] == [5, 10, 5]


@pytest.mark.parametrize("first", [0, 1])
def test_a_scan_off_the_map_is_refused_whatever_came_before(first):
    team = TeamMap(0.25, largest_cells=120 * 120)
    near, far = Pose2(-10.0, 0.0, 0.0), Pose2(14.0, 0.0, 0.0)
    answers = {}
    for k in (first, 1 - first):
        answers[k] = team.observe(("a", 0), k, SCANS[0, 0], (near, far)[k])
    assert answers == {0: True, 1: False} and len(team) == 1
    assert team.place(("a", 0), {0: far, 1: far}) == [0, 1]
    assert team.place(("a", 0), {0: near, 1: near, 5: far}) == []
    assert len(team) == 2
    assert team.grid().log_odds.size <= 120 * 120


def test_a_map_without_scans():
    team = TeamMap(RESOLUTION)
    assert team.take_changes().empty and len(team) == 0
    assert digest_of(team) == ""
    team.place(("a", 0), {0: PLACES[0]})
    assert digest_of(team) == "" and list(team.placed()) == []
