"""The pose graph of a run, as the server knows it: placed scans and what was measured of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from expedition.results.record import PoseGraphRecord
from mapping.pose_graph import Edge
from server.map_merger import Node


def pose_graph(nodes: Sequence[Node], edges: Sequence[Edge]) -> PoseGraphRecord:
    """Return the scans of each robot, and the edges between them.

    Args:
        nodes: all placed scans, in the order of their placing.
        edges: between them, by their places in that order: steps of robots, and where a scan was
            matched with a submap.
    """
    scans: dict[str, list[int]] = {}
    for k, node in enumerate(nodes):
        scans.setdefault(node.robot, []).append(k)
    place_of = np.empty((len(nodes), 2), dtype=np.int64)
    for i, robot in enumerate(sorted(scans)):
        place_of[scans[robot]] = np.column_stack(
            (np.full(len(scans[robot]), i), np.arange(len(scans[robot])))
        )
    poses = np.array([node.T_map_base.as_tuple() for node in nodes]).reshape(-1, 3)
    return PoseGraphRecord(
        {robot: poses[own] for robot, own in scans.items()},
        np.array([(*place_of[e.i], *place_of[e.j]) for e in edges], dtype=np.int64).reshape(-1, 4),
        np.array([edge.T_i_j.as_tuple() for edge in edges]).reshape(-1, 3),
        np.array([edge.information for edge in edges]).reshape(-1, 3, 3),
        {robot: np.array([nodes[k].scan.stamp for k in own]) for robot, own in scans.items()},
        np.array([edge.robust for edge in edges], dtype=np.bool_),
    )
