"""What is free to drive."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_agent.avoidance import ARC_STEP, best_curvature, calmed, free_way

NOBODY = np.empty((0, 5))
REACH = 0.27


def way(points: list[tuple[float, float]], curvature: float = 0.0, bodies=NOBODY, speed=0.5):
    array = np.array(points, dtype=np.float64).reshape(-1, 2)
    return free_way(array, REACH, np.array(bodies).reshape(-1, 5), curvature, speed, 1.0, 0)


def test_nothing_around() -> None:
    free, nearest, teammate = way([])
    assert free == 1.0 and nearest > 100.0 and not teammate
    assert way([(5.0, 0.0)])[0] == 1.0


def test_a_wall_ahead_ends_the_way_before_it() -> None:
    free, nearest, _ = way([(0.8, 0.0)])
    assert 0.8 - REACH - ARC_STEP <= free <= 0.8 - REACH
    assert nearest == pytest.approx(0.8 - free, abs=1e-9)


def test_a_wall_beside_only_tells_its_distance() -> None:
    free, nearest, _ = way([(0.5, 0.3)])
    assert free == 1.0 and nearest == pytest.approx(0.3, abs=0.01)


def test_an_arc_leads_round() -> None:
    assert way([(0.8, 0.0)], curvature=1.6)[0] > 0.75
    assert way([(0.5, 0.5)], curvature=2.0)[0] < 0.5


@given(st.floats(0.05, 0.26), st.floats(-3.1, 3.1), st.sampled_from([-2.0, 0.0, 2.0]))
@settings(max_examples=60, deadline=None)
def test_what_is_too_near_already_must_not_come_nearer(
    away: float, bearing: float, curvature: float
) -> None:
    x, y = away * np.cos(bearing), away * np.sin(bearing)
    free, _, _ = way([(x, y)], curvature=curvature)
    if bearing > 2.0 or bearing < -2.0:
        assert free > 0.5
    if abs(bearing) < 1.0:
        assert free == 0.0


def test_a_teammate_is_met_where_it_will_be() -> None:
    crossing = [(0.6, -0.8, 0.0, 0.5, 0.56)]
    assert way([], bodies=crossing)[0] < 1.0
    assert way([], bodies=crossing)[2]
    leaving = [(0.7, 0.0, 0.5, 0.0, 0.56)]
    assert way([], bodies=leaving)[0] == 1.0
    standing = [(0.7, 0.0, 0.0, 0.0, 0.56)]
    assert way([], bodies=standing)[0] < 0.2
    too_near_behind = [(-0.4, 0.0, 0.0, 0.0, 0.56)]
    assert way([], bodies=too_near_behind)[0] == 1.0


def test_the_best_arc_goes_round_an_obstacle() -> None:
    curves = np.linspace(-3.0, 3.0, 13)
    points = np.array([[0.45, 0.1], [0.45, 0.2]])
    curvature, left = best_curvature(points, REACH, NOBODY, curves, 0.5, 0.8, 0.6, 0.0)
    assert curvature < 0.0 and left < 0.45
    wall = np.column_stack((np.full(41, 0.3), np.linspace(-1, 1, 41)))
    curvature, left = best_curvature(wall, REACH, NOBODY, curves, 0.5, 0.8, 0.6, 0.0)
    assert left == pytest.approx(0.6) and curvature == 0.0


def test_noise_is_averaged_but_single_things_stay() -> None:
    rng = np.random.default_rng(1)
    wall = np.column_stack((np.full(101, 1.0), np.linspace(-1, 1, 101)))
    noisy = wall + rng.normal(0.0, 0.03, wall.shape) * (1.0, 0.0)
    calm = calmed(noisy)
    assert np.std(calm[:, 0]) < 0.6 * np.std(noisy[:, 0])
    pole = np.array([[2.0, -0.5], [0.5, 0.0], [2.0, 0.5]])
    assert np.array_equal(calmed(pole), pole)
    assert calmed(np.empty((0, 2))).shape == (0, 2)
