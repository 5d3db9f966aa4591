from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry import Pose2
from mapping.grid import GridGeometry, OccupancyGrid
from mapping.scan import LaserScan
from mapping.scan_integration import integrate_scan, scan_extent
from mapping.scan_points import scan_points, turned_points
from mapping.surface_map import FAR, NO_SURFEL, SurfaceMap, SurfaceSettings, layer_of
from mapping.surfel_fitting import FEW_HITS
from tests.unit.mapping.rectangle import rectangle_scan


def take(grid: OccupancyGrid, surfaces: SurfaceMap, scan: LaserScan, pose: Pose2) -> None:
    surfaces.grow(grid.grow(*scan_extent(scan, pose)))
    box = integrate_scan(grid, scan, pose)
    surfaces.take(grid.geometry, turned_points(scan_points(scan), pose), 0.05)
    surfaces.refresh(grid, box)


def mapped(scans: int = 5, noise: float = 0.0, settings: SurfaceSettings | None = None):
    rng = np.random.default_rng(5)
    grid = OccupancyGrid.unknown(GridGeometry(0.1, 0.0, 0.0, 1, 1))
    surfaces = SurfaceMap((1, 1), settings)
    for _ in range(scans):
        pose = Pose2(rng.uniform(1.2, 2.8), rng.uniform(1.0, 2.0), rng.uniform(-3.0, 3.0))
        scan = rectangle_scan(pose, beams=90, noise=noise, rng=rng)
        take(grid, surfaces, scan, pose)
    return grid, surfaces


def surfel_at(grid: OccupancyGrid, surfaces: SurfaceMap, x: float, y: float, layer: int):
    return surfaces.surfels[surfaces.closest[(layer, *grid.geometry.cell_at(x, y))]]


def test_opposite_directions_lie_in_different_layers_even_if_both_are_off():
    for angle in np.linspace(-np.pi, np.pi, 73):
        for off in np.radians([-29.0, 0.0, 29.0]):
            back = angle + np.pi + off
            front = layer_of(np.cos(angle - off), np.sin(angle - off))
            assert front != layer_of(np.cos(back), np.sin(back))


def test_walls_lie_where_the_end_points_were_finer_than_a_cell():
    grid, surfaces = mapped(noise=0.02)
    right = surfel_at(grid, surfaces, 3.97, 1.5, layer_of(-1.0, 0.0))
    assert right[0] == pytest.approx(4.0, abs=0.01)
    top = surfel_at(grid, surfaces, 2.0, 2.97, layer_of(0.0, -1.0))
    assert top[1] == pytest.approx(3.0, abs=0.01)


def test_a_straight_wall_measures_across_only():
    grid, surfaces = mapped()
    a_xx, a_xy, a_yy = surfel_at(grid, surfaces, 3.97, 1.5, layer_of(-1.0, 0.0))[2:5]
    assert a_xx == pytest.approx(1.0, abs=1e-3)
    assert a_yy == pytest.approx(0.0, abs=1e-3) and a_xy == pytest.approx(0.0, abs=1e-2)


def test_a_post_measures_in_all_directions():
    grid = OccupancyGrid.unknown(GridGeometry(0.1, 0.0, 0.0, 1, 1))
    surfaces = SurfaceMap((1, 1), SurfaceSettings(doubt=0.0))
    scan = LaserScan(np.array([1.0], dtype=np.float32), 0.0, 0.1, 5.0, 0.0)
    trusts = []
    for _ in range(int(FEW_HITS)):
        take(grid, surfaces, scan, Pose2(0.0, 0.05, 0.0))
        surfel = surfel_at(grid, surfaces, 1.0, 0.05, layer_of(-1.0, 0.0))
        trusts.append(surfel[5])
    assert np.allclose(surfel, [1.0, 0.05, 1.0, 0.0, 1.0, 1.0], atol=1e-6)
    # A beam or two may as well have met a wall at a slant: they hold nothing yet.
    assert trusts == [0.0, 0.0, 0.0, 0.0, 1.0]


