from __future__ import annotations

import numpy as np

from expedition.pose_graph import pose_graph
from mapping.geometry import Pose2
from mapping.pose_graph import Edge
from mapping.scan import LaserScan
from server.map_merger import Node

SCAN = LaserScan(np.ones(1, dtype=np.float32), 0.0, 0.1, 5.0, 0.0)


def node(robot: str, x: float) -> Node:
    T_map_base = Pose2(x, 0.0, 0.3)
    return Node(robot, SCAN, T_map_base, T_map_base)


def test_edges_name_robots_in_order_of_ids_and_their_scans() -> None:
    nodes = [node("b", 0.0), node("a", 1.0), node("b", 2.0)]
    information = np.diag([1.0, 2.0, 3.0])
    edges = [
        Edge(0, 2, Pose2(2.0, 0.0, 0.0), information),
        Edge(1, 2, Pose2(1.0, 0.5, 0.1), 2.0 * information, robust=True),
    ]
    graph = pose_graph(nodes, edges)
    assert graph.chains["b"].tolist() == [[0.0, 0.0, 0.3], [2.0, 0.0, 0.3]]
    assert graph.ends.tolist() == [[1, 0, 1, 1], [0, 0, 1, 1]]
    assert graph.measured.tolist() == [[2.0, 0.0, 0.0], [1.0, 0.5, 0.1]]
    assert np.array_equal(graph.information[1], 2.0 * information)


def test_without_scans_there_is_no_graph() -> None:
    graph = pose_graph([], [])
    assert graph.chains == {} and len(graph.ends) == 0
