"""Submaps: what one robot saw along a short piece of its way, firm in itself.

The team's map is drawn by all robots together and has one answer for every place. To find out that
two pieces of it do not fit together, each must be known alone: a scan is matched with the submap
that another robot drew of the place, or the same robot long ago.

Source: Hess, Kohler, Rapp & Andor 2016, "Real-time loop closure in 2D LIDAR SLAM", for submaps.
"""

from __future__ import annotations

import numpy as np

from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.match_map import MapSettings, MatchMap
from mapping.scan import LaserScan
from mapping.wall_blocks import WallBlocks


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
        self._walls = WallBlocks(np.zeros((0, 2)))
        self._seen_scans = 0

    def insert(self, scan: LaserScan, T_anchor_base: Pose2 = IDENTITY) -> None:
        """Insert a scan at its pose in the anchor's frame."""
        self.map.insert(scan, T_anchor_base)

    def finish(self) -> None:
        """No scan comes in any more: keep what comparing needs."""
        self.map.seal()

    @property
    def walls(self) -> WallBlocks:
        """Where it has walls, anchor frame."""
        if self._seen_scans != self.map.scans:
            self._seen_scans = self.map.scans
            self._walls = WallBlocks(self.wall_points)
        return self._walls

    @property
    def wall_points(self) -> Floats:
        """Points on its walls (n, 2) [m], anchor frame."""
        return self._wall_surfels[:, :2]

    @property
    def wall_normals(self) -> Floats:
        """Unit vectors across its walls at these points (n, 2), of either sign, anchor frame."""
        xx, xy, yy = self._wall_surfels[:, 2:5].T
        angles = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        return np.stack((np.cos(angles), np.sin(angles)), axis=1)

    @property
    def _wall_surfels(self) -> Floats:
        surfaces = self.map.surfaces
        return surfaces.surfels[: surfaces.count][surfaces.occupied[: surfaces.count]]
