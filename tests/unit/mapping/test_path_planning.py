import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.bucket_wave import BLOCKED, UNREACHED
from mapping.distance_field import truncated_distance
from mapping.grid import GridGeometry
from mapping.path_planning import (
    CARE_LEVELS,
    cost_field,
    nearest_reachable,
    path_to,
    reachable_near,
    smooth_path,
    traversal_weights,
)
from mapping.path_smoothing import line_care

RES = 0.1


@st.composite
def weight_grids(draw: st.DrawFn) -> np.ndarray:
    shape = draw(st.integers(2, 14)), draw(st.integers(2, 14))
    rng = np.random.default_rng(draw(st.integers(0, 100_000)))
    weights = rng.integers(1, 7, shape).astype(np.uint8)
    weights[rng.random(shape) < draw(st.sampled_from([0.0, 0.2, 0.4]))] = BLOCKED
    return weights


def test_weights_rise_towards_obstacles() -> None:
    obstacle = np.zeros((1, 40), dtype=bool)
    obstacle[0, 0] = True
    clearance = truncated_distance(obstacle, 0.05, 2.0)
    weights = traversal_weights(~obstacle, clearance, 0.25, 0.6)[0]
    assert weights[:5].max() == BLOCKED
    assert weights[5] == CARE_LEVELS
    assert (np.diff(weights[5:].astype(int)) <= 0).all()
    assert (weights[13:] == 1).all()
    assert set(weights[5:13]) == set(range(1, CARE_LEVELS + 1))


def test_without_comfort_costs_are_lengths() -> None:
    clearance = np.array([[0.1, 0.3, 0.9]], dtype=np.float32)
    weights = traversal_weights(np.ones((1, 3), dtype=bool), clearance, 0.25, 0.25)
    assert weights.tolist() == [[BLOCKED, 1, 1]]
    assert traversal_weights(np.zeros((1, 3), dtype=bool), clearance, 0.1, 0.2).max() == BLOCKED


def test_costs_in_the_open_are_lengths_within_the_metric() -> None:
    field = cost_field(np.ones((41, 41), dtype=np.uint8), (20, 20), RES)
    cells = np.argwhere(field.units > 0)
    straight = RES * np.hypot(*(cells - 20).T)
    ratio = field.at(cells) / straight
    assert ratio.min() == pytest.approx(0.98995, abs=1e-4)
    assert ratio.max() <= math.sqrt(1.16) + 1e-9
    assert field.cost[20, 21] == pytest.approx(RES)
    np.testing.assert_allclose(field.cost[cells[:, 0], cells[:, 1]], field.at(cells), rtol=1e-5)


def test_unreached_cells_and_cells_off_the_grid_cost_infinitely_much() -> None:
    weights = np.ones((3, 5), dtype=np.uint8)
    weights[:, 2] = BLOCKED
    field = cost_field(weights, (1, 0), RES)
    assert field.at([[1, 1], [1, 2], [1, 3], [-1, 0], [0, 5]]).tolist() == [RES] + 4 * [math.inf]
    assert np.isinf(field.cost[1, 3])
    assert field.reaches(1, 1)
    assert not field.reaches(1, 3)
    assert not field.reaches(3, 0)
    assert path_to(field, (1, 4)).shape == (0, 2)


def test_several_starts_share_one_field() -> None:
    weights = np.ones((3, 11), dtype=np.uint8)
    field = cost_field(weights, [(1, 0), (1, 10), (77, 0)], RES)
    assert field.at([(1, 2), (1, 9)]).tolist() == pytest.approx([0.2, 0.1])
    assert path_to(field, (1, 8))[0].tolist() == [1, 10]


def test_a_blocked_start_is_left_where_a_neighbour_is_free() -> None:
    weights = np.ones((3, 3), dtype=np.uint8)
    weights[1, 1] = BLOCKED
    field = cost_field(weights, (1, 1), RES)
    assert (field.units != UNREACHED).all()