def test_walls_seen_longer_count_more():
    fresh, known = mapped(1), mapped()
    layer = layer_of(-1.0, 0.0)
    assert surfel_at(*fresh, 3.97, 1.5, layer)[5] < surfel_at(*known, 3.97, 1.5, layer)[5]


def test_the_two_faces_of_a_thin_wall_stay_apart():
    # A wall of 8 cm at x = 1, seen from the left and from the right.
    grid = OccupancyGrid.unknown(GridGeometry(0.1, 0.0, 0.0, 1, 1))
    surfaces = SurfaceMap((1, 1))
    bearings = np.linspace(-0.5, 0.5, 41)
    for x in (0.0, 2.08):
        reach = (1.0 / np.cos(bearings)).astype(np.float32)
        scan = LaserScan(reach, -0.5, 0.025, 5.0, 0.0)
        take(grid, surfaces, scan, Pose2(x, 0.0, 0.0 if x == 0.0 else np.pi))
    for layer, face in ((layer_of(-1.0, 0.0), 1.0), (layer_of(1.0, 0.0), 1.08)):
        assert surfel_at(grid, surfaces, 1.04, 0.01, layer)[0] == pytest.approx(face, abs=2e-3)


def test_a_wall_that_goes_away_is_forgotten():
    grid = OccupancyGrid.unknown(GridGeometry(0.1, 0.0, 0.0, 1, 1))
    surfaces = SurfaceMap((1, 1))
    here = Pose2(0.05, 0.05, 0.0)
    take(grid, surfaces, LaserScan(np.array([1.0], np.float32), 0.0, 0.1, 3.0, 0.0), here)
    assert (surfaces.closest != NO_SURFEL).any()
    for _ in range(4):
        take(grid, surfaces, LaserScan(np.array([3.0], np.float32), 0.0, 0.1, 3.0, 0.0), here)
    assert (surfaces.closest == NO_SURFEL).all() and (surfaces.squared == FAR).all()
    assert surfaces.count == 1 and not surfaces.occupied[0]


def test_growing_the_grid_moves_nothing():
    grid, surfaces = mapped()
    before = surfel_at(grid, surfaces, 3.97, 1.5, 1).copy()
    surfaces.grow(grid.grow(-15.0, -15.0, 20.0, 5.0))
    assert np.array_equal(surfel_at(grid, surfaces, 3.97, 1.5, 1), before)
    for k in range(surfaces.count):
        assert surfaces.owned[tuple(surfaces.cells[k])] == k


def test_room_is_made_for_any_number_of_surfels():
    _, surfaces = mapped(6, noise=0.1)
    assert surfaces.count > 256
    assert len(surfaces.sums) == len(surfaces.surfels) == len(surfaces.cells) >= surfaces.count


def test_old_end_points_are_forgotten():
    grid = OccupancyGrid.unknown(GridGeometry(0.1, 0.0, 0.0, 1, 1))
    surfaces = SurfaceMap((1, 1), SurfaceSettings(memory=4.0))
    for reach in [1.01] * 6 + [1.04] * 30:
        scan = LaserScan(np.array([reach], dtype=np.float32), 0.0, 0.1, 5.0, 0.0)
        take(grid, surfaces, scan, Pose2(0.0, 0.05, 0.0))
    assert surfaces.sums[0, 0] == pytest.approx(4.0)
    assert surfaces.sums[0, 1] / surfaces.sums[0, 0] == pytest.approx(1.04, abs=1e-3)


def test_end_points_outside_the_grid_are_left_out():
    grid = OccupancyGrid.unknown(GridGeometry(0.1, 0.0, 0.0, 5, 5))
    surfaces = SurfaceMap(grid.geometry.shape)
    surfaces.take(grid.geometry, np.array([[9.0, 9.0, 1.0, 0.0]]))
    surfaces.refresh(grid, grid.geometry.box)
    assert surfaces.count == 0
