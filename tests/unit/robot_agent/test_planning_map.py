"""The robot's copy of the team's map: what deltas make of it equals what a snapshot does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.cell_box import CellBox
from mapping.distance_field import truncated_distance
from mapping.grid import CLEAR, OBSTACLE, UNKNOWN
from mapping.path_planning import cost_field, traversal_weights
from protocol.map_cells import pack_cells
from protocol.messages import MapDelta, MapSnapshot
from robot_agent.navigation_settings import PlanningMapSettings
from robot_agent.planning_map import PlanningMap

RESOLUTION = 0.1
SETTINGS = PlanningMapSettings(resolution_m=RESOLUTION, clearance_limit_m=0.5, largest_cells=10**6)


def empty() -> PlanningMap:
    return PlanningMap(0.25, SETTINGS)


def delta(number: int, log_odds: np.ndarray, x: int = 0, y: int = 0, res: float = 0.1) -> MapDelta:
    rows, cols = log_odds.shape
    return MapDelta(
        number=number,
        resolution_m=res,
        lattice_x=x,
        lattice_y=y,
        rows=rows,
        cols=cols,
        cells=pack_cells(log_odds.astype(np.float32)),
    )


def snapshot(number: int, log_odds: np.ndarray, x: float = 0.0, y: float = 0.0) -> MapSnapshot:
    rows, cols = log_odds.shape
    return MapSnapshot(
        number=number,
        resolution_m=RESOLUTION,
        origin_x_m=x,
        origin_y_m=y,
        rows=rows,
        cols=cols,
        cells=pack_cells(log_odds.astype(np.float32)),
    )


def check(held: PlanningMap) -> None:
    """All derived grids follow from the cells."""
    assert held.cells.shape == held.classes.shape == held.geometry.shape
    log_odds = held.cells / 20.0
    assert np.array_equal(held.classes == OBSTACLE, log_odds > np.log(0.65 / 0.35))
    assert np.array_equal(held.classes == CLEAR, log_odds < np.log(0.35 / 0.65))
    clearance = truncated_distance(held.classes == OBSTACLE, RESOLUTION, 0.5)
    assert np.array_equal(held.clearance, clearance)
    counted = held.clearance - np.float32(SETTINGS.tight_m) * (held._tried == 2)
    fresh = traversal_weights(
        held.clear, counted, held.clearance_least, SETTINGS.comfort_m, SETTINGS.squeeze_m
    )
    assert np.array_equal(held.weights, fresh)


def hall() -> np.ndarray:
    log_odds = np.full((20, 30), -3.0)
    log_odds[[0, -1]] = 3.0
    log_odds[:, [0, -1]] = 3.0
    return log_odds


def test_the_map_begins_empty() -> None:
    held = empty()
    assert held.number == 0
    assert (held.classes == UNKNOWN).all() and not held.weights.any()
    assert held.clearance_at(50.0, 50.0) == 0.0


def test_a_snapshot_is_taken_over() -> None:
    held = empty()
    assert held.apply_snapshot(snapshot(5, hall(), -1.0, 2.0)) == CellBox(0, 0, 20, 30)
    assert held.number == 5
    assert held.geometry.origin_x == pytest.approx(-1.0)
    check(held)
    assert held.clearance_at(0.0, 3.0) == pytest.approx(0.5)
    assert held.weights[10, 15] > 0 and held.weights[1, 1] == 0


def test_old_news_is_ignored() -> None:
    held = empty()
    held.apply_snapshot(snapshot(5, hall()))
    for number in (1, 5):
        assert held.apply_snapshot(snapshot(number, np.zeros((3, 3)))).empty
        box = held.apply_delta(delta(number, np.full((2, 2), 3.0), 5, 5))
        assert box is not None and box.empty
    assert held.geometry.shape == (20, 30) and held.number == 5


def test_a_gap_is_told() -> None:
    held = empty()
    assert held.apply_delta(delta(2, hall())) is None
    held.apply_snapshot(snapshot(5, hall()))
    assert held.apply_delta(delta(7, hall())) is None
    assert held.apply_delta(delta(6, hall(), res=0.2)) is None
    assert held.apply_delta(delta(6, np.full((1, 1), 3.0), 10, 5)) == CellBox(5, 10, 6, 11)
    assert held.number == 6
    check(held)


def test_the_first_delta_brings_its_resolution_and_the_map_grows() -> None:
    held = empty()
    assert held.apply_delta(delta(1, hall(), -40, -50, res=0.2)) is not None
    assert held.geometry.resolution == 0.2
    x, y = held.geometry.origin_x, held.geometry.origin_y
    iy, ix = held.geometry.cell_at(-40 * 0.2 + 0.1, -50 * 0.2 + 0.1)
    assert x <= -8.0 and y <= -10.0
    assert held.classes[iy, ix] == OBSTACLE and held.classes[iy + 1, ix + 1] == CLEAR


def test_the_map_grows_on_any_side() -> None:
    held = empty()
    held.apply_snapshot(snapshot(1, hall()))
    assert held.apply_delta(delta(2, np.full((4, 5), -3.0), -4, -3)) is not None
    assert held.classes[held.geometry.cell_at(-0.35, -0.25)] == CLEAR
    assert held.classes[held.geometry.cell_at(0.05, 0.15)] == OBSTACLE
    check(held)


def test_a_delta_beyond_all_reach_is_not_followed() -> None:
    held = empty()
    held.apply_snapshot(snapshot(1, hall()))
    assert held.apply_delta(delta(2, hall(), 10**7, 0)) is None


def test_damaged_bytes_change_nothing() -> None:
    held = empty()
    held.apply_snapshot(snapshot(1, hall()))
    bad = delta(2, hall()).model_copy(update={"cells": np.zeros(5, dtype=np.uint8)})
    with pytest.raises(ValueError):
        held.apply_delta(bad)
    assert held.number == 1
    check(held)


@given(
    st.lists(
        st.tuples(
            st.integers(0, 18),
            st.integers(0, 8),
            st.integers(1, 12),
            st.integers(1, 12),
            st.sampled_from([-3.0, 0.0, 3.0]),
        ),
        min_size=1,
        max_size=5,
    )
)
@settings(max_examples=15, deadline=None)
def test_deltas_keep_everything_in_step(changes: list[tuple[int, int, int, int, float]]) -> None:
    held = empty()
    held.apply_snapshot(snapshot(1, hall()))
    for k, (x, y, rows, cols, value) in enumerate(changes):
        box = held.apply_delta(delta(2 + k, np.full((rows, cols), value), x, y))
        assert box is not None
        assert (held.cells[box.slices] == round(20 * value)).all()
        corner = held.geometry.centre_of(box.iy0, box.ix0)
        assert corner == pytest.approx(((x + 0.5) * 0.1, (y + 0.5) * 0.1))
    check(held)


def two_rooms(width: int) -> np.ndarray:
    """Two rooms with a door between, so many cells wide, in a wall at x = 1.5 m."""
    log_odds = hall()
    log_odds[:, 15] = 3.0
    log_odds[10 - width // 2 : 10 - width // 2 + width, 15] = -3.0
    return log_odds


def leads_through(held: PlanningMap) -> bool:
    here, there = held.geometry.cell_at(0.75, 1.05), held.geometry.cell_at(2.25, 1.05)
    return cost_field(held.weights, here, RESOLUTION).reaches(*there)


def holding(log_odds: np.ndarray) -> PlanningMap:
    held = empty()
    held.apply_snapshot(snapshot(1, log_odds))
    assert held.take_changes() is None
    return held


def test_where_the_body_did_not_get_through_a_tight_door_is_shut_and_a_wide_one_is_not() -> None:
    tight, wide = holding(two_rooms(5)), holding(two_rooms(9))
    for held in (tight, wide):
        assert leads_through(held)
        held.refused((1.55, 1.05), 0.25)
        check(held)
        assert held.take_changes() not in ([], None)
    assert not leads_through(tight) and leads_through(wide)


def test_a_door_found_too_tight_opens_when_the_map_shows_it_wider_and_else_stays_shut() -> None:
    held = holding(two_rooms(5))
    held.refused((1.55, 1.05), 0.25)
    held.apply_delta(delta(2, np.full((1, 1), -3.0), -30, -30))
    assert held.take_changes() is None  # it has grown
    check(held)
    assert not leads_through(held)
    held.apply_delta(delta(3, two_rooms(9)))
    check(held)
    assert leads_through(held)


def test_no_robot_shuts_itself_in_where_it_has_been_before() -> None:
    held = holding(two_rooms(5))
    for x in np.arange(0.7, 2.3, 0.05):
        held.passed(float(x), 1.05)
    assert held.take_changes() == []
    held.refused((1.55, 1.05), 0.25)
    assert leads_through(held)
    stubborn = holding(two_rooms(5))
    stubborn.refused((1.55, 1.05), 0.25)
    stubborn.take_changes()
    for x in np.arange(0.7, 2.3, 0.05):
        stubborn.passed(float(x), 1.05)
    assert leads_through(stubborn) and stubborn.take_changes()


@pytest.mark.parametrize("place", [(50.0, 50.0), (-50.0, 0.0), (-1.0, 1.0), (1.0, -1.0)])
def test_what_was_tried_off_the_map_is_nothing(place: tuple[float, float]) -> None:
    held = holding(hall())
    tried = held._tried.copy()
    held.refused(place, 0.25)
    held.passed(*place)
    assert held.take_changes() == []
    assert np.array_equal(held._tried, tried)
    check(held)
