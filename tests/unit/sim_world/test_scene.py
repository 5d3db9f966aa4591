import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.grid import GridGeometry
from sim_world.scene import GridScene, WallScene, draw_solid, rasterise
from sim_world.walls import build_walls

OUTER = [[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3], [0, 3, 0, 0]]
BOX = [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]


@pytest.fixture
def walls_scene():
    return WallScene(build_walls([BOX], OUTER))


@pytest.fixture
def grid_scene():
    solid = np.zeros((6, 8), dtype=bool)
    solid[2:4, 2:4] = True
    return GridScene(solid, GridGeometry(0.5, 0.0, 0.0, 6, 8))


@pytest.mark.parametrize("kind", ["walls_scene", "grid_scene"])
def test_both_kinds_agree_on_the_same_room(kind, request):
    scene = request.getfixturevalue(kind)
    assert scene.extent == (0.0, 0.0, 4.0, 3.0)
    ranges = scene.cast(Pose2(0.5, 1.5, 0.0), np.array([0.0, math.pi]), 10.0)
    assert ranges == pytest.approx([0.5, 0.5])
    assert scene.clearance(0.6, 1.5, 2.0) == pytest.approx(0.4)
    assert scene.clearance(3.0, 1.5, 0.25) == pytest.approx(0.25)
    assert scene.clearance(1.5, 1.5, 1.0) == 0.0
    assert scene.clearance(-1.0, 1.5, 1.0) == 0.0
    assert scene.clearance(2.3, 2.4, 1.0) == pytest.approx(0.5)
    assert scene.collides(0.2, 1.5, 0.25)
    assert not scene.collides(0.3, 1.5, 0.25)
    assert scene.collides(1.5, 1.5, 0.1)
    assert scene.collides(9.0, 9.0, 0.25)


def test_clearance_of_a_grid_knows_open_space():
    scene = GridScene(np.zeros((40, 40), dtype=bool), GridGeometry(0.1, 0.0, 0.0, 40, 40))
    assert scene.clearance(2.0, 2.0, 0.3) == pytest.approx(0.3)
    assert scene.clearance(2.0, 0.2, 0.3) == pytest.approx(0.2)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 2.0), st.floats(0.0, 1.6), st.floats(0.05, 0.7))
def test_grid_clearance_equals_brute_force(seed, x, y, limit):
    solid = np.random.default_rng(seed).random((8, 10)) < 0.1
    scene = GridScene(solid, GridGeometry(0.2, 0.0, 0.0, 8, 10))
    expected = limit
    for iy, ix in np.argwhere(np.pad(solid, 5, constant_values=True)) - 5:
        off_x = max(ix * 0.2 - x, x - (ix + 1) * 0.2, 0.0)
        off_y = max(iy * 0.2 - y, y - (iy + 1) * 0.2, 0.0)
        expected = min(expected, math.hypot(off_x, off_y))
    assert scene.clearance(x, y, limit) == pytest.approx(expected, abs=1e-9)


def test_truth_of_walls_is_closed_and_filled(walls_scene):
    solid, geometry = walls_scene.free_truth(0.1)
    assert solid[0].all() and solid[-1].all() and solid[:, 0].all() and solid[:, -1].all()
    assert solid[geometry.cell_at(1.5, 1.5)]
    assert not solid[geometry.cell_at(3.0, 1.5)]
    assert solid[geometry.cell_at(4.0, 1.5)]
    # the box has 10 x 10 cells, its faces on cell lines
    inner = geometry.box_around(0.3, 0.3, 3.7, 2.7)
    assert np.count_nonzero(solid[inner.slices]) == 100
    assert walls_scene.free_truth(0.1)[0] is solid


def test_truth_of_a_grid_is_the_grid(grid_scene):
    solid, geometry = grid_scene.free_truth(0.05)
    assert solid is grid_scene.solid
    assert geometry.resolution == 0.5


def test_a_thin_slanted_wall_has_no_holes():
    thin = [[0.3, 0.3], [0.32, 0.28], [2.72, 2.08], [2.7, 2.1]]
    outer = [[0, 0, 3, 0], [3, 0, 3, 3], [3, 3, 0, 3], [0, 3, 0, 0]]
    walls = build_walls([thin], outer)
    solid, geometry = WallScene(walls).free_truth(0.05)
    for share in np.linspace(0.0, 1.0, 200):
        x, y = 0.31 + share * 2.4, 0.29 + share * 1.8
        assert solid[geometry.cell_at(x, y)]


def test_solids_outside_the_drawing_are_ignored():
    geometry = GridGeometry(0.5, 0.0, 0.0, 4, 4)
    solid = np.zeros(geometry.shape, dtype=bool)
    draw_solid(solid, geometry, np.array([[9.0, 9.0], [9.1, 9.0], [9.1, 9.1], [9.0, 9.1]]))
    assert not solid.any()
    assert rasterise(build_walls([], [[0, 0, 2, 2]]), geometry).trace() == 4
