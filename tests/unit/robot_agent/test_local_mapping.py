from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.estimator import OthersScan
from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan
from protocol.body import Body, Drive
from robot_agent.local_mapping import LocalMapping
from robot_agent.settings import LocalMapSettings
from tests.unit.rooms import room, scan_in

ROOM = room()
SETTINGS = LocalMapSettings(resolution_m=0.1, report_every=3, news_every=2)
STEP = Pose2(0.06, 0.0, 0.05)


def local_mapping(body: Body) -> LocalMapping:
    return LocalMapping(body, SETTINGS, "scan_matching", np.random.default_rng(0))


def no_news(_: LaserScan) -> float:
    return 0.0


def news(_: LaserScan) -> float:
    return 100.0


def mapping_after(scans: int, step: Pose2 = STEP) -> tuple[LocalMapping, Pose2]:
    """A robot that has driven and looked so many times; also where it truly is."""
    mapping = local_mapping(Body(drive=Drive(noise_distance=0.0)))
    T_world_base = IDENTITY
    for k in range(scans):
        mapping.take(scan_in(ROOM, T_world_base, 0.2 * k), T_world_base)
        T_world_base = T_world_base @ step if k < scans - 1 else T_world_base
    return mapping, T_world_base


def test_scans_and_wheels_together_give_the_pose() -> None:
    mapping, T_world_base = mapping_after(5)
    assert mapping.scans == 5
    assert mapping.T_odom_base.distance_to(T_world_base) < 0.03
    mapping.move(T_world_base @ Pose2(0.1, 0.0, 0.0))
    assert mapping.T_odom_base.distance_to(T_world_base) == pytest.approx(0.1, abs=0.03)


def test_wheels_that_begin_anywhere_begin_at_the_origin_of_the_own_map() -> None:
    mapping = local_mapping(Body())
    mapping.move(Pose2(5.0, 5.0, 1.0))
    assert mapping.T_odom_base.distance_to(IDENTITY) < 1e-9
    mapping.move(Pose2(5.0, 5.0, 1.0) @ Pose2(0.2, 0.0, 0.0))
    assert mapping.T_odom_base.x == pytest.approx(0.2)


def test_a_report_holds_the_scan_and_the_way_since_the_last() -> None:
    mapping, _ = mapping_after(3)
    first = mapping.report()
    assert (first.number, len(first.track_odom)) == (1, 3)
    assert first.track_odom[-1, 1:3] == pytest.approx([first.T_odom_base.x, first.T_odom_base.y])
    mapping.take(scan_in(ROOM, Pose2(0.2, 0.0, 0.0), 0.6), Pose2(0.2, 0.0, 0.0))
    second = mapping.report()
    assert (second.number, len(second.track_odom), mapping.reports) == (2, 1, 2)


def test_a_report_is_due_with_the_first_scan_and_then_every_so_many() -> None:
    mapping = local_mapping(Body())
    assert not mapping.report_due(True, no_news)
    mapping, T_world_base = mapping_after(1)
    assert mapping.report_due(True, no_news)
    mapping.report()
    due = []
    for k in range(3):
        T_world_base = T_world_base @ STEP
        mapping.take(scan_in(ROOM, T_world_base, 1.0 + k), T_world_base)
        due.append(mapping.report_due(True, no_news))
    assert due == [False, False, True]


def test_a_scan_that_shows_much_is_reported_early_but_not_at_once() -> None:
    mapping, T_world_base = mapping_after(1)
    mapping.report()
    due = []
    for k in range(2):
        T_world_base = T_world_base @ STEP
        mapping.take(scan_in(ROOM, T_world_base, 1.0 + k), T_world_base)
        due.append((mapping.report_due(True, news), mapping.report_due(False, news)))
    assert due == [(False, False), (True, False)]


def test_a_robot_at_rest_has_nothing_to_tell_once_it_is_placed() -> None:
    mapping, T_world_base = mapping_after(1)
    mapping.report()
    for k in range(4):
        mapping.take(scan_in(ROOM, T_world_base, 1.0 + k), T_world_base)
    assert not mapping.report_due(True, no_news)
    assert mapping.report_due(False, no_news)
    turned = T_world_base @ Pose2(0.0, 0.0, math.radians(10.0))
    mapping.take(scan_in(ROOM, turned, 9.0), turned)
    assert mapping.report_due(True, no_news)


def test_reports_are_kept_until_the_server_has_them() -> None:
    mapping, _ = mapping_after(1)
    for _ in range(3):
        mapping.report()
    assert mapping.unconfirmed == 3
    lacking = mapping.received(1, 10.0)
    assert [report.number for report in lacking] == [2, 3]
    assert mapping.received(1, 10.5) == []  # sent a moment ago
    assert [report.number for report in mapping.received(2, 11.1)] == [3]
    assert mapping.received(3, 20.0) == []
    assert mapping.unconfirmed == 0


def test_no_more_than_a_few_are_sent_again_at_a_time() -> None:
    mapping, _ = mapping_after(1)
    for _ in range(25):
        mapping.report()
    assert [report.number for report in mapping.missing(0.0)] == list(range(1, 21))


def test_a_report_tells_the_wheels_and_where_discs_were_seen() -> None:
    mapping, T_wheel_base = mapping_after(2)
    assert mapping.report().sightings_odom.shape == (0, 2)
    mapping.take(scan_in(ROOM, T_wheel_base, 0.4), T_wheel_base)
    mapping.sight(np.array([[1.0, 0.0]]))
    report = mapping.report()
    assert report.T_wheel_base == T_wheel_base
    seen = mapping.T_odom_base.apply((1.0, 0.0))
    assert report.sightings_odom == pytest.approx(seen.reshape(1, 2), abs=1e-5)
    assert mapping.report().sightings_odom.shape == (0, 2)


def test_the_track_holds_every_scan_and_the_reported_poses_those_of_reports() -> None:
    mapping = local_mapping(Body())
    assert mapping.reported_poses().shape == (0, 3)
    stamps, poses = mapping.track()
    assert (stamps.shape, poses.shape) == ((0,), (0, 3))
    mapping, _ = mapping_after(1)
    reports = [mapping.report()]
    for k in range(1, 5):
        T_world_base = Pose2(0.06 * k, 0.0, 0.0)
        mapping.take(scan_in(ROOM, T_world_base, 0.2 * k), T_world_base)
        if k in (2, 3):
            reports.append(mapping.report())
    stamps, poses = mapping.track()
    assert stamps.tolist() == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8])
    assert poses.shape == (5, 3)
    np.testing.assert_allclose(mapping.reported_poses(), poses[[0, 2, 3]])
    told = [report.T_odom_base.as_tuple() for report in reports]
    np.testing.assert_allclose(mapping.reported_poses(), told, atol=1e-9)


def test_what_others_saw_reaches_an_estimator_that_takes_it() -> None:
    seen = [OthersScan(("bob", 0), 1, scan_in(ROOM, IDENTITY, 0.0), IDENTITY)]
    for name in ("particle_filter", "scan_matching"):
        mapping = LocalMapping(Body(), SETTINGS, name, np.random.default_rng(0))
        mapping.take_others(seen)
        mapping.take(scan_in(ROOM, IDENTITY, 0.2), IDENTITY)
        walls = getattr(mapping._slam, "_others", None)
        assert (name == "particle_filter") == (walls is not None and walls.drawn == 1)
