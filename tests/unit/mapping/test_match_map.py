from __future__ import annotations

import numpy as np

from mapping.geometry import Pose2
from mapping.match_map import MapSettings, MatchMap
from mapping.scan import LaserScan
from tests.unit.mapping.rectangle import rectangle_scan


def test_grid_and_walls_grow_together_and_stay_in_step():
    built = MatchMap(MapSettings(resolution=0.1))
    for x in (1.03, -30.02):  # walls off the lattice, not between two rows of cells
        pose = Pose2(x, 1.04, 0.5)
        box = built.insert(rectangle_scan(Pose2(1.0, 1.0, 0.5), beams=40), pose)
        assert not box.empty
        assert built.surfaces.closest.shape[1:] == built.grid.geometry.shape
    assert built.scans == 2
    threshold = built.settings.surface.occupied_above
    walls = built.grid.log_odds > threshold
    assert np.array_equal((built.surfaces.squared == 0).any(axis=0), walls)


def test_cautious_insertion_adds_walls_and_erases_none():
    built = MatchMap(MapSettings(resolution=0.1))
    scan = LaserScan(np.array([1.0], dtype=np.float32), 0.0, 0.1, 3.0, 0.0)
    far = LaserScan(np.array([3.0], dtype=np.float32), 0.0, 0.1, 3.0, 0.0)
    here = Pose2(0.05, 0.05, 0.0)
    built.insert(scan, here)
    wall = built.grid.geometry.cell_at(1.05, 0.05)
    for _ in range(5):
        built.insert(far, here, cautious=True)
    assert built.grid.log_odds[wall] > 0.4
    built.insert(scan, Pose2(0.05, 0.55, 0.0), cautious=True)
    assert built.grid.log_odds[built.grid.geometry.cell_at(1.05, 0.55)] > 0.4
    for _ in range(5):
        built.insert(far, here)
    assert built.grid.log_odds[built.grid.geometry.cell_at(1.05, 0.05)] < 0.0
