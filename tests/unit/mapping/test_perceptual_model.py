from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.match_map import MapSettings, MatchMap
from mapping.perceptual_model import (
    PerceptionSettings,
    accumulate_information,
    best_trust,
    scan_likelihood,
)
from mapping.scan_points import scan_points, turned_points
from mapping.surface_map import SurfaceSettings, layer_of
from tests.unit.mapping.rectangle import corridor_scan, rectangle_scan

SETTINGS = PerceptionSettings(sigma=0.05)

# Where the room lies in the map: off the lattice, so that no wall runs between two rows of cells.
ROOM = Pose2(0.03, 0.04, 0.0)
HERE = ROOM @ Pose2(1.8, 1.6, 0.3)


def seen_here(beams: int = 61):
    return scan_points(rectangle_scan(Pose2(1.8, 1.6, 0.3), beams=beams))


@pytest.fixture(scope="module")
def room() -> MatchMap:
    built = MatchMap(MapSettings(resolution=0.1, surface=SurfaceSettings(doubt=0.0)))
    for x, theta in ((1.5, 0.0), (2.0, 1.0), (2.5, 2.0)):
        pose = Pose2(x, 1.4, theta)
        built.insert(rectangle_scan(pose, beams=120), ROOM @ pose)
    return built


def judge(room: MatchMap, points, pose: Pose2, chosen: PerceptionSettings = SETTINGS):
    return scan_likelihood(room.surfaces, room.grid.geometry, points, pose, chosen)


def test_the_true_pose_is_likelier_than_poses_around_it(room):
    points = seen_here()
    best = judge(room, points, HERE).value
    for dx, dy, dt in ((0.05, 0, 0), (-0.05, 0, 0), (0, 0.05, 0), (0, 0, 0.04), (0, 0, -0.04)):
        assert (
            judge(room, points, Pose2(HERE.x + dx, HERE.y + dy, HERE.theta + dt)).value < best - 1.0
        )


def test_free_space_is_unlikely_and_flat(room):
    point = np.array([[2.0, 1.5, -1.0, 0.0]])
    far = judge(room, point, Pose2(0.0, 0.0, 0.0))
    assert far.value == pytest.approx(math.log(SETTINGS.outlier))
    assert np.array_equal(far.gradient, np.zeros(3)) and np.array_equal(
        far.hessian, np.zeros((3, 3))
    )
    outside = judge(room, point, Pose2(100.0, -100.0, 0.0))
    assert outside.value == far.value


def test_the_weight_of_a_beam_scales_everything(room):
    points = seen_here()
    one = judge(room, points, HERE)
    half = judge(room, points, HERE, PerceptionSettings(0.05, 0.05, 0.5))
    assert half.value == pytest.approx(0.5 * one.value)
    assert np.allclose(half.gradient, 0.5 * one.gradient)
    assert np.allclose(half.hessian, 0.5 * one.hessian)


def surfels_under(room: MatchMap, points, pose: Pose2):
    """Return the surfel each point is compared with; derivatives hold only while it is the same."""
    turned = turned_points(points, pose)
    cells = room.grid.geometry.cells_at(turned[:, :2])
    layers = [layer_of(nx, ny) for nx, ny in turned[:, 2:]]
    return room.surfaces.closest[layers, cells[:, 0], cells[:, 1]]


@given(st.floats(-0.12, 0.12), st.floats(-0.12, 0.12), st.floats(-0.1, 0.1))
@settings(max_examples=25, deadline=None)
def test_gradient_and_hessian_match_differences(room, dx, dy, dt):
    points = seen_here(beams=31)
    at, step = HERE.as_array() + np.array([dx, dy, dt]), 1e-6
    offsets = [sign * step * row for row in np.eye(3) for sign in (1.0, -1.0)]
    under = [surfels_under(room, points, Pose2(*(at + offset))) for offset in offsets]
    steady = points[(np.array(under) == under[0]).all(axis=0)]
    assert len(steady) > 0.9 * len(points)
    here = judge(room, steady, Pose2(*at))
    for i in range(3):
        up = judge(room, steady, Pose2(*(at + offsets[2 * i])))
        down = judge(room, steady, Pose2(*(at + offsets[2 * i + 1])))
        assert here.gradient[i] == pytest.approx((up.value - down.value) / (2 * step), abs=0.05)
        slope = (up.gradient - down.gradient) / (2 * step)
        assert np.allclose(here.hessian[i], slope, rtol=1e-3, atol=1.0)
    assert np.array_equal(here.hessian, here.hessian.T)


def information_of(built: MatchMap, points, pose: Pose2, laser=(math.nan, math.nan)):
    information = np.ones((3, 3))
    geometry = built.grid.geometry
    counts = accumulate_information(
        points, (pose.x, pose.y, pose.theta), laser, built.surfaces.closest,
        built.surfaces.surfels,
        built.grid.log_odds, (geometry.origin_x, geometry.origin_y, geometry.resolution),
        0.05, 0.05, 0.3, information,
    )  # fmt: skip
    return information, counts


def test_information_at_the_true_pose_is_the_negative_hessian(room):
    points = seen_here()
    information, (known, explained) = information_of(room, points, HERE)
    assert known == len(points) and explained >= known - 3
    bend = -np.diag(judge(room, points, HERE).hessian)
    assert np.allclose(np.diag(information), bend, rtol=0.25)
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
    for _ in range(3):
        room.insert(rectangle_scan(Pose2(1.5, 1.4, 0.0), beams=120), ROOM @ Pose2(1.5, 1.4, 0.0))
    _, counts = information_of(room, points, Pose2(0.0, 0.0, 0.0), laser=(2.0, 1.5))
    assert counts == (4, 1)  # two end points lie behind a wall


def test_young_walls_speak_less_but_never_against_a_pose(room):
    young = MatchMap(MapSettings(resolution=0.1))
    pose = Pose2(2.0, 1.4, 1.0)
    young.insert(rectangle_scan(pose, beams=120), ROOM @ pose)
    points, pose = scan_points(rectangle_scan(pose)), ROOM @ pose
    assert (young.surfaces.surfels[: young.surfaces.count, 5] < 0.1).all()
    flat = len(points) * math.log(SETTINGS.outlier)
    assert flat < judge(young, points, pose).value < judge(room, points, pose).value


def test_trust_is_judged_by_the_best_wall_in_view(room):
    geometry = room.grid.geometry
    lattice = (geometry.origin_x, geometry.origin_y, geometry.resolution)
    points = np.array([[4.0, 1.5, -1.0, 0.0], [2.0, 1.5, -1.0, 0.0], [99.0, 0.0, 1.0, 0.0]])
    walls = room.surfaces
    surfels = walls.surfels.copy()
    surfels[:, 5] = 0.25
    assert best_trust(points, (0.0, 0.0, 0.0), walls.closest, surfels, lattice) == 0.25
    assert best_trust(points[1:], (0.0, 0.0, 0.0), walls.closest, surfels, lattice) == 1.0
