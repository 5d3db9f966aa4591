from __future__ import annotations

import math

import numpy as np
import pytest

from coordination.waiting_place import IdleRobot, WaitingSettings, waiting_places
from mapping.distance_field import truncated_distance
from mapping.grid import GridGeometry
from mapping.path_planning import traversal_weights

CELL = 0.2
FINE = WaitingSettings(travel_weight=0.0)


class Floor:
    """A corridor 10 m long and 2 m wide; a door in its middle leads into a room above."""

    def __init__(self) -> None:
        solid = np.ones((35, 55), dtype=np.bool_)
        solid[2:12, 2:52] = False  # the corridor, y from 0.4 to 2.4
        solid[14:32, 12:42] = False  # the room, y from 2.8 to 6.4
        solid[12:14, 25:29] = False  # the door, 0.8 m wide, at x = 5.4
        self.geometry = GridGeometry(CELL, 0.0, 0.0, *solid.shape)
        self.clearance = truncated_distance(solid, CELL, 1.2)
        self.weights = traversal_weights(~solid, self.clearance, 0.3, 0.3)

    def places(
        self,
        idle: dict[str, tuple[float, float]],
        frontiers: list[tuple[float, float]],
        gains: list[float] | None = None,
        occupied: list[tuple[float, float]] | None = None,
        settings: WaitingSettings = FINE,
    ) -> dict[str, tuple[float, float]]:
        return waiting_places(
            self.weights,
            self.clearance,
            self.geometry,
            [IdleRobot(name, at) for name, at in idle.items()],
            frontiers,
            gains or [1.0] * len(frontiers),
            occupied or [],
            settings,
        )

    def room_at(self, place: tuple[float, float]) -> float:
        return float(self.clearance[self.geometry.cell_at(*place)])


@pytest.fixture(scope="module")
def floor() -> Floor:
    return Floor()


def test_it_waits_near_the_only_frontier(floor: Floor) -> None:
    place = floor.places({"anna": (1.0, 1.4)}, [(9.8, 1.4)])["anna"]
    assert math.dist(place, (9.8, 1.4)) < 1.5


def test_most_to_gain_draws_most(floor: Floor) -> None:
    ends = [(0.8, 1.4), (9.8, 1.4)]
    left = floor.places({"anna": (5.0, 1.4)}, ends, [10.0, 1.0])["anna"]
    right = floor.places({"anna": (5.0, 1.4)}, ends, [1.0, 10.0])["anna"]
    assert left[0] < 2.5 and right[0] > 8.0


def test_nobody_waits_in_a_doorway(floor: Floor) -> None:
    # Left, right and up: the door is the median of the three.
    frontiers = [(0.8, 1.4), (9.8, 1.4), (5.4, 6.2)]
    place = floor.places({"anna": (1.0, 1.4)}, frontiers)["anna"]
    assert floor.room_at(place) >= 0.85
    careless = WaitingSettings(clearance_m=0.0, travel_weight=0.0)
    at_door = floor.places({"anna": (1.0, 1.4)}, frontiers, settings=careless)["anna"]
    assert floor.room_at(at_door) < 0.85


def test_several_share_the_frontiers(floor: Floor) -> None:
    ends = [(0.8, 1.4), (9.8, 1.4)]
    places = floor.places({"anna": (9.0, 1.4), "ben": (1.0, 1.4)}, ends)
    assert places["anna"][0] > 7.5 and places["ben"][0] < 3.0


def test_it_keeps_away_from_others_and_their_ways(floor: Floor) -> None:
    occupied = [(x / 2, 1.4) for x in range(12, 21)]
    place = floor.places({"anna": (1.0, 1.4)}, [(9.8, 1.4)], occupied=occupied)["anna"]
    assert min(math.dist(place, other) for other in occupied) > 1.0


def test_the_way_there_counts_a_little(floor: Floor) -> None:
    # Anywhere between the two ends is as good; it stays where it is.
    settings = WaitingSettings(travel_weight=0.15)
    ends = [(0.8, 1.4), (9.8, 1.4)]
    place = floor.places({"anna": (7.0, 1.4)}, ends, settings=settings)["anna"]
    assert math.dist(place, (7.0, 1.4)) < 0.7


def test_where_nothing_is_wide_enough_as_wide_as_there_is_must_do(floor: Floor) -> None:
    settings = WaitingSettings(clearance_m=5.0)
    place = floor.places({"anna": (1.0, 1.4)}, [(9.8, 1.4)], settings=settings)["anna"]
    assert floor.room_at(place) >= 0.9


def test_close_frontiers_count_as_one_and_only_the_best_count(floor: Floor) -> None:
    frontiers = [(0.8, 1.4), (9.8, 1.2), (9.8, 1.6), (9.4, 1.4)]
    settings = WaitingSettings(frontiers_max=1, travel_weight=0.0)
    place = floor.places({"anna": (5.0, 1.4)}, frontiers, [2.0, 3.0, 1.0, 1.0], settings=settings)
    assert place["anna"][0] > 8.0
    both = floor.places({"anna": (5.0, 1.4)}, frontiers, [4.0, 3.0, 1.0, 1.0])
    assert both["anna"][0] > 8.0


def test_no_answer_where_there_is_none(floor: Floor) -> None:
    assert floor.places({"anna": (1.0, 1.4)}, []) == {}
    assert floor.places({}, [(9.8, 1.4)]) == {}
    walled_in = floor.places({"anna": (0.1, 6.8), "ben": (5.0, 1.4)}, [(9.8, 1.4)])
    assert list(walled_in) == ["ben"]
    everywhere = [(x / 2, y / 2) for x in range(24) for y in range(16)]
    assert floor.places({"anna": (1.0, 1.4)}, [(9.8, 1.4)], occupied=everywhere) == {}
    solid = np.zeros_like(floor.weights)
    nowhere = waiting_places(
        solid, floor.clearance, floor.geometry, [IdleRobot("anna", (1.0, 1.4))], [(2.0, 2.0)], [1.0]
    )
    assert nowhere == {}


def test_frontiers_without_gain(floor: Floor) -> None:
    place = floor.places({"anna": (3.0, 1.4)}, [(9.8, 1.4)], [0.0], settings=WaitingSettings())
    assert math.dist(place["anna"], (3.0, 1.4)) < 1.0


def test_a_fine_grid_is_made_coarser(floor: Floor) -> None:
    settings = WaitingSettings(cell_m=0.4, travel_weight=0.0)
    place = floor.places({"anna": (1.0, 1.4)}, [(9.8, 1.4)], settings=settings)["anna"]
    assert math.dist(place, (9.8, 1.4)) < 2.0
