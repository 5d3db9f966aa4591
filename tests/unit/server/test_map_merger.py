"""The central mapper in a small room that robots see without noise."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.grid import CLEAR, OBSTACLE, classify
from mapping.placed_by_sight import seen_by_others
from mapping.scan import LaserScan
from server.map_merger import MapMerger, Placement, Report
from server.settings import MergerSettings
from server.tying import search_window
from tests.unit.rooms import room, scan_in

ROOM = room()
SETTINGS = MergerSettings(resolution_m=0.1, sight_wait=0)
SURE = np.diag([1e-4, 1e-4, 1e-5])


def report(T_world_base: Pose2, T_world_odom: Pose2 = IDENTITY, stamp: float = 0.0) -> Report:
    """What a robot reports that knows its own way exactly."""
    T_odom_base = T_world_odom.inverse() @ T_world_base
    track = np.array([[stamp, T_odom_base.x, T_odom_base.y, T_odom_base.theta]])
    return Report(scan_in(ROOM, T_world_base, stamp), T_odom_base, SURE, track)


def merger_with_map(**settings: float) -> MapMerger:
    """A merger that one robot has given the room from two places."""
    merger = MapMerger(SETTINGS.model_copy(update=settings))
    merger.add("a", IDENTITY, 0.0, 0.0)
    merger.place("a", report(IDENTITY))
    merger.place("a", report(Pose2(0.3, 0.2, 0.2), stamp=1.0))
    return merger


def test_the_first_robot_defines_the_map() -> None:
    merger = MapMerger(SETTINGS)
    merger.add("a", Pose2(0.5, 0.0, 0.0), 1.0, 0.3)
    assert not merger.members["a"].aligned
    assert merger.place("a", report(IDENTITY)) == Placement(True, 0.0)
    assert merger.members["a"].T_map_odom == Pose2(0.5, 0.0, 0.0)
    assert merger.uncertainty("a") < 0.02
    assert [node.robot for node in merger.nodes] == ["a"]


def test_the_map_shows_what_the_scans_show() -> None:
    merger = merger_with_map()
    classes = classify(merger.log_odds, 0.65, 0.35)
    for x, y in ((0.05, 0.05), (1.05, 0.05), (-0.55, 1.05)):
        assert classes[merger.geometry.cell_at(x, y)] == CLEAR
    iy, ix = merger.geometry.cell_at(-0.95, 0.05)
    assert OBSTACLE in classes[iy, ix - 1 : ix + 2]


def test_changes_are_told_once_on_the_lattice() -> None:
    merger = merger_with_map()
    box, log_odds = merger.take_changes()
    assert log_odds.shape == (box.iy1 - box.iy0, box.ix1 - box.ix0)
    assert (box.ix0 <= -9, box.iy0 <= -9, box.ix1 >= 28, box.iy1 >= 18) == (True,) * 4
    assert merger.take_changes()[0].empty


def test_a_wrong_odometry_is_corrected_by_the_map() -> None:
    merger = merger_with_map()
    true = Pose2(0.5, 0.3, 0.3)
    seen = report(true, stamp=2.0)
    off = Report(seen.scan, Pose2(0.56, 0.26, 0.33), SURE, np.array([[2.0, 0.56, 0.26, 0.33]]))
    placement = merger.place("a", off)
    assert placement.matched
    corrected = merger.members["a"].T_map_odom @ off.T_odom_base
    assert corrected.distance_to(true) < 0.04
    assert placement.moved == pytest.approx(0.07, abs=0.04)
    assert merger.track("a")[-1, 1:3] == pytest.approx([corrected.x, corrected.y])


def test_another_robot_is_tied_to_the_map_by_what_it_sees() -> None:
    merger = merger_with_map()
    T_world_odom = Pose2(0.4, -0.2, 0.3)
    merger.add("b", Pose2(0.5, -0.3, 0.25), 0.15, 0.1)
    placement = merger.place("b", report(Pose2(0.4, -0.2, 0.3), T_world_odom))
    member = merger.members["b"]
    assert placement.matched
    assert member.aligned
    assert member.T_map_odom.distance_to(T_world_odom) < 0.05
    assert abs(member.T_map_odom.theta - 0.3) < 0.04
    assert merger.nodes[-1].robot == "b"


def test_a_robot_taken_for_a_post_is_tied_by_what_it_was_told() -> None:
    # Posts stand so that a and b seem to see each other where neither is.
    merger = merger_with_map()
    start = Pose2(0.4, -0.2, 0.3)
    merger.add("b", Pose2(0.5, -0.3, 0.25), 0.15, 0.1)
    for _ in range(2):
        merger.sightings.add("a", IDENTITY, SURE, np.array([[0.7, 0.1]]))
        merger.sightings.add("b", IDENTITY, SURE, np.array([[-0.7, 0.0]]))
    wrong = seen_by_others("b", merger.members, merger.sightings)
    assert wrong is not None and wrong.T_a_b.distance_to(start) > 0.25
    assert merger.place("b", report(start, start)).matched
    assert merger.members["b"].T_map_odom.distance_to(start) < 0.05


def test_a_robot_that_sees_nothing_known_waits() -> None:
    merger = merger_with_map()
    merger.add("b", Pose2(0.4, 0.2, 0.0), 0.1, 0.05)
    blind = LaserScan(np.full(60, 6.0, np.float32), -math.pi, 0.1, 6.0, 1.0)
    few = Report(blind, IDENTITY, SURE, np.zeros((0, 4)))
    assert merger.place("b", few) == Placement(False, 0.0)
    assert len(merger.members["b"].held) == 1
    placed = merger.place("b", report(Pose2(0.4, 0.2, 0.0), Pose2(0.4, 0.2, 0.0)))
    assert placed.matched
    assert merger.members["b"].held == []
    assert [node.robot for node in merger.nodes] == ["a", "a", "b", "b"]


def test_a_scan_that_contradicts_the_map_is_kept_out_of_it() -> None:
    merger = merger_with_map()
    ranges = np.full(60, 0.45, np.float32)  # as in a barrel that is nowhere in this room
    barrel = LaserScan(ranges, -math.pi, math.pi / 30, 6.0, 2.0)
    track = np.array([[2.0, 0.3, 0.2, 0.2]])
    before = merger.log_odds.copy()
    placement = merger.place("a", Report(barrel, Pose2(0.3, 0.2, 0.2), SURE, track))
    assert placement == Placement(False, 0.0)
    assert merger.members["a"].unmatched == 1
    assert len(merger.nodes) == 2
    assert (merger.log_odds == before).all()
    assert len(merger.track("a")) == 3  # where it was is told all the same
    assert merger.place("a", report(Pose2(0.4, 0.2, 0.2), stamp=3.0)).matched
    assert merger.members["a"].unmatched == 0


def test_the_window_grows_with_what_is_unsure() -> None:
    assert search_window(SURE, SETTINGS) is None
    unsure = search_window(np.diag([0.04, 0.01, 0.01]), SETTINGS)
    assert unsure is not None
    turned = search_window(np.diag([1e-4, 1e-4, 0.01]), SETTINGS)
    assert turned is not None


def test_a_robot_that_begins_anew_keeps_its_track() -> None:
    merger = merger_with_map()
    merger.add("a", IDENTITY, 1.0, 0.3)
    member = merger.members["a"]
    assert not member.aligned
    assert member.T_map_odom.distance_to(Pose2(0.3, 0.2, 0.2)) < 0.05  # it stands where it was
    assert len(merger.track("a")) == 2


def test_one_that_never_reported_begins_anew_at_its_start() -> None:
    merger = MapMerger(SETTINGS)
    merger.add("a", IDENTITY, 0.0, 0.0)
    merger.add("a", Pose2(2.0, 0.0, 0.0), 0.0, 0.0)
    assert merger.members["a"].T_map_odom == Pose2(2.0, 0.0, 0.0)
    assert merger.track("a").shape == (0, 4)


def test_held_reports_are_taken_in_the_end_even_if_unsure() -> None:
    """In a place that looks alike all along nothing would ever be sure enough."""
    merger = merger_with_map(align_sigma_m=1e-6, hold_most=2)
    merger.add("b", Pose2(0.4, 0.2, 0.0), 0.1, 0.05)
    seen = report(Pose2(0.4, 0.2, 0.0), Pose2(0.4, 0.2, 0.0))
    assert not merger.place("b", seen).matched
    assert merger.place("b", seen).matched


def test_robots_that_saw_each_other_are_tied_by_that_where_walls_tell_nothing() -> None:
    merger = MapMerger(SETTINGS)
    blind = LaserScan(np.full(60, 6.0, np.float32), -math.pi, 0.1, 6.0, 1.0)
    merger.add("a", IDENTITY, 1.0, 0.3)
    merger.add("b", Pose2(1.5, 0.4, 0.2), 1.0, 0.3)
    seen_b, seen_a = np.array([[0.8, 0.0]] * 2), np.array([[-0.8, 0.0]] * 2)
    nothing = np.zeros((0, 4))
    merger.place("a", Report(blind, IDENTITY, SURE, nothing, None, seen_b))
    assert merger.place("b", Report(blind, IDENTITY, SURE, nothing, None, seen_a)).matched
    assert merger.members["b"].T_map_odom.distance_to(Pose2(0.8, 0.0, 0.0)) < 1e-6
    assert merger.members["b"].T_map_odom.theta == pytest.approx(0.0, abs=1e-6)


def test_the_map_is_drawn_again_where_the_graph_moved_its_scans() -> None:
    merger = merger_with_map()
    assert not merger.settle()
    before = merger.members["a"].T_map_odom
    for _ in range(3):
        merger.team.tie(0, 1, Pose2(0.5, 0.2, 0.2), np.diag([1e-6, 1e-6, 1e-6]))
    merger.team.graph.edges = merger.team.graph.edges[-3:]
    merger.take_changes()
    assert merger.settle()
    assert merger.nodes[1].T_map_base.x == pytest.approx(0.5, abs=0.01)
    assert merger.members["a"].T_map_odom.distance_to(before) > 0.1
    assert merger.track("a")[-1, 1] == pytest.approx(0.5, abs=0.01)
    box, _ = merger.take_changes()
    assert (box.iy1 - box.iy0, box.ix1 - box.ix0) == merger.geometry.shape


def test_a_merger_without_reports_has_nothing_to_settle() -> None:
    assert not MapMerger(SETTINGS).settle()


def test_a_map_never_grows_beyond_its_limit() -> None:
    merger = merger_with_map(largest_cells=400 * 400)
    shape = merger.geometry.shape
    far = merger.place("a", report(Pose2(0.3, 0.2, 0.2), Pose2(-300.0, 0.0, 0.0)))
    assert far.too_far and not far.matched
    assert merger.geometry.shape == shape and len(merger.nodes) == 2
    assert merger.place("a", report(Pose2(0.2, 0.1, 0.1), stamp=2.0)).matched


def test_a_beam_without_end_is_not_searched_for() -> None:
    merger = merger_with_map()
    endless = LaserScan(np.array([999.0], dtype=np.float32), 0.0, 0.1, 1000.0, 0.0)
    assert merger.place("a", Report(endless, IDENTITY, SURE, np.zeros((0, 4)))).too_far


def test_a_tie_that_leads_too_far_is_not_made() -> None:
    merger = merger_with_map(largest_cells=400 * 400)
    merger.add("b", Pose2(0.4, 0.2, 0.0), 0.1, 0.05)
    away = report(Pose2(0.4, 0.2, 0.0), Pose2(500.0, 0.0, 0.0))
    assert merger.place("b", away).too_far
    assert len(merger.nodes) == 2
