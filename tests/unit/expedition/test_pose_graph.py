from __future__ import annotations

import numpy as np

from expedition.pose_graph import OWN_APART, pose_graph, relative
from mapping.geometry import Pose2
from mapping.scan import LaserScan
from server.map_merger import Node

SCAN = LaserScan(np.ones(1, dtype=np.float32), 0.0, 0.1, 5.0, 0.0)
OWN, MATCH = np.diag([1e-4, 4e-4, 1e-5]), np.diag([1e-2, 4e-2, 1e-3])


def node(robot: str, x: float, y: float = 0.0, theta: float = 0.0, life: int = 0) -> Node:
    T_map_base = Pose2(x, y, theta)
    T_odom_base = Pose2(0.5, 0.0, 0.3).inverse() @ T_map_base
    return Node(robot, SCAN, T_map_base, T_odom_base, MATCH, OWN, life)


def test_the_step_of_a_robot_is_that_in_its_own_map() -> None:
    graph = pose_graph([node("a", 0.0), node("a", 1.0), node("a", 2.0, 1.0, 1.5)])
    (chain,) = graph.chains.values()
    assert chain.poses_odom is not None
    assert np.isnan(chain.covariances[0]).all() and np.isfinite(chain.covariances[1:]).all()
    assert graph.edges == []


def test_between_two_lives_nothing_was_measured() -> None:
    graph = pose_graph([node("a", 0.0), node("a", 0.1, life=1), node("a", 0.2, life=1)])
    finite = np.isfinite(graph.chains["a"].covariances).all(axis=(1, 2))
    assert finite.tolist() == [False, False, True]


def test_a_match_is_an_edge_from_the_nearest_scan_before() -> None:
    graph = pose_graph([node("a", 0.0), node("a", 2.0), node("b", 1.5, 0.5, 1.0), node("b", 9.0)])
    (edge,) = graph.edges
    assert (edge.from_robot, edge.from_index, edge.to_robot, edge.to_index) == ("a", 1, "b", 0)
    assert np.allclose(edge.T_from_to, [-0.5, 0.5, 1.0])
    assert np.allclose(edge.covariance, MATCH)


def test_a_robot_that_knows_a_place_again_is_tied_to_its_own_old_scans() -> None:
    way = [node("a", 1.0 * k) for k in range(OWN_APART)] + [node("a", 0.2)]
    (edge,) = pose_graph(way).edges
    assert (edge.from_index, edge.to_index) == (0, OWN_APART)


def test_without_scans_there_is_no_graph() -> None:
    graph = pose_graph([])
    assert graph.chains == {} and graph.edges == []


def test_the_covariance_of_a_step_holds_for_small_errors() -> None:
    rng = np.random.default_rng(3)
    a, b = Pose2(1.0, 2.0, 0.7), Pose2(2.0, 4.0, -0.4)
    T_a_b, covariance = relative(a, OWN, b, MATCH * 0.01)
    rows = []
    for _ in range(4000):
        da, db = (
            rng.multivariate_normal(np.zeros(3), OWN),
            rng.multivariate_normal(np.zeros(3), MATCH * 0.01),
        )
        near_a = Pose2(a.x + da[0], a.y + da[1], a.theta + da[2])
        near_b = Pose2(b.x + db[0], b.y + db[1], b.theta + db[2])
        rows.append((near_a.inverse() @ near_b).as_array() - T_a_b.as_array())
    assert np.allclose(np.cov(np.array(rows).T), covariance, atol=0.1 * covariance.max())
