from __future__ import annotations

import numpy as np

from protocol.effects import Note, Send
from protocol.fault_book import FaultBook
from protocol.map_cells import pack_cells
from protocol.messages import MapDelta, MapRequest, MapSnapshot
from robot_agent.map_following import MapFollower
from robot_agent.navigation_settings import PlanningMapSettings
from robot_agent.planning_map import PlanningMap

FREE = np.full((3, 4), -1.0, dtype=np.float32)


def follower(**settings: int) -> tuple[MapFollower, PlanningMap]:
    held = PlanningMap(0.2, PlanningMapSettings(**settings))
    return MapFollower(held, 1.0, FaultBook()), held


def delta(number: int, rows: int = 3) -> MapDelta:
    return MapDelta(
        number=number, resolution_m=0.05, lattice_x=0, lattice_y=0, rows=rows, cols=4,
        cells=pack_cells(FREE),
    )  # fmt: skip


def whole(number: int, rows: int = 3) -> MapSnapshot:
    return MapSnapshot(
        number=number, resolution_m=0.05, origin_x_m=0.0, origin_y_m=0.0, rows=rows, cols=4,
        cells=pack_cells(FREE),
    )  # fmt: skip


def test_changes_are_applied_in_order() -> None:
    following, held = follower()
    assert following.delta(delta(1), 0.0) == []
    assert held.number == 1 and held.cells.min() < 0


def test_after_a_gap_the_whole_map_is_asked_for_but_not_all_the_time() -> None:
    following, held = follower()
    asked = [Send("radio", "server", MapRequest(have=0))]
    assert following.delta(delta(2), 0.0) == asked
    assert following.delta(delta(3), 0.5) == []
    assert following.delta(delta(4), 1.0) == asked
    assert following.snapshot(whole(4)) == [] and held.number == 4


def test_bytes_that_hold_something_else_are_dropped_and_named() -> None:
    following, held = follower()
    (note,) = following.delta(delta(1, rows=5), 0.0)
    assert isinstance(note, Note) and "dropped a map change of server" in note.text
    assert following.delta(delta(1, rows=5), 0.0) == []
    (note,) = follower()[0].snapshot(whole(1, rows=5))
    assert isinstance(note, Note) and "dropped the map of server" in note.text
    assert held.number == 0


def test_a_map_too_large_for_this_robot_is_not_taken_over() -> None:
    following, held = follower(largest_cells=10)
    (note,) = following.snapshot(whole(1))
    assert isinstance(note, Note) and "too large" in note.text
    assert held.number == 0
