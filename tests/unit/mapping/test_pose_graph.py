"""Pose graphs: loops bend the ways that know least of themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.pose_graph import (
    Edge,
    PoseGraph,
    blurred_information,
    carried_covariance,
    turned_covariance,
)

STEP = Pose2(1.0, 0.0, math.pi / 2)  # round a square of one metre


def square(errors: list[float]) -> PoseGraph:
    """Five nodes round a square by wheels that are off by `errors` [m] along each side."""
    graph = PoseGraph()
    pose = IDENTITY
    graph.add(pose)
    for k, error in enumerate(errors):
        step = Pose2(STEP.x + error, 0.0, STEP.theta)
        pose = pose @ step
        graph.add(pose)
        graph.connect(Edge(k, k + 1, step, np.diag([100.0, 100.0, 1e4])))
    return graph


def test_a_graph_without_edges_stays() -> None:
    graph = PoseGraph()
    assert graph.nearest(IDENTITY) is None
    graph.add(Pose2(1.0, 2.0, 0.3))
    assert graph.optimise() == (0.0, 0.0)
    assert graph.covariances([0])[0] == pytest.approx(np.zeros((3, 3)), abs=1e-6)
    assert graph.joint_covariance([0]) == pytest.approx(np.zeros((3, 3)), abs=1e-6)
    assert len(graph) == 1


def test_a_closed_loop_spreads_its_error() -> None:
    graph = square([0.2, 0.0, 0.0, 0.0])
    graph.connect(Edge(0, 4, IDENTITY, 1e6 * np.eye(3)))
    moved, turned = graph.optimise()
    assert 0.05 < moved < 0.25
    assert turned < 0.2
    assert graph.pose(4).distance_to(IDENTITY) < 0.01
    # Of 0.2 m too much on one side, the others take over a part.
    assert 1.05 < graph.pose(0).distance_to(graph.pose(1)) < 1.18
    assert graph.nearest(Pose2(0.02, 0.9, 0.0)) == 3


def test_uncertainty_grows_along_a_way_and_shrinks_where_a_loop_closes() -> None:
    graph = square([0.0, 0.0, 0.0, 0.0])
    first, last = graph.covariances([1, 4])
    assert last[0, 0] > first[0, 0]
    graph.connect(Edge(0, 4, IDENTITY, 1e6 * np.eye(3)))
    assert graph.covariances([4])[0][0, 0] < 1e-5


def test_a_wrong_robust_edge_does_not_pull_in_the_end() -> None:
    graph = PoseGraph()
    graph.add(IDENTITY)
    graph.add(Pose2(1.0, 0.0, 0.0))
    graph.connect(Edge(0, 1, Pose2(1.0, 0.0, 0.0), 1e4 * np.eye(3)))
    graph.connect(Edge(0, 1, Pose2(3.0, 0.0, 0.0), 1e4 * np.eye(3), robust=True))
    graph.optimise()
    assert graph.pose(1).x == pytest.approx(1.0, abs=0.01)
    assert graph.error(graph.edges[1])[1] > 1e4


def test_many_nodes_find_room() -> None:
    graph = PoseGraph()
    for k in range(100):
        assert graph.add(Pose2(float(k), 0.0, 0.0)) == k
    assert graph.pose(70) == Pose2(70.0, 0.0, 0.0)


def test_covariances_turn_and_are_carried() -> None:
    along = np.diag([4.0, 1.0, 0.25])
    assert turned_covariance(along, math.pi / 2) == pytest.approx(np.diag([1.0, 4.0, 0.25]))
    carried = carried_covariance(np.diag([0.0, 0.0, 0.01]), 10.0, 0.0)
    assert carried[1, 1] == pytest.approx(1.0)
    assert carried[0, 0] == pytest.approx(0.0)


def test_added_errors_leave_nothing_where_nothing_was_known() -> None:
    blurred = blurred_information(np.diag([100.0, 0.0, 1e8]), np.diag([0.01, 0.01, 0.01]))
    assert blurred == pytest.approx(np.diag([50.0, 0.0, 100.0]), rel=1e-3)


def test_a_comparison_that_contradicts_all_the_rest_is_taken_out_and_a_way_never() -> None:
    graph = square([0.0, 0.0, 0.0, 0.0])
    graph.connect(Edge(0, 4, IDENTITY, 1e4 * np.eye(3), robust=True))
    graph.connect(Edge(0, 2, Pose2(5.0, 5.0, 0.0), 1e4 * np.eye(3), robust=True))
    graph.optimise()
    before = graph.poses.copy()
    assert graph.reject(100.0) == 1
    assert len(graph.edges) == 5 and graph.reject(100.0) == 0
    graph.optimise()
    assert graph.poses == pytest.approx(before, abs=1e-3)
    assert graph.reject(-1.0) == 1 and not any(edge.robust for edge in graph.edges)
