from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import IDENTITY, Pose2
from mapping.grid import GridGeometry
from mapping.motion_model import MotionModel, gaussian_log_density, position_density

poses = st.builds(Pose2, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
moves = st.builds(Pose2, st.floats(-0.5, 0.5), st.floats(-0.3, 0.3), st.floats(-0.8, 0.8))


def test_one_metre_and_one_radian_give_the_sigmas_of_the_settings():
    model = MotionModel(slip_sigma=0.0)
    straight = model.covariance(Pose2(1.0, 0.0, 0.0))
    assert math.sqrt(straight[0, 0]) == pytest.approx(0.05, rel=1e-3)
    assert math.degrees(math.sqrt(straight[2, 2])) == pytest.approx(2.0, rel=1e-3)
    turn = model.covariance(Pose2(0.0, 0.0, 1.0))
    assert math.sqrt(turn[2, 2]) == pytest.approx(0.05, rel=1e-3)


def test_cutting_a_straight_way_into_pieces_changes_nothing():
    model = MotionModel(still_distance=0.0)
    start = Pose2(1.0, 2.0, 0.7)
    T, whole = model.propagate(start, np.zeros((3, 3)), Pose2(2.0, 0.0, 0.0))
    pose, pieces = start, np.zeros((3, 3))
    for _ in range(8):
        pose, pieces = model.propagate(pose, pieces, Pose2(0.25, 0.0, 0.0))
    assert np.allclose(pieces, whole, rtol=1e-9)
    assert pose.distance_to(T) < 1e-12


@given(poses, moves)
@settings(max_examples=40, deadline=None)
def test_propagation_is_the_linearised_composition(T_map_before, move):
    model = MotionModel()
    before = np.array([[0.02, 0.003, 0.001], [0.003, 0.01, -0.002], [0.001, -0.002, 0.03]])
    after, grown = model.propagate(T_map_before, before, move)
    shift = np.eye(3)
    shift[0, 2], shift[1, 2] = -(after.y - T_map_before.y), after.x - T_map_before.x
    turn = np.eye(3)
    c, s = math.cos(T_map_before.theta), math.sin(T_map_before.theta)
    turn[:2, :2] = [[c, -s], [s, c]]
    expected = shift @ before @ shift.T + turn @ model.covariance(move) @ turn.T
    assert np.allclose(grown, expected, atol=1e-12)
    assert np.linalg.eigvalsh(grown)[0] > 0.0


def test_samples_have_the_mean_and_covariance_of_the_model():
    model, move = MotionModel(), Pose2(0.8, 0.1, 0.3)
    rng = np.random.default_rng(1)
    start = Pose2(1.0, -1.0, 0.5)
    drawn = model.sample(np.tile(start.as_array(), (40_000, 1)), move, rng)
    mean = model.mean(start, move)
    assert np.allclose(drawn.mean(axis=0), mean.as_array(), atol=2e-3)
    _, expected = model.propagate(start, np.zeros((3, 3)), move)
    assert np.allclose(np.cov(drawn.T), expected, atol=6e-5)


@given(poses, moves, st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
@settings(max_examples=30, deadline=None)
def test_the_gradient_of_the_density_matches_differences(T_map_before, move, dx, dy, dt):
    model = MotionModel()
    mean = model.mean(T_map_before, move)
    at = np.array([mean.x + dx, mean.y + dy, mean.theta + dt])
    value, gradient = model.log_density_gradient(Pose2(*at), T_map_before, move)
    assert value <= model.log_density(mean, T_map_before, move)
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-5
        up = model.log_density(Pose2(*(at + step)), T_map_before, move)
        down = model.log_density(Pose2(*(at - step)), T_map_before, move)
        assert gradient[i] == pytest.approx((up - down) / 2e-5, rel=1e-4, abs=1e-2)


def test_a_robot_at_rest_keeps_a_proper_density():
    model = MotionModel()
    assert np.linalg.eigvalsh(model.covariance(IDENTITY))[0] > 0.0
    assert math.isfinite(model.log_density(IDENTITY, IDENTITY, IDENTITY))


def test_the_density_integrates_to_one():
    covariance = np.diag([0.04, 0.09, 0.01])
    axes = [np.linspace(-5 * s, 5 * s, 21) for s in (0.2, 0.3, 0.1)]
    total = sum(
        math.exp(gaussian_log_density(Pose2(x, y, t), IDENTITY, covariance)[0])
        for x in axes[0]
        for y in axes[1]
        for t in axes[2]
    )
    volume = np.prod([axis[1] - axis[0] for axis in axes])
    assert total * volume == pytest.approx(1.0, rel=1e-3)


def test_the_posterior_after_a_long_way_bends_like_a_banana():
    # Figure 1: far along a straight way the cloud is wider across than along, and it is curved:
    # poses far off to the side lie behind those in the middle.
    model = MotionModel(drift_sigma=math.radians(6.0))
    rng = np.random.default_rng(4)
    cloud = model.posterior_after([IDENTITY, Pose2(6.0, 0.0, 0.0)], rng, samples=3000)
    assert cloud[:, 1].std() > 2.0 * cloud[:, 0].std()
    side = abs(cloud[:, 1])
    assert cloud[side > 1.5, 0].mean() < cloud[side < 0.3, 0].mean() - 0.1


def test_the_posterior_follows_arcs():
    model = MotionModel(1e-4, 1e-5, 1e-5, 1e-5)
    path = [IDENTITY, Pose2(1.0, 1.0, math.pi / 2), Pose2(0.0, 2.0, math.pi)]
    cloud = model.posterior_after(path, np.random.default_rng(0), samples=50)
    assert np.allclose(cloud[:, :2], [0.0, 2.0], atol=2e-3)
    turned = model.posterior_after(
        [IDENTITY, Pose2(0.0, 0.0, 2.0)], np.random.default_rng(0), samples=5
    )
    assert np.allclose(turned, [0.0, 0.0, 2.0], atol=1e-3)


def test_density_counts_poses_per_square_metre():
    cloud = np.array([[0.05, 0.05, 0.0], [0.06, 0.01, 1.0], [0.15, 0.05, 0.0], [9.0, 9.0, 0.0]])
    density = position_density(cloud, GridGeometry(0.1, 0.0, 0.0, 1, 2))
    assert np.allclose(density, [[0.5 / 0.01, 0.25 / 0.01]])