@settings(max_examples=60, deadline=None)
@given(weights=weight_grids(), pick=st.integers(0, 10_000))
def test_paths_add_up_to_their_cost(weights: np.ndarray, pick: int) -> None:
    free = np.argwhere(weights != BLOCKED)
    if len(free) == 0:
        return
    start, goal = (tuple(int(v) for v in free[k % len(free)]) for k in (pick, pick // 7))
    field = cost_field(weights, start, RES)
    path = path_to(field, goal)
    if not field.reaches(*goal):
        assert len(path) == 0
        return
    assert path[0].tolist() == list(start)
    assert path[-1].tolist() == list(goal)
    units = 0
    for (ay, ax), (by, bx) in pairwise(path):
        assert max(abs(by - ay), abs(bx - ax)) == 1
        diagonal = ay != by and ax != bx
        if diagonal:
            assert weights[ay, bx] != BLOCKED
            assert weights[by, ax] != BLOCKED
        units += int(weights[by, bx]) * (7 if diagonal else 5)
    assert units == field.units[goal]


@settings(max_examples=60, deadline=None)
@given(weights=weight_grids(), pick=st.integers(0, 10_000))
def test_smoothed_paths_cross_no_blocked_cell_and_are_not_dearer(
    weights: np.ndarray, pick: int
) -> None:
    free = np.argwhere(weights != BLOCKED)
    if len(free) == 0:
        return
    start, goal = (tuple(int(v) for v in free[k % len(free)]) for k in (pick, pick // 7))
    path = path_to(cost_field(weights, start, RES), goal)
    if len(path) == 0:
        return
    geometry = GridGeometry(RES, 3.0, -2.0, *weights.shape)
    points = smooth_path(path, weights, geometry)
    corners = geometry.cells_at(points)
    assert corners[0].tolist() == list(start)
    assert corners[-1].tolist() == list(goal)
    heaviest = max(weights[tuple(c)] for c in path)
    for a, b in pairwise(corners):
        cost, line_heaviest = line_care(weights, *a, *b)
        assert math.isfinite(cost)
        assert line_heaviest <= heaviest


def test_long_paths() -> None:
    weights = np.ones((2, 700), dtype=np.uint8)
    path = path_to(cost_field(weights, (0, 0), RES), (0, 699))
    np.testing.assert_array_equal(path[:, 0], 0)
    assert len(path) == 700


def test_a_path_through_a_door_keeps_to_its_middle() -> None:
    obstacle = np.zeros((41, 60), dtype=bool)
    obstacle[:, 30] = True
    obstacle[15:26, 30] = False
    clearance = truncated_distance(obstacle, RES, 1.0)
    weights = traversal_weights(~obstacle, clearance, 0.25, 0.6)
    path = path_to(cost_field(weights, (14, 5), RES), (14, 55))
    assert 19 <= path[path[:, 1] == 30][0, 0] <= 21


def test_nearest_reachable() -> None:
    weights = np.ones((9, 9), dtype=np.uint8)
    weights[:, 6:] = BLOCKED
    field = cost_field(weights, (0, 0), RES)
    assert nearest_reachable(field, (4, 2), 0.5) == (4, 2)
    assert nearest_reachable(field, (4, 8), 0.35) == (4, 5)
    assert nearest_reachable(field, (4, 8), 0.25) is None
    assert nearest_reachable(field, (-2, 3), 0.2) == (0, 3)
    assert reachable_near(field, [(4, 8), (4, 4)], 0.25).tolist() == [[-1, -1], [4, 4]]


def test_of_equally_near_cells_the_cheapest_is_taken() -> None:
    weights = np.ones((1, 5), dtype=np.uint8)
    weights[0, 2] = BLOCKED
    assert nearest_reachable(cost_field(weights, [(0, 4), (0, 0)], RES), (0, 2), 0.3) == (0, 1)
    weights[0, 1] = 5
    assert nearest_reachable(cost_field(weights, [(0, 4), (0, 0)], RES), (0, 2), 0.3) == (0, 3)
