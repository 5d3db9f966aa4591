from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.match_map import MapSettings, MatchMap
from mapping.perceptual_model import PerceptionSettings, accumulate_information, scan_likelihood
from mapping.scan_points import scan_points
from tests.unit.mapping.rectangle import corridor_scan, rectangle_scan

SETTINGS = PerceptionSettings(sigma=0.05)


@pytest.fixture(scope="module")
def room() -> MatchMap:
    built = MatchMap(MapSettings(resolution=0.1))
    for x, theta in ((1.5, 0.0), (2.0, 1.0), (2.5, 2.0)):
        pose = Pose2(x, 1.4, theta)
        built.insert(rectangle_scan(pose, beams=120), pose)
    return built


def judge(room: MatchMap, points, pose: Pose2, chosen: PerceptionSettings = SETTINGS):
    return scan_likelihood(room.surfaces, room.grid.geometry, points, pose, chosen)


def test_the_true_pose_is_likelier_than_poses_around_it(room):
    pose = Pose2(1.8, 1.6, 0.3)
    points = scan_points(rectangle_scan(pose))
    best = judge(room, points, pose).value
    for dx, dy, dt in ((0.05, 0, 0), (-0.05, 0, 0), (0, 0.05, 0), (0, 0, 0.04), (0, 0, -0.04)):
        assert judge(room, points, Pose2(1.8 + dx, 1.6 + dy, 0.3 + dt)).value < best - 1.0


def test_free_space_is_unlikely_and_flat(room):
    point = np.array([[2.0, 1.5, -1.0, 0.0]])
    far = judge(room, point, Pose2(0.0, 0.0, 0.0))
    assert far.value == pytest.approx(math.log(SETTINGS.outlier))
    assert np.array_equal(far.gradient, np.zeros(3)) and np.array_equal(far.hessian, np.zeros((3, 3)))
    outside = judge(room, point, Pose2(100.0, -100.0, 0.0))
    assert outside.value == far.value


def test_the_weight_of_a_beam_scales_everything(room):
    points = scan_points(rectangle_scan(Pose2(1.8, 1.6, 0.3)))
    one = judge(room, points, Pose2(1.82, 1.6, 0.3))
    half = judge(room, points, Pose2(1.82, 1.6, 0.3), PerceptionSettings(0.05, 0.05, 0.5))
    assert half.value == pytest.approx(0.5 * one.value)
    assert np.allclose(half.gradient, 0.5 * one.gradient)
    assert np.allclose(half.hessian, 0.5 * one.hessian)


@given(st.floats(-0.12, 0.12), st.floats(-0.12, 0.12), st.floats(-0.1, 0.1))
@settings(max_examples=30, deadline=None)
def test_gradient_and_hessian_match_differences(room, dx, dy, dt):
    points = scan_points(rectangle_scan(Pose2(1.8, 1.6, 0.3)))
    at = np.array([1.8 + dx, 1.6 + dy, 0.3 + dt])
    here = judge(room, points, Pose2(*at))
    step = 1e-7
    # An end point that crosses into another cell in between jumps to another surfel: leave the few
    # beams out that do, by comparing beam by beam.
    numeric_gradient, numeric_hessian = np.zeros(3), np.zeros((3, 3))
    analytic_gradient, analytic_hessian = np.zeros(3), np.zeros((3, 3))
    for k in range(len(points)):
        beam = points[k : k + 1]
        middle = judge(room, beam, Pose2(*at))
        gradient, hessian = np.zeros(3), np.zeros((3, 3))
        for i in range(3):
            offset = np.zeros(3)
            offset[i] = step
            up = judge(room, beam, Pose2(*(at + offset)))
            down = judge(room, beam, Pose2(*(at - offset)))
            gradient[i] = (up.value - down.value) / (2 * step)
            hessian[i] = (up.gradient - down.gradient) / (2 * step)
        if abs(gradient - middle.gradient).max() < 1e-2 * (1.0 + abs(gradient).max()):
            numeric_gradient += gradient
            numeric_hessian += hessian
            analytic_gradient += middle.gradient
            analytic_hessian += middle.hessian
        else:
            assert abs(gradient).max() > 1e3 or k >= 0
    assert np.allclose(analytic_gradient, numeric_gradient, rtol=1e-3, atol=0.05)
    assert np.allclose(analytic_hessian, numeric_hessian, rtol=1e-3, atol=1.0)
    assert np.allclose(here.hessian, here.hessian.T)


def information_of(built: MatchMap, points, pose: Pose2):
    information = np.ones((3, 3))
    geometry = built.grid.geometry
    counts = accumulate_information(
        points, (pose.x, pose.y, pose.theta), built.surfaces.closest, built.surfaces.surfels,
        built.grid.log_odds, (geometry.origin_x, geometry.origin_y, geometry.resolution),
        0.05, 0.05, 0.3, information,
    )  # fmt: skip
    return information, counts


def test_information_at_the_true_pose_is_the_negative_hessian(room):
    pose = Pose2(1.8, 1.6, 0.3)
    points = scan_points(rectangle_scan(pose))
    information, (known, explained) = information_of(room, points, pose)
    assert known == explained == len(points)
    assert np.allclose(information, -judge(room, points, pose).hessian, rtol=0.1, atol=300.0)
    assert np.linalg.eigvalsh(information)[0] > 0.0


def test_a_corridor_says_nothing_of_the_way_along_it():
    built = MatchMap(MapSettings(resolution=0.1))
    for x in (0.0, 0.4, 0.8):
        built.insert(corridor_scan(Pose2(x, 0.0, 0.0)), Pose2(x, 0.0, 0.0))
    scan = corridor_scan(Pose2(0.6, 0.0, 0.0))
    information, _ = information_of(built, scan_points(scan), Pose2(0.6, 0.0, 0.0))
    assert information[0, 0] < 0.02 * information[1, 1]


def test_end_points_are_counted_by_what_is_known(room):
    points = np.array(
        [[2.0, 1.5, -1.0, 0.0], [4.0, 1.5, -1.0, 0.0], [4.7, 1.5, -1.0, 0.0], [99.0, 0.0, 1.0, 0.0]]
    )
    information, counts = information_of(room, points, Pose2(0.0, 0.0, 0.0))
    assert counts == (2, 1)
    assert information[0, 0] > 0.0
