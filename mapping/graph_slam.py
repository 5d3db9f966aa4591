"""SLAM by a pose graph: where a robot comes back to a place, its whole way since is put right.

Scan matching goes ahead from scan to scan. Now and then one of the scans becomes a node of the
graph, tied to the one before by what was matched, to the submap that is just being drawn, and to
every older submap that it fits; the optimum of all that moves all nodes.

Source: Simmons et al. 2000 for what goes ahead; Hess, Kohler, Rapp & Andor 2016 for submaps and
loops; Olson 2009 for the search; Grisetti, Kuemmerle, Stachniss & Burgard 2010 for the graph.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mapping.estimator import Estimate
from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.grid import OccupancyGrid
from mapping.incremental_slam import IncrementalSlam, SlamSettings
from mapping.loop_search import LoopSearch
from mapping.loop_settings import LoopSettings
from mapping.match_map import MatchMap
from mapping.pose_graph import PoseGraph
from mapping.scan import LaserScan
from mapping.submap_graph import SubmapGraph
from mapping.trail import Trail
from mapping.way import Report, corrected_track, way_between

# There is one robot in this graph.
_ROBOT = "robot"


@dataclass(frozen=True, slots=True)
class GraphSettings:
    """How a robot's way becomes a graph.

    Attributes:
        node_distance: a scan becomes a node after moving this far [m],
        node_turn: or turning this much [rad].
        loops: how loops are found and the graph is put right. One robot that goes round and round
            closes them all the time: to compare and to put right less often than a team loses
            nothing.
    """

    node_distance: float = 0.4
    node_turn: float = math.radians(20.0)
    loops: LoopSettings = field(default_factory=lambda: LoopSettings(compared=2, settle_above=40.0))


class GraphSlam:
    """Pose graph: scan matching, loops found by correlative search, all poses put right together.

    Attributes:
        submaps: nodes, edges and submaps; their frame is the odom frame at the start.
    """

    def __init__(
        self,
        settings: SlamSettings | None = None,
        rng: np.random.Generator | None = None,
        graph: GraphSettings | None = None,
    ) -> None:
        """Begin at the origin; nothing is drawn by lot, so `rng` is not used."""
        self._settings = graph or GraphSettings()
        self._front = IncrementalSlam(settings)
        front = self._front.settings
        self._motion = front.motion
        self.submaps = SubmapGraph(self._settings.loops, front.map)
        self._search = LoopSearch(self.submaps)
        self._trail = Trail(self._settings.loops.spans_m)
        self._last: Report | None = None
        self._track: list[tuple[float, float, float, float]] = []
        self._nodes: list[Report] = []

    @property
    def T_odom_base(self) -> Pose2:  # noqa: N802
        """The pose now, as scan matching has it: it does not jump when the graph is put right."""
        return self._front.T_odom_base

    @property
    def covariance(self) -> Floats:
        """(3, 3) of (x, y, theta), odom frame."""
        return self._front.covariance

    def step(self, T_before_after: Pose2, scan: LaserScan | None) -> Estimate:
        """Take in one odometry increment, and the scan taken at its end; see `Estimator`."""
        estimate = self._front.step(T_before_after, scan)
        if scan is not None:
            self._track.append((scan.stamp, *estimate.T_odom_base.as_tuple()))
            # What contradicts the map is not drawn, and where it was seen is not known.
            if estimate.inserted and self._due(estimate.T_odom_base):
                self._add_node(self._report(scan))
        return estimate

    def finish(self) -> None:
        """Compare once more what came together late, and put all right."""
        if self._last is not None:
            self.submaps.settle()
            self._search.consolidate()
            self.submaps.settle()
            self.submaps.graph.reject(self._settings.loops.reject_above)

    def trajectory(self) -> Floats:
        """Return the pose at each scan taken in, (n, 3) of x, y [m], theta [rad], as known now."""
        T_map_odom, parts = IDENTITY, [np.zeros((0, 4))]
        for node, report in enumerate(self._nodes):
            before = T_map_odom
            T_map_odom = self.submaps.graph.pose(node) @ report.T_odom_base.inverse()
            parts.append(corrected_track(report.track_odom, before, T_map_odom))
        untold = np.array(self._track, dtype=np.float64).reshape(-1, 4)
        parts.append(corrected_track(untold, T_map_odom, T_map_odom))
        return np.concatenate(parts)[:, 1:]

    def pose_graph(self) -> PoseGraph:
        """Return the graph of all nodes."""
        return self.submaps.graph

    def occupancy(self) -> OccupancyGrid:
        """Return the map of all nodes' scans where the graph has them now."""
        drawn = MatchMap(self._front.settings.map)
        drawn.insert_all(
            (report.scan, self.submaps.graph.pose(node)) for node, report in enumerate(self._nodes)
        )
        return drawn.grid

    # --- steps ----------------------------------------------------------------------------------

    def _due(self, T_odom_base: Pose2) -> bool:
        """Whether the scan just matched becomes a node."""
        if self._last is None:
            return True
        settings, T_odom_last = self._settings, self._last.T_odom_base
        return T_odom_last.moved(T_odom_base, settings.node_distance, settings.node_turn)

    def _report(self, scan: LaserScan) -> Report:
        """Return the scan just matched, with the way since the last node.

        Not where the wheels put it: scan matching has looked there and found better.
        """
        track = np.array(self._track, dtype=np.float64)
        self._track.clear()
        return Report(scan, self.T_odom_base, self.covariance.copy(), track)

    def _add_node(self, report: Report) -> None:
        """Add a scan to the graph, close the loops it closes, and put all right if it strains."""
        last, self._last = self._last, report
        self._nodes.append(report)
        if last is None:
            node = self.submaps.begin(_ROBOT, report.scan, report.T_odom_base, report.covariance)
            self._trail.begin(node, report)
            return
        way = way_between(last, report, report.track_odom, self._motion)
        T_map_base = self.submaps.graph.pose(len(self._nodes) - 2) @ way.T_last_base
        loops = self._search.around(_ROBOT, report.scan, T_map_base, way)
        node = self.submaps.extend(_ROBOT, report.scan, T_map_base, way)
        for span in self._trail.add(node, report, way):
            self.submaps.span(span, node)
        if self.submaps.strained(self.submaps.connect_loops(node, loops)):
            self.submaps.settle()
