"""What ties the team's scans together: the pose graph, and the submaps that give its edges.

Three things are known of where a scan was taken: the robot's own word on its way since its last
one, how it fits the submap the robot is just drawing, and how it fits older submaps and those of
others. The first two hold a robot's way together; the last close loops (`mapping.loop_search`).
Where a loop closes with an error, the way that knew least of itself bends most.

Source: Hess et al. 2016 for comparing scans with submaps; Olson 2009 for the search.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.comparing import (
    FLOOR,
    Match,
    firm_match,
    fits,
    widest_sigma,
)
from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.loop_settings import LoopSettings
from mapping.match_map import MapSettings
from mapping.pose_graph import (
    Edge,
    PoseGraph,
    blurred_information,
    carried_covariance,
    positive_part,
    turned_covariance,
)
from mapping.scan import LaserScan
from mapping.seams import Piece, Seam, loose_seams
from mapping.submap import Submap
from mapping.trail import Span
from mapping.way import Way

# A robot is tied when little was seen of anything; loops tell better soon [m], [rad].
_TIE = np.diag([0.05**2, 0.05**2, math.radians(1.0) ** 2])

# A submap holds few scans, so the pieces of wall that its surfels stand for are longer [cells].
_SUBMAP_FIT = 6
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


class SubmapGraph:
    """The pose graph of a team, and its submaps.

    Attributes:
        graph: nodes are placed scans, in the order of placing.
        submaps: all, in the order they were begun.
        chains: by robot's name.
        closed: number of loops that closed.
        scans: by node.
        ties: number of comparisons that tie two submaps, by `pair`.
    """

    def __init__(self, settings: LoopSettings, map_settings: MapSettings) -> None:
        self.settings = settings
        self.graph = PoseGraph()
        self.submaps: list[Submap] = []
        self.chains: dict[str, Chain] = {}
        self.closed = 0
        self.scans: list[LaserScan] = []
        self._drawn_in: list[int] = []  # by node, the anchor of the submap its scan was drawn in
        self.ties: Counter[tuple[int, int]] = Counter()  # comparisons between two submaps
        self._unsettled = 0
        self._settled = 0
        surface = replace(map_settings.surface, fit_radius=_SUBMAP_FIT)
        self._map_settings = replace(map_settings, surface=surface)

    # --- growing --------------------------------------------------------------------------------

    def begin(self, robot: str, scan: LaserScan, T_map_base: Pose2, covariance: Floats) -> int:
        """Add the first node of a robot's way, known to `covariance` (3, 3), map frame."""
        node = self._add(scan, T_map_base)
        submap = self._new_submap(robot, node, covariance, np.zeros((3, 3)))
        submap.insert(self._near(scan))
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
        information: Floats = np.linalg.inv(way.covariance).astype(np.float64)
        self.graph.connect(Edge(chain.node, node, way.T_last_base, information))
        chain.covariance, chain.driven = self.carried(chain, T_map_base, way)
        chain.node = node
        self._draw(chain, scan, T_map_base, way)
        return node

    def span(self, span: Span, last: int) -> None:
        """Connect two nodes of one robot by what its own map says of the way between them.

        It may be wrong: now and then a robot takes one thing for another, and its map is bent.
        """
        edge = Edge(span.first, last, span.T_first_last, span.information, robust=True)
        self.graph.connect(edge)

    def _add(self, scan: LaserScan, T_map_base: Pose2) -> int:
        self.scans.append(scan)
        self._drawn_in.append(len(self._drawn_in))
        return self.graph.add(T_map_base)

    def carried(self, chain: Chain, T_map_base: Pose2, way: Way) -> tuple[Floats, Floats]:
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
        growth = self.driven_since(submap, chain.driven, T_map_base)
        prior = turned_covariance(growth + 0.25 * FLOOR, T_map_anchor.theta)
        result = submap.map.match(scan, guess, prior)
        if fits(result, settings):
            match = firm_match(submap.map, scan, guess, prior, result)
            self.connect(submap, chain.node, match)
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
            chain.submap.insert(self._near(scan))
            chain.T_anchor_base = IDENTITY
            chain.compared[submap.anchor] = T_map_base
            self._finish(submap)
            return
        submap.insert(self._near(scan), guess)
        self._drawn_in[chain.node] = submap.anchor
        chain.T_anchor_base = guess

    def _near(self, scan: LaserScan) -> LaserScan:
        """Return a scan with what is near enough to be drawn in submaps."""
        return scan.within(self.settings.submap_range_m)

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

    # --- putting right ---------------------------------------------------------------------------

    def connect_loops(self, node: int, found: Sequence[tuple[Submap, Match]]) -> float:
        """Connect a new node with the submaps its scan fits; return the worst squared error."""
        worst = 0.0
        for submap, match in found:
            edge = self.connect(submap, node, match)
            worst = max(worst, self.graph.error(edge)[1])
            self.closed += 1
            self._unsettled += 1
        return worst

    def pair(self, i: int, j: int) -> tuple[int, int]:
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

    def loose_seams(self, loose: float) -> list[Seam]:
        """Return where submaps meet that may stand off each other by more (one sigma) [m]."""
        anchors = [submap.anchor for submap in self.submaps]
        pieces = [_piece(submap, self.graph.pose(submap.anchor)) for submap in self.submaps]
        return loose_seams(pieces, self.graph.joint_covariance(anchors), loose)

    def connect(self, submap: Submap, node: int, match: Match) -> Edge:
        """Connect a node with a submap that its scan fits."""
        T_anchor_base = match.T_map_base
        information = turned_covariance(match.information, T_anchor_base.theta)
        information = blurred_information(information, FLOOR)
        edge = Edge(submap.anchor, node, T_anchor_base, information, robust=True)
        self.graph.connect(edge)
        self.ties[self.pair(submap.anchor, node)] += 1
        return edge

    def driven_since(self, submap: Submap, driven: Floats, T_map_base: Pose2) -> Floats:
        """Return the covariance (3, 3) that a robot's way since a submap's anchor gave it."""
        T_map_anchor = self.graph.pose(submap.anchor)
        dx, dy = T_map_base.x - T_map_anchor.x, T_map_base.y - T_map_anchor.y
        return positive_part(driven - carried_covariance(submap.driven, dx, dy))


def _piece(submap: Submap, T_map_anchor: Pose2) -> Piece:
    """Return a submap as a piece of the team's map."""
    turned = Pose2(0.0, 0.0, T_map_anchor.theta)
    return Piece(
        T_map_anchor.as_array()[:2],
        T_map_anchor.apply(submap.wall_points),
        turned.apply(submap.wall_normals),
    )
