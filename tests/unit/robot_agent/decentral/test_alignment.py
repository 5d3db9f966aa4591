from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.placed_by_sight import Guess
from mapping.scan import LaserScan
from robot_agent.decentral.alignment import align, map_around
from tests.unit.rooms import room, scan_in

ROOM = room()
SEEN = [Pose2(0.2 * k, 0.1 * k, 0.3 * k) for k in range(5)]
T_MAP_OWN = Pose2(0.3, 0.2, 0.2)  # where the robot's own map truly lies


def guess(T_map_own: Pose2 = IDENTITY, place: float = 0.4, turn: float = math.radians(10)) -> Guess:
    return Guess(T_map_own, np.diag([place**2, place**2, turn**2]), seen=False)


def seen_from(*poses: Pose2) -> list[tuple[LaserScan, Pose2]]:
    return [(scan_in(ROOM, pose), pose) for pose in poses]


def own(*poses_map: Pose2) -> list[tuple[LaserScan, Pose2]]:
    """Scans from places in the room, with their poses in the robot's own map."""
    return [(scan_in(ROOM, pose), T_MAP_OWN.inverse() @ pose) for pose in poses_map]


def test_a_robot_finds_itself_in_what_the_others_saw() -> None:
    around = map_around(seen_from(*SEEN), IDENTITY, 0.1)
    fit = align(around, own(Pose2(0.5, 0.0, 0.4), Pose2(0.6, 0.1, 0.5)), guess())
    assert fit is not None
    assert fit.T_map_own.distance_to(T_MAP_OWN) < 0.06
    assert abs(fit.T_map_own.theta - T_MAP_OWN.theta) < math.radians(3.0)
    assert fit.points > 60
    assert fit.share > 0.9
    assert fit.sigma < 0.1


def test_scans_from_far_off_have_no_say_in_how_well_it_fits() -> None:
    around = map_around(seen_from(*SEEN), IDENTITY, 0.1)
    wrong = (scan_in(ROOM, Pose2(2.0, 0.0, 0.0)), Pose2(-9.0, 0.0, 0.0))
    (first,) = own(Pose2(0.5, 0.0, 0.4))
    with_it, without = (align(around, scans, guess()) for scans in ([first, wrong], [first]))
    assert with_it is not None
    assert with_it == without


def test_with_nothing_to_compare_there_is_no_fit() -> None:
    nothing = map_around([], IDENTITY, 0.1)
    assert align(nothing, own(IDENTITY), guess()) is None
    far = map_around(seen_from(Pose2(0.5, 0.0, 0.0)), Pose2(40.0, 0.0, 0.0), 0.1)
    assert far.scans == 0


def test_where_nothing_is_known_nothing_fits() -> None:
    around = map_around(seen_from(IDENTITY), IDENTITY, 0.1)
    (last,) = own(IDENTITY)
    fit = align(around, [last], guess(Pose2(9.0, 9.0, 0.0), 0.1, 0.1))
    assert fit is not None
    assert (fit.points, fit.share) == (0, 0.0)


@pytest.mark.parametrize(("scans", "drawn"), [(150, 150), (151, 76), (400, 134)])
def test_of_many_scans_evenly_some_are_drawn(scans: int, drawn: int) -> None:
    scan = scan_in(ROOM, IDENTITY)
    near = [(scan, IDENTITY)] * scans
    assert map_around(near, IDENTITY, 0.25).scans == drawn
