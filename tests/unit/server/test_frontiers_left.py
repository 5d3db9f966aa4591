from __future__ import annotations

import numpy as np

from mapping.grid import CLEAR, OBSTACLE, UNKNOWN, GridGeometry
from server.frontiers_left import NOT_TOLD, frontiers_left

GEOMETRY = GridGeometry(0.1, -1.0, 0.0, 40, 60)


def hall() -> np.ndarray:
    """A clear hall whose left and right ends are open; the right one in two parts."""
    classes = np.full(GEOMETRY.shape, UNKNOWN, dtype=np.uint8)
    classes[9, 10:50] = classes[31, 10:50] = OBSTACLE
    classes[10:31, 10:50] = CLEAR
    classes[19:22, 49] = OBSTACLE
    return classes


def place(x: float, y: float, gain: float | None, reason: str) -> dict[str, object]:
    return {"x_m": x, "y_m": y, "gain_m2": gain, "reason": reason}


def test_each_connected_frontier_is_one_entry_however_many_places_it_has() -> None:
    places = [
        place(0.05, 1.5, 0.3, "below the minimum gain"),
        place(0.05, 2.5, 4.25, "not visited: mission ended first"),
        {**place(3.95, 1.45, 9.0, "given up after 2 tries"), "tries": ["a: stuck", "b: stuck"]},
        place(3.95, 1.15, 0.1, "below the minimum gain"),
    ]
    left = frontiers_left(hall(), GEOMETRY, places)
    assert [entry["gain_m2"] for entry in left] == [9.0, 4.25, None]
    assert left[0]["tries"] == ["a: stuck", "b: stuck"]
    assert left[1] == {
        "x_m": 0.05,
        "y_m": 2.5,
        "length_m": 2.1,
        "gain_m2": 4.25,
        "reason": "not visited: mission ended first",
    }
    # Nobody bid for the last: its middle stands for it.
    assert left[2]["reason"] == NOT_TOLD
    assert abs(float(str(left[2]["y_m"])) - 2.65) < 0.2


def test_a_place_whose_frontier_is_gone_is_not_left() -> None:
    far = place(2.0, 2.0, 5.0, "not visited: mission ended first")
    assert all(entry["gain_m2"] is None for entry in frontiers_left(hall(), GEOMETRY, [far]))


def test_a_reason_nobody_knows_comes_last() -> None:
    places = [place(0.05, 2.5, 1.0, "because"), place(0.05, 1.5, None, "unreachable for this body")]
    entry = frontiers_left(hall(), GEOMETRY, places)[0]
    assert (entry["reason"], entry["gain_m2"]) == ("unreachable for this body", 1.0)


def test_a_map_without_frontiers_has_nothing_left() -> None:
    classes = np.full(GEOMETRY.shape, CLEAR, dtype=np.uint8)
    assert frontiers_left(classes, GEOMETRY, []) == []


def test_without_any_bid_all_is_left_because_the_mission_ended() -> None:
    left = frontiers_left(hall(), GEOMETRY, [])
    assert {entry["reason"] for entry in left} == {"not visited: mission ended first"}
    assert len(left) == 3
