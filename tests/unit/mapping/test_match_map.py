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


def test_a_sealed_map_is_smaller_and_matches_alike():
    built = MatchMap(MapSettings(resolution=0.1))
    here = Pose2(1.0, 1.0, 0.5)
    built.insert(rectangle_scan(here, beams=120), here)
    scan, guess, prior = rectangle_scan(here, beams=90), Pose2(1.05, 0.96, 0.52), np.eye(3) * 0.01
    before, cells = built.match(scan, guess, prior), built.grid.log_odds.size
    built.seal()
    after = built.match(scan, guess, prior)
    assert built.grid.log_odds.size < 0.5 * cells
    assert built.surfaces.closest.shape[1:] == built.grid.geometry.shape
    assert after.T_map_base.distance_to(before.T_map_base) < 1e-9
    assert after.fit == before.fit and before.T_map_base.distance_to(here) < 0.02


def off_the_left_wall(refined: int, rng: np.random.Generator) -> float:
    """Return how far surfels lie off a wall seen from one place again and again, rms [m]."""
    T_room_base = Pose2(1.0, 1.0, 0.5)
    T_map_base = Pose2(1.05, 1.05, 0.5)  # the wall stands amid a column of cells
    built = MatchMap(MapSettings(resolution=0.1))
    scans = [rectangle_scan(T_room_base, beams=90, noise=0.03, rng=rng) for _ in range(refined + 2)]
    built.insert(scans[0], T_map_base)
    drawn = built.grid.log_odds.copy()
    for scan in scans[1:-1]:
        built.refine(scan, T_map_base)
    assert np.array_equal(built.grid.log_odds, drawn) and built.scans == 1
    built.insert(scans[-1], T_map_base)
    surfaces = built.surfaces
    places = surfaces.surfels[: surfaces.count][surfaces.occupied[: surfaces.count], :2]
    off = places[np.abs(places[:, 1] - 1.05) < 0.5, 0] - 0.05
    return float(np.sqrt((off[np.abs(off) < 0.1] ** 2).mean()))


def test_refining_draws_nothing_and_sharpens_the_walls():
    rng = np.random.default_rng(1)
    rough = np.mean([off_the_left_wall(0, rng) for _ in range(5)])
    fine = np.mean([off_the_left_wall(200, rng) for _ in range(5)])
    assert fine < 0.7 * rough


def test_a_map_without_a_scan_can_be_sealed():
    built = MatchMap(MapSettings(resolution=0.1))
    built.seal()
    assert built.grid.log_odds.shape == (1, 1)


def test_cautious_insertion_adds_walls_and_erases_none():
    built = MatchMap(MapSettings(resolution=0.1))
    # The wall's face, and the solid half a cell behind it, lie in one cell.
    scan = LaserScan(np.array([1.07], dtype=np.float32), 0.0, 0.1, 3.0, 0.0)
    far = LaserScan(np.array([3.0], dtype=np.float32), 0.0, 0.1, 3.0, 0.0)
    here = Pose2(0.05, 0.05, 0.0)
    built.insert(scan, here)
    wall = built.grid.geometry.cell_at(1.15, 0.05)
    for _ in range(5):
        built.insert(far, here, cautious=True)
    assert built.grid.log_odds[wall] > 0.4
    built.insert(scan, Pose2(0.05, 0.55, 0.0), cautious=True)
    assert built.grid.log_odds[built.grid.geometry.cell_at(1.15, 0.55)] > 0.4
    for _ in range(5):
        built.insert(far, here)
    assert built.grid.log_odds[built.grid.geometry.cell_at(1.15, 0.05)] < 0.0


def test_a_wall_at_the_very_edge_of_the_grid_is_drawn():
    # Grids begin at the lattice's origin and grow by many cells at once: the solid behind a wall
    # just inside must not fall off the edge.
    for resolution in (0.05, 0.1):
        for offset in (0.0, 0.2 * resolution, 0.4 * resolution):
            room = Pose2(offset, offset, 0.0)
            built = MatchMap(MapSettings(resolution=resolution))
            for theta in (0.0, 1.0):
                pose = Pose2(1.5, 1.4, theta)
                built.insert(rectangle_scan(pose, beams=360), room @ pose)
            walls = built.grid.log_odds > 0.4
            edge = built.grid.geometry.cell_at(offset - 0.5 * resolution, 1.4)[1]
            assert walls[:, edge : edge + 2].any(axis=1).sum() > 2.5 / resolution
