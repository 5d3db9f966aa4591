"""The pose graph of a run, as the server knows it: what was measured between placed scans.

Two kinds of edges. Along each robot's own scans: the step in its local map, as its own estimator
has it. And where the server matched a scan with what was mapped before: from the nearest scan of
that, of another robot or of its own from long before, to this one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from expedition.results.record import PoseGraphRecord, ScanChain, ScanEdge
from mapping.geometry import Floats, Pose2
from server.map_merger import Node

# A robot's last scans hang on its own steps; only older ones show that it knows a place again.
OWN_APART = 10
# Scans farther apart than this hardly see the same walls [m].
REACH = 3.0

_CERTAIN = np.zeros((3, 3))


def pose_graph(nodes: Sequence[Node]) -> PoseGraphRecord:
    """Return chains and edges of all placed scans, which are in the order of their placing."""
    by_robot: dict[str, list[Node]] = {}
    for node in nodes:
        by_robot.setdefault(node.robot, []).append(node)
    chains = {name: _chain(own) for name, own in by_robot.items()}
    return PoseGraphRecord(chains, _matches(nodes))


def relative(
    T_map_a: Pose2, covariance_a: Floats, T_map_b: Pose2, covariance_b: Floats
) -> tuple[Pose2, Floats]:
    """Return the pose of b in a and its covariance (3, 3), in the frame of a.

    Args:
        T_map_a: a's pose.
        covariance_a: (3, 3) of it, map frame.
        T_map_b: b's pose.
        covariance_b: (3, 3) of it, map frame, independent of a's.
    """
    T_a_b = T_map_a.inverse() @ T_map_b
    c, s = np.cos(T_map_a.theta), np.sin(T_map_a.theta)
    by_a = np.array([[-c, -s, T_a_b.y], [s, -c, -T_a_b.x], [0.0, 0.0, -1.0]])
    by_b = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    covariance: Floats = by_a @ covariance_a @ by_a.T + by_b @ covariance_b @ by_b.T
    return T_a_b, covariance


def _chain(own: Sequence[Node]) -> ScanChain:
    """Return one robot's scans; between two of its lives nothing was measured."""
    steps = [np.full((3, 3), np.nan)]
    for before, node in itertools.pairwise(own):
        if before.life != node.life:
            steps.append(np.full((3, 3), np.nan))
            continue
        _, covariance = relative(
            before.T_odom_base, before.own_covariance, node.T_odom_base, node.own_covariance
        )
        steps.append(covariance)
    return ScanChain(
        np.array([node.T_map_base.as_array() for node in own]),
        np.array(steps),
        np.array([node.T_odom_base.as_array() for node in own]),
    )


def _matches(nodes: Sequence[Node]) -> list[ScanEdge]:
    """Return an edge to each scan that was matched near earlier ones."""
    names = list(dict.fromkeys(node.robot for node in nodes))
    robots = np.array([names.index(node.robot) for node in nodes], dtype=np.int64)
    places = np.array([[n.T_map_base.x, n.T_map_base.y] for n in nodes]).reshape(-1, 2)
    index = np.zeros(len(nodes), dtype=np.int64)  # of each node in its robot's chain
    count = np.zeros(len(names), dtype=np.int64)
    for k, robot in enumerate(robots):
        index[k] = count[robot]
        count[robot] += 1
    edges = []
    for k in range(1, len(nodes)):
        distance = np.hypot(*(places[:k] - places[k]).T)
        distance[(robots[:k] == robots[k]) & (index[:k] > index[k] - OWN_APART)] = np.inf
        near = int(np.argmin(distance))
        if distance[near] <= REACH:
            edges.append(_edge(nodes[near], int(index[near]), nodes[k], int(index[k])))
    return edges


def _edge(before: Node, before_index: int, node: Node, node_index: int) -> ScanEdge:
    """Return what the match of `node` says of its pose relative to an earlier scan."""
    T_from_to, covariance = relative(before.T_map_base, _CERTAIN, node.T_map_base, node.covariance)
    return ScanEdge(
        before.robot,
        before_index,
        node.robot,
        node_index,
        T_from_to.as_array().tolist(),
        covariance.tolist(),
    )
