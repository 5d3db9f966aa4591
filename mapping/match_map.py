"""A map to match against: occupancy grid and walls, kept in step.

Robots match against their own; the server's merger matches against the team's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.correlative_search import SearchWindow
from mapping.geometry import Floats, Pose2
from mapping.grid import GridGeometry, OccupancyGrid, Padding
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings, integrate_scan, scan_extent
from mapping.scan_matching import MatchResult, MatchSettings, matches, posterior_density
from mapping.scan_points import scan_points, turned_points
from mapping.surface_map import SurfaceMap, SurfaceSettings


@dataclass(frozen=True, slots=True)
class MapSettings:
    """Everything that shapes a map.

    Attributes:
        resolution: edge of a cell [m].
        integration: how strongly one scan speaks.
        surface: how walls are made of end points.
        matching: how scans are matched.
    """

    resolution: float = 0.05
    integration: IntegrationSettings = field(default_factory=IntegrationSettings)
    surface: SurfaceSettings = field(default_factory=SurfaceSettings)
    matching: MatchSettings = field(default_factory=MatchSettings)


class MatchMap:
    """Occupancy grid and walls of one map frame.

    Attributes:
        settings: everything that shapes the map.
        grid: the occupancy grid; grows as scans come in.
        surfaces: its walls.
        scans: number of scans inserted.
    """

    __slots__ = ("grid", "scans", "settings", "surfaces")

    def __init__(self, settings: MapSettings | None = None) -> None:
        self.settings = settings or MapSettings()
        geometry = GridGeometry(self.settings.resolution, 0.0, 0.0, 1, 1)
        self.grid = OccupancyGrid.unknown(geometry)
        self.surfaces = SurfaceMap(geometry.shape, self.settings.surface)
        self.scans = 0

    def grow(self, x_min: float, y_min: float, x_max: float, y_max: float) -> Padding:
        """Grow to cover a rectangle [m], map frame; return by how much."""
        padding = self.grid.grow(x_min, y_min, x_max, y_max)
        self.surfaces.grow(padding)
        return padding

    def insert(self, scan: LaserScan, T_map_base: Pose2, cautious: bool = False) -> CellBox:
        """Fuse a scan into grid and walls, growing them; return the cells that may have changed.

        Args:
            scan: the scan.
            T_map_base: pose of the robot at `scan.stamp`.
            cautious: do not erase walls; for poses too uncertain to argue with the map.
        """
        box = self._integrate(scan, T_map_base, cautious)
        self.surfaces.refresh(self.grid, box)
        return box

    def refine(self, scan: LaserScan, T_map_base: Pose2) -> None:
        """Let a scan sharpen the walls without drawing it: much cheaper than to insert it.

        Its end points join the means of their cells; the pieces of wall follow at the next insert.
        """
        points_map = turned_points(scan_points(scan), T_map_base)
        self.surfaces.take(self.grid.geometry, points_map, self._depth)

    def insert_all(self, scans: Iterable[tuple[LaserScan, Pose2]]) -> None:
        """Fuse scans with their poses `T_map_base`; the walls are fitted once, to all of them."""
        for scan, T_map_base in scans:
            self._integrate(scan, T_map_base, cautious=False)
        rows, cols = self.grid.geometry.shape
        self.surfaces.refresh(self.grid, CellBox(0, 0, rows, cols))

    def seal(self) -> None:
        """Let go of what only inserting needs, and of cells nobody saw: more than half of it all.

        Scans can still be matched, to the same result; none can be inserted any more.
        """
        self.surfaces.seal(self.grid.crop(self.surfaces.settings.reach))

    @property
    def _depth(self) -> float:
        """How far behind its surface an end point's cell lies [m]."""
        return self.settings.integration.depth * self.settings.resolution

    def _integrate(self, scan: LaserScan, T_map_base: Pose2, cautious: bool) -> CellBox:
        """Fuse a scan into the grid and its end points into the walls, which are not fitted yet."""
        self.grow(*scan_extent(scan, T_map_base, self._depth))
        keep_above = self.settings.surface.occupied_above if cautious else np.inf
        points_map = turned_points(scan_points(scan), T_map_base)
        box = integrate_scan(
            self.grid, scan, T_map_base, self.settings.integration, keep_above, points_map
        )
        self.surfaces.take(self.grid.geometry, points_map, self._depth)
        self.scans += 1
        return box

    def match(
        self,
        scan: LaserScan,
        T_map_base_guess: Pose2,
        prior_covariance: Floats,
        window: SearchWindow | None = None,
        T_map_prior: Pose2 | None = None,
    ) -> MatchResult:
        """Return the most likely pose of a scan; see `scan_matching.matches`."""
        return matches(
            self.grid,
            self.surfaces,
            scan_points(scan),
            T_map_base_guess,
            prior_covariance,
            self.settings.matching,
            window,
            (scan.T_base_laser.x, scan.T_base_laser.y),
            T_map_prior,
        )[0]

    def posterior_density(
        self,
        scan: LaserScan,
        poses_map: npt.ArrayLike,
        T_map_base_guess: Pose2,
        prior_covariance: Floats,
    ) -> Floats:
        """Return the log posterior at each of `poses_map` (N, 3), up to a constant, (N,)."""
        return posterior_density(
            self.grid,
            self.surfaces,
            scan_points(scan),
            np.asarray(poses_map, dtype=np.float64),
            T_map_base_guess,
            prior_covariance,
            self.settings.matching,
        )
