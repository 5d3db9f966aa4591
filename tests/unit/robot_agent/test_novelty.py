from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan
from robot_agent.novelty import unseen_area
from tests.unit.robot_agent.test_explorer import explorer_in, hall

_, HALL = explorer_in(hall())


def all_round(reach: float, beams: int = 180) -> LaserScan:
    ranges = np.full(beams, reach, dtype=np.float32)
    return LaserScan(ranges, -math.pi, 2.0 * math.pi / beams, 3.0, 0.0)


def test_in_a_place_that_is_known_nothing_is_new() -> None:
    assert unseen_area(HALL, all_round(0.8), IDENTITY) == 0.0


def test_far_from_all_that_is_known_everything_seen_is_new() -> None:
    seen = unseen_area(HALL, all_round(2.0), Pose2(50.0, 50.0, 0.0))
    assert seen == pytest.approx(math.pi * 1.75**2, rel=0.15)


def test_beams_to_be_ignored_show_nothing() -> None:
    assert unseen_area(HALL, all_round(0.0), Pose2(50.0, 50.0, 0.0)) == 0.0
