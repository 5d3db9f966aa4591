"""Following a path."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from robot_agent.navigation_settings import DrivingSettings
from robot_agent.path_following import DrivenPath, evenly_spaced, pursue

SETTINGS = DrivingSettings()


def path_of(*corners: tuple[float, float], gap: float = 0.7) -> DrivenPath:
    points = evenly_spaced(np.array(corners, dtype=np.float64), 0.1)
    return DrivenPath(points, np.full(len(points), gap))


@given(
    st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=8),
    st.floats(0.05, 0.5),
)
@settings(max_examples=60, deadline=None)
def test_even_spacing_keeps_ends_and_the_line(corners: list, spacing: float) -> None:
    points = np.array(corners)
    spaced = evenly_spaced(points, spacing)
    assert len(spaced) >= 2
    assert np.allclose(spaced[0], points[0]) and np.allclose(spaced[-1], points[-1])
    assert np.hypot(*np.diff(spaced, axis=0).T).max() <= spacing + 1e-9


def test_lengths_and_points() -> None:
    path = path_of((0, 0), (2, 0), (2, 1))
    assert path.length == pytest.approx(3.0)
    assert path.end == pytest.approx((2.0, 1.0))
    path.advance(1.0, 0.2)
    assert path.at == pytest.approx(1.0) and path.off == pytest.approx(0.2)
    assert path.remaining == pytest.approx(2.0)
    assert path.point_at(2.5) == pytest.approx((2.0, 0.5))
    ahead = path.ahead(1.5, 0.3)
    assert np.allclose(ahead[0], (1.0, 0.0)) and np.allclose(ahead[-1], (2.0, 0.5))
    assert np.allclose(path.ahead(9.0)[-1], (2.0, 1.0))


def test_the_robot_is_not_found_on_another_part_of_the_path() -> None:
    path = path_of((0, 0), (3, 0), (3, 0.4), (0, 0.4))
    path.advance(0.5, 0.35)
    assert path.at == pytest.approx(0.5, abs=0.01)


def test_blocked_cells_ahead() -> None:
    path = path_of((0.05, 0.05), (2.95, 0.05))
    weights = np.ones((1, 30), dtype=np.uint8)
    assert path.first_blocked(weights, 0.0, 0.0, 0.1, 5.0) == math.inf
    weights[0, 20] = 0
    path.advance(1.05, 0.05)
    assert path.first_blocked(weights, 0.0, 0.0, 0.1, 5.0) == pytest.approx(1.0, abs=0.11)
    assert path.first_blocked(weights, 0.0, 0.0, 0.1, 0.5) == math.inf
    assert path.first_blocked(weights, 5.0, 0.0, 0.1, 5.0) == pytest.approx(0.0, abs=0.11)


def follow(path: DrivenPath, pose: Pose2, turning: bool = False):
    path.advance(pose.x, pose.y)
    return pursue(path, pose, SETTINGS, 0.5, 1.2, turning)


def test_straight_on_at_full_speed() -> None:
    wish = follow(path_of((0, 0), (5, 0)), Pose2(1.0, 0.0, 0.0))
    assert wish.speed == 0.5 and wish.turn_rate == pytest.approx(0.0)
    assert wish.target_base == pytest.approx((0.5, 0.0)) and not wish.on_spot


def test_tight_places_are_followed_closely() -> None:
    wish = follow(path_of((0, 0), (5, 0), gap=0.35), Pose2(1.0, 0.0, 0.0))
    assert wish.target_base == pytest.approx((0.32, 0.0))


def test_turning_back_is_done_on_the_spot_until_aligned() -> None:
    path = path_of((0, 0), (5, 0))
    wish = follow(path, Pose2(1.0, 0.0, 3.0))
    assert wish.on_spot and wish.speed == 0.0 and wish.turn_rate == -1.2
    assert not follow(path, Pose2(1.0, 0.0, 1.0)).on_spot
    assert follow(path, Pose2(1.0, 0.0, 1.0), turning=True).on_spot
    assert not follow(path, Pose2(1.0, 0.0, 0.2), turning=True).on_spot


@given(st.floats(-1.0, 1.0), st.floats(-3.1, 3.1))
@settings(max_examples=80, deadline=None)
def test_commands_stay_within_the_drive_and_point_to_the_path(offset: float, theta: float) -> None:
    wish = follow(path_of((0, 0), (6, 0)), Pose2(2.0, offset, theta))
    assert 0.0 <= wish.speed <= 0.5 and abs(wish.turn_rate) <= 1.2 + 1e-9
    if abs(wish.target_base[1]) > 0.05:
        assert wish.turn_rate * wish.target_base[1] > 0.0
