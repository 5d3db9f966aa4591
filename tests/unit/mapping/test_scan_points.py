from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.scan import LaserScan
from mapping.scan_points import scan_points, turned_points
from tests.unit.mapping.rectangle import corridor_scan, rectangle_scan


def test_points_are_the_scans_end_points_in_order():
    scan = rectangle_scan(Pose2(1.0, 1.0, 0.4), range_max=2.0, T_base_laser=Pose2(0.2, 0.1, 0.3))
    assert np.allclose(scan_points(scan)[:, :2], scan.points_base(), atol=1e-9)


def test_surfaces_face_the_laser_across_the_walls():
    scan = rectangle_scan(Pose2(1.0, 1.5, 0.0), beams=180)
    points = scan_points(scan)
    right = (abs(points[:, 0] - 3.0) < 1e-3) & (abs(points[:, 1]) < 1.0)
    top = (abs(points[:, 1] - 1.5) < 1e-3) & (abs(points[:, 0]) < 0.5)
    assert right.sum() > 10 and top.sum() > 10
    assert np.allclose(points[right, 2:], [-1.0, 0.0], atol=1e-3)
    assert np.allclose(points[top, 2:], [0.0, -1.0], atol=1e-3)


def test_a_lone_end_point_faces_the_laser():
    ranges = np.array([9.0, 2.0, 9.0, 0.0], dtype=np.float32)
    points = scan_points(LaserScan(ranges, 0.0, math.pi / 2, 8.0, 0.0))
    assert points.shape == (1, 4)
    assert np.allclose(points[0], [0.0, 2.0, 0.0, -1.0], atol=1e-6)


def test_a_wall_met_at_a_slant_faces_sideways_however_far_apart_its_end_points_are():
    T_corridor_base = Pose2(0.0, 0.0, 0.3)
    points = scan_points(corridor_scan(T_corridor_base, half_width=0.7, beams=120))
    ahead = turned_points(points, T_corridor_base)
    ahead = ahead[ahead[:, 0] > 2.0]
    assert len(ahead) >= 6 and np.hypot(*np.diff(ahead[:2, :2], axis=0)[0]) > 0.25
    assert np.allclose(ahead[:, 2], 0.0, atol=1e-3)
    assert np.allclose(ahead[:, 3], -np.sign(ahead[:, 1]), atol=1e-3)


def test_three_things_one_behind_the_other_are_no_wall():
    ranges = np.array([2.0, 4.0, 7.0], dtype=np.float32)
    points = scan_points(LaserScan(ranges, 0.0, math.radians(1.0), 8.0, 0.0))
    assert np.allclose(points[:, 2:], -points[:, :2] / ranges[:, None], atol=1e-6)


def test_three_end_points_off_any_line_face_the_laser():
    ranges = np.array([5.0, 4.5, 5.0], dtype=np.float32)
    points = scan_points(LaserScan(ranges, 0.0, math.radians(6.0), 8.0, 0.0))
    assert np.allclose(points[:, 2:], -points[:, :2] / ranges[:, None], atol=1e-6)


def test_an_end_point_on_the_laser_has_a_normal_all_the_same():
    scan = LaserScan(np.array([1e-30], dtype=np.float32), 0.0, 0.1, 8.0, 0.0)
    assert np.allclose(np.hypot(*scan_points(scan)[0, 2:]), 1.0)


def test_no_returns_give_no_points():
    scan = LaserScan(np.full(4, 8.0, dtype=np.float32), 0.0, 0.1, 8.0, 0.0)
    assert scan_points(scan).shape == (0, 4)
    assert turned_points(scan_points(scan), Pose2(1.0, 2.0, 3.0)).shape == (0, 4)


@given(st.floats(0.5, 3.5), st.floats(0.5, 2.5), st.floats(-3.0, 3.0))
@settings(max_examples=25, deadline=None)
def test_normals_are_unit_vectors_towards_the_laser(x, y, theta):
    points = scan_points(rectangle_scan(Pose2(x, y, theta)))
    assert np.allclose(np.hypot(points[:, 2], points[:, 3]), 1.0)
    assert ((points[:, :2] * points[:, 2:]).sum(axis=1) <= 1e-9).all()
    T = Pose2(-1.0, 2.0, 0.7)
    turned = turned_points(points, T)
    assert np.allclose(turned[:, :2], T.apply(points[:, :2]))
    assert np.allclose(turned[:, 2:], Pose2(0.0, 0.0, 0.7).apply(points[:, 2:]))
