from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.cell_box import box_of
from mapping.geometry import Pose2
from mapping.observation_coding import Observation, encode_observation
from mapping.scan_coding import ScanCodingSettings
from mapping.shared_map import Author, SharedMap
from mapping.team_map import TeamMap
from protocol.map_cells import map_digest, quantise
from tests.unit.mapping.rectangle import rectangle_scan

ANN, BOB = ("ann", 0), ("bob", 0)
PLACES = (Pose2(0.75, 0.5, 0.0), Pose2(2.5, 1.4, 1.0), Pose2(3.0, 2.0, 2.0))
FAR = Pose2(500.0, 0.0, 0.0)
CODING = ScanCodingSettings(error_bound_m=0.01)


def payload(place: int) -> bytes:
    scan = rectangle_scan(PLACES[place], beams=24)
    return encode_observation(Observation(scan, np.array([[1.0, 0.0]])), CODING)


PAYLOADS = [payload(place) for place in range(3)]


@dataclass
class Copy:
    """What is held: by author and number, bytes and the pose told first; newer poses."""

    entries: dict[tuple[Author, int], tuple[bytes, Pose2]] = field(default_factory=dict)
    newer: dict[tuple[Author, int], Pose2] = field(default_factory=dict)

    def payload(self, author: Author, number: int) -> bytes:
        return self.entries[author, number][0]

    def told_at(self, author: Author, number: int) -> Pose2:
        return self.entries[author, number][1]

    def pose(self, author: Author, number: int) -> Pose2:
        return self.poses(author)[number]

    def poses(self, author: Author) -> dict[int, Pose2]:
        return {
            n: self.newer.get((a, n), pose)
            for (a, n), (_, pose) in sorted(self.entries.items())
            if a == author
        }


def put(held: Copy, author: Author, number: int, place: int) -> None:
    held.entries[author, number] = PAYLOADS[place], PLACES[place]


def shared_map(**settings: int) -> SharedMap:
    return SharedMap(TeamMap[Author](0.15, **settings))


def digest(shared: SharedMap) -> str:
    grid = shared.team.grid()
    return map_digest(quantise(grid.log_odds), grid.geometry)


def fresh(held: Copy) -> str:
    """The digest of a map that is drawn of what is held now, by one who never held else."""
    shared = shared_map()
    shared.take_in(held, list(held.entries), ())
    return digest(shared)


def test_entries_are_drawn_where_they_were_told() -> None:
    held, shared = Copy(), shared_map()
    put(held, ANN, 1, 0)
    put(held, BOB, 1, 1)
    assert shared.take_in(held, [(ANN, 1), (BOB, 1)], ()) == []
    placed = {(p.author, p.number): p.T_map_base for p in shared.team.placed()}
    assert placed == {(ANN, 1): PLACES[0], (BOB, 1): PLACES[1]}
    assert shared.told == placed
    assert shared.observations[ANN, 1].victims_base.tolist() == [[1.0, 0.0]]


def test_newer_poses_move_them_and_what_was_told_first_stays_on_record() -> None:
    held, shared = Copy(), shared_map()
    put(held, ANN, 1, 0)
    shared.take_in(held, [(ANN, 1)], ())
    held.newer[ANN, 1] = PLACES[2]
    put(held, ANN, 2, 1)
    held.newer[ANN, 2] = PLACES[0]
    shared.take_in(held, [(ANN, 2)], [ANN])
    assert [p.T_map_base for p in shared.team.placed()] == [PLACES[2], PLACES[0]]
    assert shared.told[ANN, 1] == PLACES[0]
    assert digest(shared) == fresh(held)


def test_what_cannot_be_read_is_named_and_nobody_draws_it() -> None:
    held, shared = Copy(), shared_map()
    held.entries[ANN, 1] = b"", PLACES[0]
    ((key, reason),) = shared.take_in(held, [(ANN, 1)], ())
    assert key == (ANN, 1)
    assert shared.unreadable == {(ANN, 1): reason}
    assert len(shared.team) == 0


