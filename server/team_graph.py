"""What ties the team's scans together: the pose graph, and the comparisons that give its edges.

Three things are known of where a scan was taken: the robot's own word on its way since its last
one, how it fits the submap the robot is just drawing, and how it fits older submaps and those of
others. The first two hold a robot's way together; the last close loops. Where a loop closes with
an error, the way that knew least of itself bends most.

Source: Hess et al. 2016 for comparing scans with submaps; Olson 2009 for the search.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import IDENTITY, Floats, Pose2, wrap_angle
from mapping.match_map import MapSettings
from mapping.pose_graph import (
    Edge,
    PoseGraph,
    blurred_information,
    carried_covariance,
    turned_covariance,
)
from mapping.scan import LaserScan
from server.comparing import (
    FLOOR,
    Match,
    compare,
    firm_match,
    fits,
    widest_sigma,
    window_of,
)
from server.placing import Way
from server.settings import LoopSettings
from server.submaps import Submap

# A robot is tied when little was seen of anything; loops tell better soon [m], [rad].
_TIE = np.diag([0.05**2, 0.05**2, math.radians(1.0) ** 2])

# Each time the map is put right, one of so many submaps is asked how well it is known: to ask all
# takes longer than to put the map right, and what is known only grows.
_RENEWED = 8


@dataclass(slots=True)
class Chain:
    """The way of one robot through the graph.

    Attributes:
        node: its last node.
        covariance: (3, 3) of that node in the team's map, map frame.
        submap: which it is just drawing.
        T_anchor_base: where its last scan lies in that.
        driven: (3, 3) covariance that the whole way alone would have given, map frame.
        first: the first node of its way.
        compared: where each other submap was last compared with what it saw, by anchor.
    """

    node: int
    covariance: Floats
    submap: Submap
    T_anchor_base: Pose2
    driven: Floats
    first: int
    compared: dict[int, Pose2]


class TeamGraph:
    """The pose graph of a team, and its submaps.

    Attributes:
        graph: nodes are placed scans, in the order of placing.
        submaps: all, in the order they were begun.
        chains: by robot's name.
        closed: number of loops that closed.
    """

    def __init__(self, settings: LoopSettings, map_settings: MapSettings) -> None:
        self.settings = settings
        self.graph = PoseGraph()
        self.submaps: list[Submap] = []
        self.chains: dict[str, Chain] = {}
        self.closed = 0
        self._scans: list[LaserScan] = []
        self._drawn_in: list[int] = []  # by node, the anchor of the submap its scan was drawn in
        self._ties: Counter[tuple[int, int]] = Counter()  # comparisons between two submaps
        self._unsettled = 0
        self._settled = 0
        self._map_settings = map_settings

    # --- growing --------------------------------------------------------------------------------

    def begin(self, robot: str, scan: LaserScan, T_map_base: Pose2, covariance: Floats) -> int:
        """Add the first node of a robot's way, known to `covariance` (3, 3), map frame."""
        node = self._add(scan, T_map_base)
        submap = self._new_submap(robot, node, covariance, np.zeros((3, 3)))
        submap.insert(scan)
        self.chains[robot] = Chain(node, covariance, submap, IDENTITY, submap.driven, node, {})
        return node

    def tie(self, i: int, j: int, T_i_j: Pose2, covariance: Floats) -> None:
        """Connect two nodes whose relative pose is known to `covariance` (3, 3), frame of j."""
        information: Floats = np.linalg.inv(covariance + _TIE).astype(np.float64)
        self.graph.connect(Edge(i, j, T_i_j, information, robust=True))

    def extend(self, robot: str, scan: LaserScan, T_map_base: Pose2, way: Way) -> int:
        """Add a node to a robot's way.

        Args:
            robot: its name.
            scan: what it saw there.
            T_map_base: where, as placed.
            way: how it got there from the node before, by its own word.
        """
        chain = self.chains[robot]
        node = self._add(scan, T_map_base)
        self.graph.connect(_step(chain.node, node, way, robust=False))
        chain.covariance, chain.driven = self._carried(chain, T_map_base, way)
        chain.node = node
        self._draw(chain, scan, T_map_base, way)
        return node

    def span(self, first: int, last: int, way: Way) -> None:
        """Connect two nodes of one robot by what its own map says of the way between them.

        It may be wrong: now and then a robot takes one thing for another, and its map is bent.
        """
        self.graph.connect(_step(first, last, way, robust=True))

    def _add(self, scan: LaserScan, T_map_base: Pose2) -> int:
        self._scans.append(scan)
        self._drawn_in.append(len(self._drawn_in))
        return self.graph.add(T_map_base)

    def _carried(self, chain: Chain, T_map_base: Pose2, way: Way) -> tuple[Floats, Floats]:
        """Return both covariances (3, 3) of a robot after its way to a new pose, map frame."""
        before = self.graph.pose(chain.node)
        dx, dy = T_map_base.x - before.x, T_map_base.y - before.y
        turned = turned_covariance(way.covariance, -T_map_base.theta)
        return (
            carried_covariance(chain.covariance, dx, dy) + turned,
            carried_covariance(chain.driven, dx, dy) + turned,
        )

    def _draw(self, chain: Chain, scan: LaserScan, T_map_base: Pose2, way: Way) -> None:
        """Compare a scan with the submap being drawn, and add it; begin a new one where due."""
        submap, settings = chain.submap, self.settings
        T_map_anchor = self.graph.pose(submap.anchor)
        guess = chain.T_anchor_base @ way.T_last_base
        growth = self._driven_since(submap, chain.driven, T_map_base)
        prior = turned_covariance(growth + 0.25 * FLOOR, T_map_anchor.theta)
        result = submap.map.match(scan, guess, prior)
        if fits(result, settings):
            match = firm_match(submap.map, scan, guess, prior, result)
            self._connect(submap, chain.node, match)
            guess = match.T_map_base
        sigma = widest_sigma(prior)
        if (
            math.hypot(guess.x, guess.y) > settings.submap_m
            or submap.map.scans >= settings.submap_scans
            or sigma > settings.submap_sigma_m
            or prior[2, 2] > math.radians(settings.submap_sigma_deg) ** 2
        ):
            chain.submap = self._new_submap(
                submap.robot, chain.node, chain.covariance, chain.driven
            )
            chain.submap.insert(scan)
            chain.T_anchor_base = IDENTITY
            chain.compared[submap.anchor] = T_map_base
            self._finish(submap)
            return
        submap.insert(scan, guess)
        self._drawn_in[chain.node] = submap.anchor
        chain.T_anchor_base = guess

    def _finish(self, submap: Submap) -> None:
        """Keep a submap that has ended, unless its place is known well from enough others.

        So what a team keeps grows with the building, and not with how often robots pass by.
        """
        settings, T_map_anchor = self.settings, self.graph.pose(submap.anchor)
        near = sum(
            self.graph.pose(other.anchor).distance_to(T_map_anchor) <= settings.enough_within_m
            for other in self.submaps
            if other is not submap
        )
        if near >= settings.enough:
            self.submaps.remove(submap)
        else:
            submap.finish()

    def _new_submap(self, robot: str, node: int, covariance: Floats, driven: Floats) -> Submap:
        submap = Submap(robot, node, covariance, driven, self._map_settings)
        self.submaps.append(submap)
        return submap

    # --- closing loops --------------------------------------------------------------------------

    def close_loops(
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
        chain, settings = self.chains[robot], self.settings
        points_base = scan.points_base()
        own, driven = self._carried(chain, T_map_base, way)
        reach = window_of(own, settings).reach + 0.15
        around = []
        for submap in self._in_sight(points_base, T_map_base):
            last = chain.compared.get(submap.anchor)
            if submap is chain.submap or (last and not self._moved(last, T_map_base)):
                continue
            guess = self.graph.pose(submap.anchor).inverse() @ T_map_base
            seen = submap.walls.near(guess.apply(points_base), reach)
            if seen >= settings.points:
                around.append((seen, submap, guess))
            else:
                chain.compared[submap.anchor] = T_map_base
        around.sort(key=lambda row: (-row[0], row[1].anchor))
        found = []
        for _, submap, guess in around[: settings.compared]:
            chain.compared[submap.anchor] = T_map_base
            prior = self._apart(chain, submap, T_map_base, own, driven)
            match = compare(submap.map, scan, guess, prior, settings)
            if match is not None:
                found.append((submap, match))
        return found

    def _in_sight(self, points_base: Floats, T_map_base: Pose2) -> list[Submap]:
        """Return the submaps whose walls may lie among some points (N, 2) [m], base frame."""
        farthest = float(np.hypot(*points_base.T).max(initial=0.0)) + self.settings.window_m
        anchors = self.graph.poses[[submap.anchor for submap in self.submaps], :2]
        away = np.hypot(anchors[:, 0] - T_map_base.x, anchors[:, 1] - T_map_base.y).tolist()
        return [
            submap
            for submap, distance in zip(self.submaps, away, strict=True)
            if distance <= submap.walls.radius + farthest
        ]

    def connect_loops(self, node: int, found: Sequence[tuple[Submap, Match]]) -> float:
        """Connect a new node with the submaps its scan fits; return the worst squared error."""
        worst = 0.0
        for submap, match in found:
            edge = self._connect(submap, node, match)
            worst = max(worst, self.graph.error(edge)[1])
            self.closed += 1
            self._unsettled += 1
        return worst

    def consolidate(self) -> None:
        """Compare scans with the submaps around them that theirs is not firmly tied to yet.

        A scan is compared when it comes with what others drew before; what they draw later may
        overlap it as well. Of a large team's scans every so many are taken, which bounds the work.
        """
        nodes = list(range(0, len(self.graph), 1 + len(self.graph) // self.settings.again_most))
        covariances = self.graph.covariances(nodes)
        for node, covariance in zip(nodes, covariances, strict=True):
            scan, T_map_base = self._scans[node], self.graph.pose(node)
            for submap in self.submaps:
                T_map_anchor = self.graph.pose(submap.anchor)
                pair = self._pair(submap.anchor, node)
                if pair[0] == pair[1] or self._ties[pair] >= self.settings.firm:
                    continue
                if T_map_anchor.distance_to(T_map_base) > 2.0 * scan.range_max:
                    continue
                guess = T_map_anchor.inverse() @ T_map_base
                if submap.walls.near(guess.apply(scan.points_base()), 0.3) < self.settings.points:
                    continue
                dx, dy = T_map_base.x - T_map_anchor.x, T_map_base.y - T_map_anchor.y
                apart = covariance + carried_covariance(submap.covariance, dx, dy) + FLOOR
                prior = turned_covariance(apart, T_map_anchor.theta)
                match = compare(submap.map, scan, guess, prior, self.settings)
                if match is not None:
                    self._connect(submap, node, match)

    def _pair(self, i: int, j: int) -> tuple[int, int]:
        """Return the anchors of the submaps in which two nodes were drawn, the earlier first."""
        one, other = self._drawn_in[i], self._drawn_in[j]
        return (one, other) if one < other else (other, one)

    def strained(self, worst: float) -> bool:
        """Whether the nodes are to be moved: a loop closed with an error, or many closed since."""
        settings = self.settings
        many = max(settings.settle_every, settings.settle_share * self.closed)
        return worst > settings.settle_above or self._unsettled >= many

    def astray(self, drawn: Sequence[Pose2]) -> bool:
        """Whether a node lies far from where its scan was drawn, in the order of the nodes."""
        if not drawn:
            return False
        poses = np.array([T_map_base.as_array() for T_map_base in drawn])
        off = self.graph.poses[: len(poses)] - poses
        turned = np.abs(np.arctan2(np.sin(off[:, 2]), np.cos(off[:, 2]))).max()
        moved = np.hypot(off[:, 0], off[:, 1]).max()
        settings = self.settings
        return bool(moved >= settings.redraw_m or turned >= math.radians(settings.redraw_deg))

    def settle(self) -> tuple[float, float]:
        """Move all nodes to where they agree best; return the most moved [m] and turned [rad]."""
        self._unsettled = 0
        self._settled += 1
        moved = self.graph.optimise()
        chains = list(self.chains.values())
        renewed = self.submaps[self._settled % _RENEWED :: _RENEWED]
        nodes = [chain.node for chain in chains] + [submap.anchor for submap in renewed]
        covariances = self.graph.covariances(nodes)
        asked: list[Chain | Submap] = [*chains, *renewed]
        for known, covariance in zip(asked, covariances, strict=True):
            known.covariance = covariance
        for chain in chains:
            if moved[0] > self.settings.redraw_m:
                chain.compared = {}
        return moved

    def _connect(self, submap: Submap, node: int, match: Match) -> Edge:
        """Connect a node with a submap that its scan fits."""
        T_anchor_base = match.T_map_base
        information = turned_covariance(match.information, T_anchor_base.theta)
        information = blurred_information(information, FLOOR)
        edge = Edge(submap.anchor, node, T_anchor_base, information, robust=True)
        self.graph.connect(edge)
        self._ties[self._pair(submap.anchor, node)] += 1
        return edge

    def _moved(self, last: Pose2, now: Pose2) -> bool:
        """Whether a robot sees enough that is new for another comparison."""
        return (
            last.distance_to(now) >= self.settings.again_m
            or abs(wrap_angle(last.theta - now.theta)) >= 0.6
        )

    def _apart(
        self, chain: Chain, submap: Submap, T_map_base: Pose2, own: Floats, driven: Floats
    ) -> Floats:
        """Return the covariance (3, 3) of a pose in a submap's anchor frame.

        What both have in common is not known here, so it is counted twice: too wide a window
        costs time, too narrow a one loops. Of a robot's own submaps the way since then is known.
        """
        T_map_anchor = self.graph.pose(submap.anchor)
        dx, dy = T_map_base.x - T_map_anchor.x, T_map_base.y - T_map_anchor.y
        apart = own + carried_covariance(submap.covariance, dx, dy)
        if submap.robot == chain.submap.robot and submap.anchor >= chain.first:
            since = self._driven_since(submap, driven, T_map_base)
            if np.trace(since) < np.trace(apart):
                apart = since
        return turned_covariance(apart + FLOOR, T_map_anchor.theta)

    def _driven_since(self, submap: Submap, driven: Floats, T_map_base: Pose2) -> Floats:
        """Return the covariance (3, 3) that a robot's way since a submap's anchor gave it."""
        T_map_anchor = self.graph.pose(submap.anchor)
        dx, dy = T_map_base.x - T_map_anchor.x, T_map_base.y - T_map_anchor.y
        return _positive(driven - carried_covariance(submap.driven, dx, dy))


def _step(i: int, j: int, way: Way, robust: bool) -> Edge:
    """Return the edge between the nodes at both ends of a way."""
    information: Floats = np.linalg.inv(way.covariance).astype(np.float64)
    return Edge(i, j, way.T_last_base, information, robust)


def _positive(covariance: Floats) -> Floats:
    """Return the part of a symmetric (3, 3) matrix that is a covariance."""
    strengths, directions = np.linalg.eigh(0.5 * (covariance + covariance.T))
    positive: Floats = (directions * np.maximum(strengths, 0.0)) @ directions.T
    return positive
