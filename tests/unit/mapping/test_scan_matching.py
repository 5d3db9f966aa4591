from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.correlative_search import SearchWindow
from mapping.geometry import Pose2, wrap_angle
from mapping.match_map import MapSettings, MatchMap
from mapping.scan import LaserScan
from tests.unit.mapping.rectangle import corridor_scan, rectangle_scan

PRIOR = np.diag([0.05**2, 0.05**2, math.radians(2.0) ** 2])


def built_room(noise: float = 0.0) -> MatchMap:
    rng = np.random.default_rng(7)
    built = MatchMap(MapSettings(resolution=0.1))
    for x, theta in ((1.4, 0.0), (1.8, 1.0), (2.2, 2.0), (2.6, 3.0)):
        pose = Pose2(x, 1.4, theta)
        built.insert(rectangle_scan(pose, beams=80, noise=noise, rng=rng), pose)
    return built


@pytest.fixture(scope="module")
def room() -> MatchMap:
    return built_room()


@given(st.floats(-0.08, 0.08), st.floats(-0.08, 0.08), st.floats(-0.05, 0.05))
@settings(max_examples=15, deadline=None)
def test_newton_finds_the_pose_from_an_odometry_guess(room, dx, dy, dt):
    pose = Pose2(1.9, 1.6, 0.3)
    result = room.match(rectangle_scan(pose), Pose2(1.9 + dx, 1.6 + dy, 0.3 + dt), PRIOR)
    assert result.converged and result.fit > 0.9
    assert result.T_map_base.distance_to(pose) < 0.015
    assert abs(result.T_map_base.theta - pose.theta) < math.radians(0.4)


def test_noise_leaves_errors_of_the_size_the_covariance_says():
    built, rng = built_room(noise=0.03), np.random.default_rng(8)
    ratios = []
    for _ in range(12):
        pose = Pose2(rng.uniform(1.5, 2.5), rng.uniform(1.2, 1.8), rng.uniform(-3.0, 3.0))
        result = built.match(rectangle_scan(pose, noise=0.03, rng=rng), pose, PRIOR)
        error = result.T_map_base.as_array() - pose.as_array()
        ratios.append(error @ np.linalg.inv(result.covariance) @ error)
    assert 0.3 < np.mean(ratios) < 12.0


def test_a_kidnapped_guess_needs_the_window(room):
    pose = Pose2(1.9, 1.6, 0.3)
    guess = Pose2(1.9 + 0.5, 1.6 - 0.5, 0.3 + math.radians(15.0))
    wide = np.diag([0.7**2, 0.7**2, math.radians(15.0) ** 2])
    window = SearchWindow(0.8, math.radians(20.0), math.radians(3.0))
    result = room.match(rectangle_scan(pose, beams=36), guess, wide, window)
    assert result.T_map_base.distance_to(pose) < 0.03
    assert abs(wrap_angle(result.T_map_base.theta - pose.theta)) < math.radians(0.7)


@pytest.mark.parametrize("half_width", [1.0, 1.03])  # walls between two rows of cells, and not
def test_along_a_corridor_the_prior_keeps_its_variance(half_width):
    built = MatchMap(MapSettings(resolution=0.1))
    for x in (0.0, 0.4, 0.8):
        scan = corridor_scan(Pose2(x, 0.0, 0.0), half_width=half_width)
        built.insert(scan, Pose2(x, 0.0, 0.0))
    guess = Pose2(0.55, 0.05, 0.03)
    scan = corridor_scan(Pose2(0.6, 0.0, 0.0), half_width=half_width)
    result = built.match(scan, guess, PRIOR)
    assert result.covariance[0, 0] > 0.8 * PRIOR[0, 0]
    assert result.covariance[1, 1] < 0.1 * PRIOR[1, 1]
    assert result.T_map_base.x == pytest.approx(guess.x, abs=0.02)
    assert result.T_map_base.y == pytest.approx(0.0, abs=0.02)


def test_without_walls_the_prior_is_the_posterior():
    built, guess = MatchMap(), Pose2(1.0, 2.0, 3.0)
    blind = LaserScan(np.full(20, 8.0, dtype=np.float32), -1.0, 0.1, 8.0, 0.0)
    for window in (None, SearchWindow()):
        result = built.match(blind, guess, PRIOR, window)
        assert result.T_map_base.distance_to(guess) < 1e-9
        assert np.allclose(result.covariance, PRIOR)
        assert (result.known, result.explained, result.fit) == (0, 0, 0.0)
        assert result.converged


def test_a_wrong_place_is_told_by_the_fit(room):
    scan = rectangle_scan(Pose2(0.5, 0.5, 0.0), width=1.0, height=1.0)
    result = room.match(scan, Pose2(2.0, 1.5, 0.0), PRIOR)
    assert result.known > 40 and result.fit < 0.3


def test_the_posterior_peaks_at_the_pose(room):
    pose = Pose2(1.9, 1.6, 0.3)
    axis = np.linspace(-0.2, 0.2, 5)
    poses = np.array([(1.9 + dx, 1.6 + dy, 0.3) for dx in axis for dy in axis])
    values = room.posterior_density(rectangle_scan(pose), poses, pose, PRIOR)
    assert values.shape == (25,)
    assert int(values.argmax()) == 12
    assert values[12] - np.delete(values, 12).max() > 1.0
