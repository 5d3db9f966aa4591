from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mapping.grid import GridGeometry
from sim_world.scene import GridScene, WallScene
from sim_world.walls import build_walls
from sim_world.world_file import load_world


def box(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float]]:
    return [(x1, y1), (x2, y1), (x2, y2), (x1, y2)]


# A thick wall of two pieces that overlap, a box, a wall without thickness, two that cross.
SCENE = WallScene(
    build_walls(
        [box(2.0, -5.0, 2.2, 0.0), box(2.0, -0.2, 2.2, 5.0), box(4.0, 1.0, 5.0, 2.0)],
        [(6.0, -5.0, 6.0, 5.0), (8.0, 3.0, 9.0, 4.0), (8.0, 4.0, 9.0, 3.0)],
    )
)


@pytest.mark.parametrize(
    ("line", "count"),
    [
        ((0.0, 0.5, 1.0, 0.5), 0),
        ((0.0, 0.5, 3.0, 0.5), 1),  # both faces of a thick wall are one wall
        ((0.0, -0.1, 3.0, -0.1), 1),  # and so are two pieces where they overlap
        ((0.0, 0.5, 7.0, 0.5), 2),
        ((0.0, 1.5, 7.0, 1.5), 3),
        ((3.0, 2.5, 4.5, 0.5), 1),  # over a corner of the box
        ((3.0, -4.0, 3.0, 4.0), 0),  # along the walls
        ((6.0, -9.0, 6.0, 9.0), 0),  # within one: nothing stands across
        ((8.0, 3.5, 9.0, 3.5), 1),  # where two cross
        ((8.2, 3.0, 8.2, 4.0), 2),
        ((1.0, 1.0, 1.0, 1.0), 0),
    ],
)
def test_walls_are_counted_once_each(line: tuple[float, float, float, float], count: int) -> None:
    x1, y1, x2, y2 = line
    assert SCENE.walls_between(x1, y1, x2, y2) == count
    assert SCENE.walls_between(x2, y2, x1, y1) == count


def test_no_walls_are_none() -> None:
    assert WallScene(build_walls([])).walls_between(0.0, 0.0, 9.0, 9.0) == 0


ASIDE = [box(3.017, 2.01, 3.513, 7.019), box(6.011, 4.003, 9.007, 4.509)]
X, Y = st.floats(1.1, 8.9), st.floats(2.1, 8.9)


@given(X, Y, X, Y)
def test_a_wall_is_between_two_points_or_their_sight_is_free(
    x1: float, y1: float, x2: float, y2: float
) -> None:
    lined = WallScene(build_walls(ASIDE, [(1.0, 8.0, 5.0, 9.1)]))
    length = math.hypot(x2 - x1, y2 - y1)
    assume(length > 1e-3)
    points = [(x1 + s * (x2 - x1), y1 + s * (y2 - y1)) for s in np.linspace(0.0, 1.0, 100)]
    near = min(lined.clearance(x, y, 1.0) for x, y in points)
    count = lined.walls_between(x1, y1, x2, y2)
    if near > length / 99 + 1e-6:
        assert count == 0
    if any(lined.clearance(x, y, 1.0) == 0.0 for x, y in points[1:-1]):
        assert count >= 1
    assert lined.walls_between(x2, y2, x1, y1) == count


def grid_scene(rows: list[str]) -> GridScene:
    solid = np.array([[cell == "#" for cell in row] for row in rows[::-1]])
    return GridScene(solid, GridGeometry(0.5, -1.0, -1.0, *solid.shape))


GRID = grid_scene(["......", ".#.##.", ".#.##.", "....#.", "......"])


@pytest.mark.parametrize(
    ("line", "count"),
    [
        ((-0.75, 0.75, 1.75, 0.75), 2),
        ((-0.75, 0.25, 1.75, 0.25), 2),
        ((-0.75, -0.25, 1.75, -0.25), 1),
        ((-0.75, -0.75, 1.75, -0.75), 0),
        ((0.25, -0.75, 0.25, 1.25), 0),
        ((1.25, 1.25, 1.25, -0.75), 1),
        ((-9.0, 0.75, 9.0, 0.75), 2),  # outside nothing stands
        ((-0.75, 1.25, 1.75, -0.75), 3),  # out of an angle and in again
        ((0.3, 0.3, 0.3, 0.3), 0),
    ],
)
def test_runs_of_solid_cells_are_walls(line: tuple[float, ...], count: int) -> None:
    x1, y1, x2, y2 = line
    assert GRID.walls_between(x1, y1, x2, y2) == count
    assert GRID.walls_between(x2, y2, x1, y1) == count


@given(st.floats(-0.9, 1.9), st.floats(-0.9, 1.4), st.floats(-0.9, 1.9), st.floats(-0.9, 1.4))
def test_cells_and_the_same_walls_agree(x1: float, y1: float, x2: float, y2: float) -> None:
    lined = WallScene(
        build_walls([box(-0.5, 0.0, 0.0, 1.0), box(0.5, 0.0, 1.5, 1.0), box(1.0, -0.5, 1.5, 0.5)])
    )
    close = [(x, y) for x in (-0.5, 0.0, 0.5, 1.0, 1.5) for y in (-0.5, 0.0, 0.5, 1.0)]
    length = math.hypot(x2 - x1, y2 - y1)
    clear = length > 0.01 and all(
        abs((x2 - x1) * (y - y1) - (y2 - y1) * (x - x1)) > 1e-3 * length for x, y in close
    )
    upright = min(abs(x2 - x1), abs(y2 - y1)) > 1e-3
    ends = all(abs(v / 0.5 - round(v / 0.5)) > 1e-3 for v in (x1, y1, x2, y2))
    if clear and upright and ends:
        assert GRID.walls_between(x1, y1, x2, y2) == lined.walls_between(x1, y1, x2, y2)


def test_in_a_building_far_corners_have_more_walls_between_them() -> None:
    scene = load_world("office_single_corridor", 1).scene
    x_min, y_min, x_max, y_max = scene.extent
    assert scene.walls_between(x_min + 0.5, y_min + 0.5, x_max - 0.5, y_max - 0.5) >= 3
    assert scene.walls_between(x_min + 0.5, y_min + 0.5, x_min + 0.6, y_min + 0.5) == 0
