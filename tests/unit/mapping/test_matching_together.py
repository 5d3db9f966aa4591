"""Scans of one robot are matched together, laid out by its own poses."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.correlative_search import SearchWindow
from mapping.geometry import IDENTITY, Pose2
from mapping.match_map import MapSettings, MatchMap
from mapping.matching_together import match_together, together
from mapping.placed_by_sight import Guess
from tests.unit.rooms import room, scan_in

ROOM = room()
TRUE = Pose2(0.3, 0.2, 0.2)
SEEN = [Pose2(0.2 * k, 0.1 * k, 0.3 * k) for k in range(5)]
OWN = [(scan_in(ROOM, TRUE @ pose), pose) for pose in (IDENTITY, Pose2(0.2, 0.0, 0.4))]


def drawn() -> MatchMap:
    made = MatchMap(MapSettings(resolution=0.1))
    made.insert_all([(scan_in(ROOM, pose), pose) for pose in SEEN])
    return made


def test_the_place_of_the_last_scan_is_found() -> None:
    guess = Guess(Pose2(0.1, 0.3, 0.1), np.diag([0.1, 0.1, 0.02]), seen=False)
    assert guess.sigmas == pytest.approx((0.1**0.5, 0.02**0.5))
    last = OWN[-1][1]
    places = match_together(drawn(), together(OWN, last), last, guess, SearchWindow(0.8, 0.4))
    assert places[0].T_map_base.distance_to(TRUE @ OWN[-1][1]) < 0.05
    values = [place.value for place in places]
    assert values == sorted(values, reverse=True)


@pytest.mark.parametrize(("most", "points"), [(None, 120), (60, 60), (500, 120)])
def test_of_many_end_points_evenly_some_take_part(most: int | None, points: int) -> None:
    assert together(OWN, IDENTITY, most).shape == (points, 4)
