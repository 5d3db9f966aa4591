"""The map as the collection of all scans with their corrected poses.

"The collection of all scans, along with their corrected scan coordinates, forms the map. The scan
map is then efficiently converted to an occupancy grid map." Grids are drawn from it and can be
drawn again whenever poses are corrected.

Source: Simmons et al. 2000, section "Coordinated Mapping"; grids after Elfes 1989.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mapping.geometry import Pose2
from mapping.grid import EMPTY_BOX, CellBox, GridGeometry, OccupancyGrid
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings, integrate_scan, scan_extent


@dataclass(frozen=True, slots=True)
class PlacedScan:
    """One scan and where it was taken.

    Attributes:
        robot: name of the robot that took it.
        scan: the ranges.
        T_map_base: corrected pose of the robot, map frame.
    """

    robot: str
    scan: LaserScan
    T_map_base: Pose2


class ScanMap:
    """All scans of a team with their poses, and the occupancy grid drawn from them.

    Attributes:
        integration: how strongly one scan speaks in the grid.
        placed: the scans in the order they came; their index is their name.
        redrawn: how often the grid was drawn anew from all scans.
    """

    __slots__ = ("_drawn", "_grid", "_resolution", "integration", "placed", "redrawn")

    def __init__(
        self, resolution: float = 0.05, integration: IntegrationSettings | None = None
    ) -> None:
        self.integration = integration or IntegrationSettings()
        self.placed: list[PlacedScan] = []
        self.redrawn = 0
        self._resolution = resolution
        self._drawn = 0
        self._grid = self._blank()

    def __len__(self) -> int:
        return len(self.placed)

    def add(self, robot: str, scan: LaserScan, T_map_base: Pose2) -> int:
        """Add a scan; return its index."""
        self.placed.append(PlacedScan(robot, scan, T_map_base))
        return len(self.placed) - 1

    def correct(self, poses: Mapping[int, Pose2]) -> None:
        """Move scans: index -> `T_map_base`. The grid is drawn anew when next asked for.

        Raises:
            IndexError: there is no such scan.
        """
        for index, T_map_base in poses.items():
            old = self.placed[index]
            self.placed[index] = PlacedScan(old.robot, old.scan, T_map_base)
            if index < self._drawn:
                self._drawn = 0
                self._grid = self._blank()
                self.redrawn += 1

    def of_robot(self, robot: str) -> list[int]:
        """Return the indices of the scans that `robot` took, in order."""
        return [index for index, placed in enumerate(self.placed) if placed.robot == robot]

    def grid(self) -> tuple[OccupancyGrid, CellBox]:
        """Return the up-to-date occupancy grid and the box of cells that changed since last asked.

        Only scans not drawn yet are fused, unless poses were corrected. The grid belongs to the
        scan map: copy what must not change.
        """
        changed = EMPTY_BOX
        depth = self.integration.depth * self._grid.geometry.resolution
        for placed in self.placed[self._drawn :]:
            extent = scan_extent(placed.scan, placed.T_map_base, depth)
            padding = self._grid.grow(*extent)
            box = integrate_scan(self._grid, placed.scan, placed.T_map_base, self.integration)
            if not changed.empty:
                changed = changed.shifted(padding.below, padding.left)
            changed = changed.union(box)
        self._drawn = len(self.placed)
        return self._grid, changed

    def _blank(self) -> OccupancyGrid:
        """Return a grid of one unknown cell; it grows as scans are drawn."""
        return OccupancyGrid.unknown(GridGeometry(self._resolution, 0.0, 0.0, 1, 1))