def test_a_replaced_entry_is_drawn_anew() -> None:
    """What was told wrong, and is told right now, must not stay on the map."""
    held, shared = Copy(), shared_map()
    put(held, ANN, 1, 0)
    put(held, ANN, 2, 1)
    shared.take_in(held, [(ANN, 1), (ANN, 2)], ())
    put(held, ANN, 1, 2)
    shared.take_in(held, [(ANN, 1)], ())
    assert digest(shared) == fresh(held)
    held.entries[ANN, 1] = b"", PLACES[0]
    shared.take_in(held, [(ANN, 1)], ())
    assert list(shared.unreadable) == [(ANN, 1)]
    assert (ANN, 1) not in shared.observations
    assert digest(shared) == fresh(held)
    put(held, ANN, 1, 0)
    shared.take_in(held, [(ANN, 1)], ())
    assert shared.unreadable == {}
    assert digest(shared) == fresh(held)


def test_a_scan_beyond_the_edge_is_not_drawn_and_nobody_is_to_blame() -> None:
    held, shared = Copy(), shared_map(largest_cells=120 * 120)
    held.entries[ANN, 1] = PAYLOADS[0], FAR
    assert shared.take_in(held, [(ANN, 1)], ()) == []
    assert len(shared.team) == 0
    held.newer[ANN, 1] = PLACES[0]
    shared.take_in(held, (), [ANN])
    assert len(shared.team) == 1


def test_a_forgotten_author_leaves_the_map_and_may_come_back() -> None:
    held, shared = Copy(), shared_map()
    put(held, ANN, 1, 0)
    put(held, BOB, 1, 1)
    held.entries[BOB, 2] = b"", PLACES[0]
    shared.take_in(held, list(held.entries), ())
    for number in (1, 2):
        del held.entries[BOB, number]
    shared.take_in(held, (), (), [BOB])
    assert list(shared.observations) == list(shared.told) == [(ANN, 1)]
    assert shared.unreadable == {}
    assert digest(shared) == fresh(held)
    put(held, BOB, 3, 2)
    shared.take_in(held, [(BOB, 3)], (), [BOB])
    assert digest(shared) == fresh(held)


def test_scans_of_others_are_told_and_of_oneself_only_the_old_ones() -> None:
    held, shared = Copy(), shared_map()
    for number in (1, 2):
        put(held, ANN, number, 0)
    put(held, BOB, 1, 1)
    shared.take_in(held, list(held.entries), ())
    assert [seen.T_map_base for seen in shared.scans(ANN, 1)] == [PLACES[0], PLACES[1]]
    assert len(list(shared.scans(BOB, 0))) == 2


def test_each_view_is_told_every_change_once() -> None:
    held, shared = Copy(), shared_map()
    early, late = shared.view(), shared.view()
    assert early.take_changes()[0].empty
    put(held, ANN, 1, 0)
    shared.take_in(held, [(ANN, 1)], ())
    box, log_odds = early.take_changes()
    assert log_odds.shape == box.shape
    assert log_odds.any()
    assert early.take_changes()[0].empty
    put(held, BOB, 1, 1)
    shared.take_in(held, [(BOB, 1)], ())
    known = box_of(early.log_odds)
    both, _ = late.take_changes()
    shifted = known.shifted(*late.geometry.lattice)
    assert both.union(shifted) == both


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["told", "told", "moved", "forgotten", "rubbish"]),
        st.sampled_from([ANN, BOB]),
        st.integers(1, 3),
        st.integers(0, 2),
    ),
    min_size=3,
    max_size=8,
)


@given(STEPS)
@settings(max_examples=25)
def test_members_that_hold_the_same_have_the_same_map_whatever_they_held_before(
    steps: list[tuple[str, Author, int, int]],
) -> None:
    held, shared = Copy(), shared_map()
    for what, author, number, place in steps:
        if what == "forgotten":
            for book in (held.entries, held.newer):
                for key in [key for key in book if key[0] == author]:
                    del book[key]
            shared.take_in(held, (), (), [author])
        elif what == "moved":
            if (author, number) in held.entries:
                held.newer[author, number] = PLACES[place]
                shared.take_in(held, (), [author])
        else:
            put(held, author, number, place)
            if what == "rubbish":
                held.entries[author, number] = b"", PLACES[place]
            shared.take_in(held, [(author, number)], ())
    assert digest(shared) == fresh(held)
    assert sorted(shared.told) == sorted(held.entries)
