from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.cell_box import CellBox
from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings
from mapping.scan_map import ScanMap
from tests.unit.mapping.rectangle import rectangle_scan

POSES = (Pose2(1.0, 1.0, 0.0), Pose2(2.5, 1.4, 1.0), Pose2(3.0, 2.0, 2.0))
SCANS = tuple(rectangle_scan(pose, beams=40) for pose in POSES)
FILLED = IntegrationSettings(fill_between=True)


def filled(poses=POSES, **settings) -> ScanMap:
    scans = ScanMap(resolution=0.1, **settings)
    for number, (scan, pose) in enumerate(zip(SCANS, poses, strict=True)):
        scans.observe(number, scan, pose)
    return scans


def test_drawing_bit_by_bit_or_at_once_gives_the_same_grid():
    scans = ScanMap(resolution=0.1)
    for number, (scan, pose) in enumerate(zip(SCANS, POSES, strict=True)):
        assert scans.observe(number, scan, pose)
        assert not scans.draw().empty
    at_once = filled().grid()
    assert scans.grid().geometry == at_once.geometry
    assert np.array_equal(scans.grid().log_odds, at_once.log_odds)
    assert scans.draw().empty


def test_nothing_is_drawn_before_it_is_asked_for():
    scans = filled()
    scans.place(dict(enumerate(reversed(POSES))))
    assert scans.drawn == 0
    scans.draw()
    assert scans.drawn == 3


def test_corrected_poses_are_drawn_anew():
    crooked = filled((POSES[0], Pose2(2.8, 1.4, 1.3), POSES[2]))
    crooked.draw()
    assert crooked.place({1: POSES[1]}) == []
    assert np.array_equal(crooked.grid().log_odds, filled().grid().log_odds)
    assert crooked.place({1: POSES[1]}) == []
    assert crooked.draw().empty and crooked.drawn == 6
    crooked.observe(3, SCANS[0], POSES[0])
    crooked.draw()
    assert crooked.drawn == 7 and len(crooked) == 4


def test_what_changes_lies_in_the_box():
    scans = filled((POSES[0], Pose2(2.8, 1.4, 1.3), POSES[2]))
    scans.draw()
    before = scans.cells.log_odds.copy()
    scans.place({1: POSES[1]})
    box = scans.draw()
    changed = before != scans.cells.log_odds
    inside = box.shifted(-scans.cells.box.iy0, -scans.cells.box.ix0)
    assert changed.any() and changed.sum() == changed[inside.slices].sum()
    for edge in (changed[inside.iy0], changed[inside.iy1 - 1]):
        assert edge.any()


def test_a_pose_may_come_before_its_scan():
    late = ScanMap(resolution=0.1)
    assert late.place({1: POSES[1]}) == [] and len(late) == 0
    for number, pose in enumerate((POSES[0], IDENTITY, POSES[2])):
        late.observe(number, SCANS[number], pose)
    assert np.array_equal(late.grid().log_odds, filled().grid().log_odds)
    assert [number for number, _, _ in late.placed()] == [0, 1, 2]


def test_a_scan_no_longer_named_goes_back_to_where_it_was_observed():
    scans = filled()
    scans.place({1: IDENTITY})
    assert [T_map_base for _, _, T_map_base in scans.placed()][1] == IDENTITY
    scans.place({})
    assert tuple(T_map_base for _, _, T_map_base in scans.placed()) == POSES


def test_only_what_comes_after_a_snapshot_is_drawn_again():
    scans = ScanMap(resolution=0.1, snapshot_every=10)
    for number in range(40):
        scans.observe(number, SCANS[0], POSES[0])
    scans.draw()
    scans.place({35: POSES[1]})
    scans.draw()
    assert scans.drawn == 40 + 10  # from 30 on
    scans.observe(-1, SCANS[0], POSES[0])
    scans.draw()
    assert scans.drawn == 40 + 10 + 41


