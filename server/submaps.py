"""Submaps: what one robot saw along a short piece of its way, firm in itself.

The team's map is drawn by all robots together and has one answer for every place. To find out that
two pieces of it do not fit together, each must be known alone: a scan is matched with the submap
that another robot drew of the place, or the same robot long ago.

Source: Hess, Kohler, Rapp & Andor 2016, "Real-time loop closure in 2D LIDAR SLAM", for submaps.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.match_map import MapSettings, MatchMap
from mapping.scan import LaserScan


class Submap:
    """A piece of map in the frame of its anchor, the robot's pose at its first scan.

    Attributes:
        robot: who drew it.
        anchor: the pose graph's node of its first scan.
        map: the scans laid together.
        covariance: (3, 3) of the anchor in the team's map, map frame.
        driven: (3, 3) that the robot's whole way to it alone would have given, map frame.
    """

    def __init__(
        self,
        robot: str,
        anchor: int,
        covariance: Floats,
        driven: Floats,
        settings: MapSettings,
    ) -> None:
        self.robot = robot
        self.anchor = anchor
        self.covariance = covariance
        self.driven = driven
        self.map = MatchMap(settings)
        self._walls: cKDTree | None = None
        self._tree_scans = -1
        self._radius = 0.0

    def insert(self, scan: LaserScan, T_anchor_base: Pose2 = IDENTITY) -> None:
        """Insert a scan at its pose in the anchor's frame."""
        self.map.insert(scan, T_anchor_base)

    def finish(self) -> None:
        """Let go of what only drawing needs, a third of the memory: no scan comes in any more."""
        surfaces = self.map.surfaces
        surfaces.owned = np.zeros((len(surfaces.owned), 0, 0), dtype=np.int32)

    @property
    def radius(self) -> float:
        """How far from the anchor its walls reach [m]."""
        self._refresh()
        return self._radius

    def near_walls(self, points_anchor: Floats, reach: float) -> int:
        """Return how many of the points (N, 2) lie within `reach` [m] of a wall, anchor frame."""
        self._refresh()
        if self._walls is None or not len(points_anchor):
            return 0
        distances, _ = self._walls.query(points_anchor, distance_upper_bound=reach)
        return int(np.isfinite(distances).sum())

    def _refresh(self) -> None:
        """Look the walls up anew where scans have come in since."""
        if self._tree_scans == self.map.scans:
            return
        surfaces = self.map.surfaces
        walls = surfaces.surfels[: surfaces.count, :2][surfaces.occupied[: surfaces.count]]
        self._walls = cKDTree(walls) if len(walls) else None
        self._radius = float(np.hypot(*walls.T).max(initial=0.0))
        self._tree_scans = self.map.scans
