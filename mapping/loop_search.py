"""Finding loops: which submaps a scan fits that its robot is not just drawing.

Source: Hess et al. 2016 for comparing scans with submaps.
"""

from __future__ import annotations

import numpy as np

from mapping.comparing import FLOOR, Match, compare, window_of
from mapping.geometry import Floats, Pose2
from mapping.pose_graph import carried_covariance, turned_covariance
from mapping.scan import LaserScan
from mapping.submap import Submap
from mapping.submap_graph import Chain, SubmapGraph
from mapping.way import Way

# A robot that has turned this much sees enough that is new for another comparison [rad].
_AGAIN_TURN = 0.6


class LoopSearch:
    """Compares scans with the submaps of a team."""

    def __init__(self, team: SubmapGraph) -> None:
        """Look for loops in this graph."""
        self._team = team
        self._settings = team.settings

    def around(
        self, robot: str, scan: LaserScan, T_map_base: Pose2, way: Way
    ) -> list[tuple[Submap, Match]]:
        """Compare a scan with the submaps around it that its robot is not just drawing.

        Args:
            robot: who took it.
            scan: the scan.
            T_map_base: where it was taken, as foreseen.
            way: how its robot got there from its last node, by its own word.

        Returns:
            For each submap that it fits: the submap, and the match in its anchor's frame.
        """
        chain, settings = self._team.chains[robot], self._settings
        points_base = scan.points_base()
        own, driven = self._team.carried(chain, T_map_base, way)
        reach = window_of(own, settings).reach + 0.15
        candidates = []
        for submap in self._in_sight(points_base, T_map_base):
            last = chain.compared.get(submap.anchor)
            if submap is chain.submap or (
                last and not last.moved(T_map_base, settings.again_m, _AGAIN_TURN)
            ):
                continue
            guess = self._team.graph.pose(submap.anchor).inverse() @ T_map_base
            seen = submap.walls.near(guess.apply(points_base), reach)
            if seen >= settings.points:
                candidates.append((seen, submap, guess))
            else:
                chain.compared[submap.anchor] = T_map_base
        candidates.sort(key=lambda row: (-row[0], row[1].anchor))
        found = []
        for _, submap, guess in candidates[: settings.compared]:
            chain.compared[submap.anchor] = T_map_base
            prior = self._apart(chain, submap, T_map_base, own, driven)
            match = compare(submap.map, scan, guess, prior, settings)
            if match is not None:
                found.append((submap, match))
        return found

    def _in_sight(self, points_base: Floats, T_map_base: Pose2) -> list[Submap]:
        """Return the submaps whose walls may lie among some points (N, 2) [m], base frame."""
        farthest = float(np.hypot(*points_base.T).max(initial=0.0)) + self._settings.window_m
        anchors = self._team.graph.poses[[submap.anchor for submap in self._team.submaps], :2]
        away = np.hypot(anchors[:, 0] - T_map_base.x, anchors[:, 1] - T_map_base.y).tolist()
        return [
            submap
            for submap, distance in zip(self._team.submaps, away, strict=True)
            if distance <= submap.walls.radius + farthest
        ]

    def consolidate(self) -> None:
        """Compare scans with the submaps around them that theirs is not firmly tied to yet.

        A scan is compared when it comes with what others drew before; what they draw later may
        overlap it as well. Of a large team's scans every so many are taken, which bounds the work.
        """
        graph, settings = self._team.graph, self._settings
        nodes = list(range(0, len(graph), 1 + len(graph) // settings.again_most))
        for node, covariance in zip(nodes, graph.covariances(nodes), strict=True):
            scan, T_map_base = self._team.scans[node], graph.pose(node)
            points_base = scan.points_base()
            for submap in self._team.submaps:
                T_map_anchor = graph.pose(submap.anchor)
                pair = self._team.pair(submap.anchor, node)
                if pair[0] == pair[1] or self._team.ties[pair] >= settings.firm:
                    continue
                if T_map_anchor.distance_to(T_map_base) > 2.0 * scan.range_max:
                    continue
                guess = T_map_anchor.inverse() @ T_map_base
                if submap.walls.near(guess.apply(points_base), 0.3) < settings.points:
                    continue
                dx, dy = T_map_base.x - T_map_anchor.x, T_map_base.y - T_map_anchor.y
                apart = covariance + carried_covariance(submap.covariance, dx, dy) + FLOOR
                prior = turned_covariance(apart, T_map_anchor.theta)
                match = compare(submap.map, scan, guess, prior, settings)
                if match is not None:
                    self._team.connect(submap, node, match)

    def _apart(
        self, chain: Chain, submap: Submap, T_map_base: Pose2, own: Floats, driven: Floats
    ) -> Floats:
        """Return the covariance (3, 3) of a pose in a submap's anchor frame.

        What both have in common is not known here, so it is counted twice: too wide a window
        costs time, too narrow a one loops. Of a robot's own submaps the way since then is known.
        """
        T_map_anchor = self._team.graph.pose(submap.anchor)
        dx, dy = T_map_base.x - T_map_anchor.x, T_map_base.y - T_map_anchor.y
        apart = own + carried_covariance(submap.covariance, dx, dy)
        if submap.robot == chain.submap.robot and submap.anchor >= chain.first:
            since = self._team.driven_since(submap, driven, T_map_base)
            if np.trace(since) < np.trace(apart):
                apart = since
        return turned_covariance(apart + FLOOR, T_map_anchor.theta)
