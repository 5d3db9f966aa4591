"""Search over cells."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mapping.grid import GridGeometry
from mapping.path_planning import cost_field
from robot_agent.route_search import NO_ESTIMATE, search_way, stamp_discs, standing_places

WEIGHTS = hnp.arrays(np.uint8, (9, 11), elements=st.sampled_from([0, 1, 1, 1, 3, 6]))


def only(cell: tuple[int, int], shape: tuple[int, int]) -> np.ndarray:
    target = np.zeros(shape, dtype=np.uint8)
    target[cell] = 1
    return target


def check_way(cells: np.ndarray, weights: np.ndarray, start: tuple[int, int]) -> None:
    assert tuple(cells[0]) == start
    steps = np.abs(np.diff(cells, axis=0))
    assert (steps.max(axis=1) == 1).all()
    assert weights[cells[1:, 0], cells[1:, 1]].all()


@given(WEIGHTS, st.integers(0, 8), st.integers(0, 10), st.integers(0, 8), st.integers(0, 10))
@settings(max_examples=60, deadline=None)
def test_the_way_is_the_cheapest(weights: np.ndarray, y: int, x: int, gy: int, gx: int) -> None:
    field = cost_field(weights, (y, x), 1.0)
    cells, units = search_way(weights, (y, x), only((gy, gx), weights.shape), NO_ESTIMATE)
    if not field.reaches(gy, gx):
        assert len(cells) == 0
        return
    assert units == field.units[gy, gx]
    assert tuple(cells[-1]) == (gy, gx)
    check_way(cells, weights, (y, x))


@given(WEIGHTS, st.lists(st.tuples(st.integers(0, 8), st.integers(0, 10)), max_size=12))
@settings(max_examples=60, deadline=None)
def test_an_estimate_helps_even_when_the_map_has_changed(
    weights: np.ndarray, blocked: list[tuple[int, int]]
) -> None:
    weights[0, 0] = weights[8, 10] = 1
    to_go = cost_field(weights, (8, 10), 1.0).units
    changed = weights.copy()
    for cell in blocked:
        changed[cell] = 0
    changed[8, 10] = 1
    field = cost_field(changed, (0, 0), 1.0)
    cells, units = search_way(changed, (0, 0), only((8, 10), changed.shape), to_go)
    assert (len(cells) > 0) == field.reaches(8, 10)
    if len(cells):
        check_way(cells, changed, (0, 0))
        assert tuple(cells[-1]) == (8, 10)
        # The estimate counts the other end of the way: it is off by one step at most.
        assert units <= field.units[8, 10] + 63


def test_no_way_slips_between_two_obstacles_that_have_come_up() -> None:
    weights = np.ones((9, 11), dtype=np.uint8)
    to_go = cost_field(weights, (8, 10), 1.0).units
    weights[0, 1] = weights[1, 0] = 0
    cells, _ = search_way(weights, (0, 0), only((8, 10), weights.shape), to_go)
    assert len(cells) == 0


def test_new_ways_are_found_with_an_old_estimate() -> None:
    walled = np.ones((9, 11), dtype=np.uint8)
    walled[:, 5] = 0
    to_go = cost_field(walled, (4, 10), 1.0).units
    walled[4, 5] = 1
    cells, _ = search_way(walled, (4, 0), only((4, 10), walled.shape), to_go)
    assert len(cells) == 11


def test_a_long_detour_is_given_up() -> None:
    weights = np.ones((21, 11), dtype=np.uint8)
    target = only((10, 10), weights.shape)
    to_go = cost_field(weights, (10, 10), 1.0).units
    weights[0:20, 5] = 0
    assert len(search_way(weights, (10, 0), target, to_go, 20)[0]) == 0
    assert len(search_way(weights, (10, 0), target, to_go, 100)[0]) > 11


def test_a_long_way_outgrows_the_first_queue() -> None:
    weights = np.ones((60, 60), dtype=np.uint8)
    cells, units = search_way(weights, (0, 0), only((59, 59), weights.shape), NO_ESTIMATE)
    assert len(cells) == 60 and units == 59 * 7


def test_no_way_from_off_the_grid() -> None:
    weights = np.ones((3, 3), dtype=np.uint8)
    assert len(search_way(weights, (-1, 0), weights, NO_ESTIMATE)[0]) == 0


def test_stamped_discs_are_round_and_clipped() -> None:
    geometry = GridGeometry(0.1, -1.0, -1.0, 20, 20)
    grid = np.ones(geometry.shape, dtype=np.uint8)
    stamp_discs(grid, geometry, np.array([[-1.0, -1.0], [0.5, 0.5], [90.0, 0.0]]), 0.3, 7)
    centres = geometry.centres_of(np.argwhere(np.ones(geometry.shape)))
    near = np.minimum(
        np.hypot(centres[:, 0] + 1.0, centres[:, 1] + 1.0),
        np.hypot(centres[:, 0] - 0.5, centres[:, 1] - 0.5),
    ).reshape(geometry.shape)
    assert (grid[near < 0.299] == 7).all() and (grid[near > 0.301] == 1).all()


def test_one_may_stand_at_the_goal_or_near_it_on_its_side_of_the_wall() -> None:
    weights = np.ones((7, 9), dtype=np.uint8)
    clear = np.ones(weights.shape, dtype=bool)
    clear[:, 4] = False
    weights[:, 3:6] = 0
    assert np.argwhere(standing_places(weights, clear, (3, 2), 3)).tolist() == [[3, 2]]
    places = standing_places(weights, clear, (3, 3), 3)
    assert places[3, 2] == 1 and places[:, 4:].sum() == 0
    assert places[3, 0] == 1 and places[0, 0] == 0
    assert standing_places(weights, clear, (3, -1), 3).any()
    assert not standing_places(weights, clear, (-9, -9), 3).any()
