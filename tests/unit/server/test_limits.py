"""How large a map may grow."""

from __future__ import annotations

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from mapping.grid import GridGeometry
from mapping.scan import LaserScan
from server.limits import holds

GEOMETRY = GridGeometry(0.1, 0.0, 0.0, 10, 10)
SCAN = LaserScan(np.full(3, 2.0, np.float32), 0.0, 0.1, 8.0, 0.0)


def test_a_scan_nearby_is_held_and_one_far_away_is_not() -> None:
    assert holds(GEOMETRY, 10_000, SCAN, IDENTITY)
    assert not holds(GEOMETRY, 10_000, SCAN, Pose2(100.0, 100.0, 0.0))


def test_an_endless_beam_is_not_searched_for() -> None:
    endless = LaserScan(np.full(3, 900.0, np.float32), 0.0, 0.0, 1000.0, 0.0)
    assert not holds(GEOMETRY, 1_000_000, endless, Pose2(-850.0, 0.0, 0.0))