def test_of_many_snapshots_few_are_kept_and_three_times_as_much_is_drawn_again_at_most():
    for moved in range(0, 60, 7):
        scans = ScanMap(resolution=0.5, snapshot_every=2)
        for number in range(60):
            scans.observe(number, SCANS[0], POSES[0])
        scans.draw()
        assert len(scans._snapshots) <= 10
        scans.place({moved: POSES[1]})
        scans.draw()
        assert scans.drawn - 60 <= min(60, 3 * (60 - moved) + 2)


def test_scans_that_reach_off_the_map_are_refused_until_they_are_moved():
    scans = ScanMap(resolution=0.1, bounds=CellBox(-60, -60, 60, 60))
    far, nowhere = Pose2(90.0, 0.0, 0.0), Pose2(math.nan, 0.0, 0.0)
    assert scans.observe(0, SCANS[0], POSES[0])
    assert not scans.observe(1, SCANS[1], far)
    assert not scans.observe(1, SCANS[1], far)
    assert not scans.observe(2, SCANS[2], Pose2(0.0, 0.0, math.inf))
    endless = LaserScan(SCANS[0].ranges * 1e9, 0.0, 0.1, math.inf, 0.0)
    assert not scans.observe(3, endless, POSES[0])
    assert len(scans) == 1
    assert scans.place({1: Pose2(1e300, 0.0, 0.0), 2: nowhere, 0: POSES[1]}) == [1, 2]
    scans.draw()
    assert scans.place(dict(enumerate(POSES))) == []
    assert np.array_equal(scans.grid().log_odds, filled(bounds=scans._bounds).grid().log_odds)
    assert scans.place({1: far}) == [1]
    assert [number for number, _, _ in scans.placed()] == [0]


def test_without_scans_one_cell_is_unknown():
    grid = ScanMap(resolution=0.1).grid()
    assert grid.log_odds.tolist() == [[0.0]] and grid.geometry.shape == (1, 1)


def test_which_cell_a_point_falls_in_does_not_hang_on_where_the_grid_begins():
    ranges = np.array([0.45, 0.6, 0.75, 0.9], dtype=np.float32)
    cross = LaserScan(ranges, 0.0, 0.5 * math.pi, 5.0, 0.0)
    near, wide = ScanMap(0.15), ScanMap(0.15)
    wide.observe(-1, cross, Pose2(-41.3, -67.1, 0.0))
    for k in range(30):  # on corners of cells, where rounding decides
        for scans in (near, wide):
            scans.observe(k, cross, Pose2(k * 0.15, (k % 7) * 0.15, 0.0))
            scans.draw()
    box = near.cells.known().box
    assert near.cells.part(box).tobytes() == wide.cells.part(box).tobytes()


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("observe"), st.integers(0, 7)),
        st.tuples(st.just("place"), st.dictionaries(st.integers(0, 7), st.integers(0, 2))),
        st.just(("draw", None)),
    ),
    max_size=14,
)


@given(steps=STEPS, snapshot_every=st.integers(1, 4))
@settings(max_examples=25)
def test_the_map_is_that_of_its_scans_and_poses_however_it_came_about(steps, snapshot_every):
    grown = ScanMap(0.2, FILLED, snapshot_every=snapshot_every)
    observed, poses = {}, {}
    for what, value in steps:
        if what == "observe":
            observed[value] = None
            grown.observe(value, SCANS[value % 3], POSES[(value + 1) % 3])
        elif what == "place":
            poses = {number: POSES[k] for number, k in value.items()}
            grown.place(poses)
        else:
            grown.draw()
    fresh = ScanMap(0.2, FILLED)
    for number in sorted(observed):
        fresh.observe(number, SCANS[number % 3], poses.get(number, POSES[(number + 1) % 3]))
    fresh.draw()
    grown.draw()
    one, other = grown.cells.known(), fresh.cells.known()
    assert one.box.empty == other.box.empty
    if not one.box.empty:
        assert one.box == other.box
    assert one.log_odds.tobytes() == other.log_odds.tobytes()
    assert list(grown.placed()) == list(fresh.placed())
