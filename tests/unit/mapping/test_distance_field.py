import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.distance_field import reach_cells, truncated_distance, update_distance


def brute_force(obstacle: np.ndarray, resolution: float, limit: float) -> np.ndarray:
    field = np.full(obstacle.shape, limit)
    iy, ix = np.indices(obstacle.shape)
    for oy, ox in np.argwhere(obstacle):
        squared = (iy - oy) ** 2 + (ix - ox) ** 2
        field = np.minimum(field, resolution * np.sqrt(squared))
    return field.astype(np.float32)


@st.composite
def grids(draw: st.DrawFn) -> np.ndarray:
    rows, cols = draw(st.integers(1, 18)), draw(st.integers(1, 18))
    density = draw(st.sampled_from([0.0, 0.01, 0.05, 0.5, 1.0]))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    return rng.random((rows, cols)) < density


def test_one_obstacle() -> None:
    obstacle = np.zeros((5, 7), dtype=bool)
    obstacle[2, 3] = True
    field = truncated_distance(obstacle, 0.1, 0.3)
    assert field.dtype == np.float32
    assert field[2, 3] == 0.0
    assert field[2, 4] == pytest.approx(0.1)
    assert field[3, 4] == pytest.approx(0.1 * np.sqrt(2.0))
    assert field[0, 0] == pytest.approx(0.3)


def test_no_obstacle_gives_the_limit_everywhere() -> None:
    assert (truncated_distance(np.zeros((4, 4), dtype=np.uint8), 0.05, 0.5) == 0.5).all()


def test_reach_covers_the_limit() -> None:
    assert reach_cells(0.5, 0.05) == 10
    assert reach_cells(0.51, 0.05) == 11
    assert reach_cells(0.0, 0.05) == 0


@settings(max_examples=60, deadline=None)
@given(obstacle=grids(), limit=st.sampled_from([0.0, 0.05, 0.12, 0.4, 2.0]))
def test_equals_brute_force(obstacle: np.ndarray, limit: float) -> None:
    np.testing.assert_array_equal(
        truncated_distance(obstacle, 0.05, limit), brute_force(obstacle, 0.05, limit)
    )


@settings(max_examples=60, deadline=None)
@given(
    obstacle=grids(),
    limit=st.sampled_from([0.05, 0.12, 0.4]),
    corner=st.tuples(st.integers(0, 17), st.integers(0, 17)),
    size=st.tuples(st.integers(1, 6), st.integers(1, 6)),
    seed=st.integers(0, 1000),
)
def test_update_equals_the_full_computation(
    obstacle: np.ndarray,
    limit: float,
    corner: tuple[int, int],
    size: tuple[int, int],
    seed: int,
) -> None:
    field = truncated_distance(obstacle, 0.05, limit)
    before = field.copy()
    box = CellBox(*corner, corner[0] + size[0], corner[1] + size[1])
    part = obstacle[box.slices]
    part[...] = np.random.default_rng(seed).random(part.shape) < 0.3
    touched = update_distance(field, obstacle, box, 0.05, limit)
    np.testing.assert_array_equal(field, truncated_distance(obstacle, 0.05, limit))
    outside = np.ones(field.shape, dtype=bool)
    outside[touched.slices] = False
    np.testing.assert_array_equal(field[outside], before[outside])


def test_update_of_nothing_touches_nothing() -> None:
    field = np.full((6, 6), 7.0, dtype=np.float32)
    obstacle = np.ones((6, 6), dtype=bool)
    update_distance(field, obstacle, EMPTY_BOX, 0.05, 0.1)
    update_distance(field, obstacle, CellBox(50, 50, 60, 60), 0.05, 0.1)
    assert (field == 7.0).all()
