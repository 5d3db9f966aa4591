"""Robots in a hall: their scans hold together, loops close, and bend what is loose."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from mapping.comparing import compare, window_of
from mapping.geometry import IDENTITY, Pose2
from mapping.loop_search import LoopSearch
from mapping.loop_settings import LoopSettings
from mapping.match_map import MapSettings
from mapping.scan import LaserScan
from mapping.submap import Submap
from mapping.submap_graph import SubmapGraph
from mapping.way import Way
from tests.unit.rooms import RANGE_MAX, room, scan_in

ROOM = room()
SETTINGS = LoopSettings()
LOOSE = np.diag([0.02, 0.02, 0.02])
TIGHT = np.diag([1e-5, 1e-5, 1e-6])
BLIND = LaserScan(np.full(60, RANGE_MAX, np.float32), -math.pi, 0.1, RANGE_MAX, 0.0)


def team(**settings: float) -> SubmapGraph:
    """A team whose first robot saw the room from three places, knowing well where it was."""
    graph = SubmapGraph(SETTINGS.model_copy(update=settings), MapSettings(resolution=0.1))
    places = [IDENTITY, Pose2(0.3, 0.2, 0.2), Pose2(0.6, 0.4, 0.4)]
    graph.begin("a", scan_in(ROOM, places[0]), places[0], TIGHT)
    for before, now in itertools.pairwise(places):
        graph.extend("a", scan_in(ROOM, now), now, Way(before.inverse() @ now, TIGHT))
    return graph


def test_scans_of_one_piece_of_way_are_one_submap() -> None:
    graph = team()
    assert len(graph.submaps) == 1
    assert graph.submaps[0].map.scans == 3
    robust = [edge for edge in graph.graph.edges if edge.robust]
    assert len(graph.graph.edges) == 4
    assert len(robust) == 2


@pytest.mark.parametrize(
    "settings", [{"submap_scans": 2}, {"submap_m": 0.2}, {"submap_sigma_m": 1e-3}]
)
def test_a_submap_ends(settings: dict[str, float]) -> None:
    graph = team(**settings)
    assert len(graph.submaps) > 1
    assert graph.chains["a"].submap is graph.submaps[-1]
    finished = graph.submaps[0]
    assert finished.map.surfaces.owned.size == 0
    found = finished.map.match(scan_in(ROOM, IDENTITY), IDENTITY, LOOSE)
    assert found.fit > 0.9  # it can still be compared with


def test_a_place_that_enough_submaps_show_needs_no_more() -> None:
    kept = team(submap_scans=2, enough=1)
    assert len(kept.submaps) < len(team(submap_scans=2).submaps)
    assert kept.chains["a"].submap is kept.submaps[-1]
    kept.settle()
    assert len(kept.graph) == 3


def test_a_loop_closes_and_moves_the_robot_that_was_wrong() -> None:
    graph = team()
    true, wrong = Pose2(0.5, 0.2, 0.1), Pose2(0.8, 0.05, 0.2)
    graph.begin("b", BLIND, wrong, np.diag([0.04, 0.04, 0.01]))
    graph.tie(0, 3, wrong, np.diag([0.04, 0.04, 0.01]))
    way = Way(IDENTITY, TIGHT)
    found = LoopSearch(graph).around("b", scan_in(ROOM, true), wrong, way)
    assert [submap.robot for submap, _ in found] == ["a"]
    node = graph.extend("b", scan_in(ROOM, true), wrong, way)
    worst = graph.connect_loops(node, found)
    assert graph.strained(worst)
    assert graph.closed == 1
    moved, _ = graph.settle()
    assert moved == pytest.approx(wrong.distance_to(true), abs=0.06)
    assert graph.graph.pose(node).distance_to(true) < 0.05
    assert not graph.strained(0.0)
    assert graph.chains["b"].covariance[0, 0] < 0.01


def test_a_place_is_not_compared_again_before_the_robot_moved() -> None:
    graph = team()
    here = Pose2(0.5, 0.2, 0.1)
    graph.begin("b", BLIND, here, TIGHT)
    way = Way(IDENTITY, TIGHT)
    assert LoopSearch(graph).around("b", scan_in(ROOM, here), here, way)
    assert not LoopSearch(graph).around("b", scan_in(ROOM, here), here, way)
    turned = Pose2(0.5, 0.2, 0.9)
    assert LoopSearch(graph).around("b", scan_in(ROOM, turned), turned, way)


def test_its_own_older_submaps_count_too() -> None:
    graph = team(submap_scans=2)
    here = Pose2(0.6, 0.4, 0.5)
    graph.chains["a"].compared.clear()
    found = LoopSearch(graph).around("a", scan_in(ROOM, here), here, Way(Pose2(0, 0, 0.1), LOOSE))
    assert found
    assert all(submap is not graph.chains["a"].submap for submap, _ in found)


def test_what_is_far_away_or_seen_by_nobody_is_not_compared() -> None:
    graph = team()
    way = Way(IDENTITY, TIGHT)
    far = Pose2(50.0, 0.0, 0.0)
    graph.begin("b", BLIND, far, TIGHT)
    assert LoopSearch(graph).around("b", scan_in(ROOM, IDENTITY), far, way) == []
    assert LoopSearch(graph).around("b", BLIND, IDENTITY, way) == []


def test_scans_far_from_where_they_were_drawn_are_astray() -> None:
    graph = team()
    drawn = [graph.graph.pose(k) for k in range(3)]
    assert not graph.astray(drawn)
    assert not graph.astray([])
    assert graph.astray([*drawn[:2], Pose2(0.8, 0.4, 0.4)])
    assert graph.astray([*drawn[:2], Pose2(drawn[2].x, drawn[2].y, drawn[2].theta + 0.1)])


def submap_of_the_room() -> Submap:
    submap = Submap("a", 0, TIGHT, TIGHT, MapSettings(resolution=0.1))
    for pose in (IDENTITY, Pose2(0.1, 0.0, 0.1)):
        submap.insert(scan_in(ROOM, pose), pose)
    return submap


def test_a_submap_tells_which_points_are_near_its_walls() -> None:
    submap = submap_of_the_room()
    points = np.array([[-0.85, 0.0], [0.5, 0.5], [40.0, 0.0]])
    assert submap.walls.near(points, 0.2) == 1
    assert submap.walls.near(points[:0], 0.2) == 0
    assert Submap("a", 0, TIGHT, TIGHT, MapSettings()).walls.near(points, 0.2) == 0


def test_a_match_is_searched_for_only_where_the_guess_is_poor() -> None:
    map_, true = submap_of_the_room().map, Pose2(0.4, 0.2, 0.1)
    off = Pose2(0.7, 0.0, 0.25)
    wide = np.diag([0.09, 0.09, 0.02])
    match = compare(map_, scan_in(ROOM, true), off, wide, SETTINGS)
    assert match is not None
    assert match.T_map_base.distance_to(true) < 0.06
    assert compare(map_, scan_in(ROOM, true), off, TIGHT, SETTINGS) is None
    assert window_of(wide, SETTINGS).reach == pytest.approx(0.9)


def test_a_match_that_nobody_expected_is_not_believed() -> None:
    map_, true = submap_of_the_room().map, Pose2(0.4, 0.2, 0.1)
    near = Pose2(0.47, 0.2, 0.1)
    assert compare(map_, scan_in(ROOM, true), near, LOOSE, SETTINGS) is not None
    strict = SETTINGS.model_copy(update={"gate": 1e-6})
    assert compare(map_, scan_in(ROOM, true), near, LOOSE, strict) is None


def test_a_scan_that_fits_nowhere_is_no_match() -> None:
    map_ = submap_of_the_room().map
    barrel = LaserScan(np.full(60, 0.4, np.float32), -math.pi, math.pi / 30, RANGE_MAX, 0.0)
    assert compare(map_, barrel, IDENTITY, LOOSE, SETTINGS) is None


def test_in_the_end_scans_are_compared_with_what_was_drawn_after_them() -> None:
    graph = team()
    here = Pose2(0.5, 0.2, 0.1)
    graph.begin("b", scan_in(ROOM, here), here, TIGHT)
    graph.tie(0, 3, here, TIGHT)
    LoopSearch(graph).consolidate()
    tied = {(edge.i, edge.j) for edge in graph.graph.edges}
    assert {(3, 0), (3, 1), (3, 2), (0, 3)} <= tied
    count = len(graph.graph.edges)
    LoopSearch(graph).consolidate()
    assert len(graph.graph.edges) == count


def test_what_lies_far_away_is_not_compared_in_the_end() -> None:
    graph = team()
    far = Pose2(60.0, 0.0, 0.0)
    graph.begin("b", BLIND, far, TIGHT)
    graph.extend("b", BLIND, Pose2(0.2, 0.0, 0.0), Way(IDENTITY, TIGHT))
    count = len(graph.graph.edges)
    LoopSearch(graph).consolidate()
    assert len(graph.graph.edges) == count
