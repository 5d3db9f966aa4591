"""The map as the collection of all scans with their corrected poses.

"The collection of all scans, along with their corrected scan coordinates, forms the map. The scan
map is then efficiently converted to an occupancy grid map." The grid is drawn when it is asked for,
and drawn again from the first scan on whose pose was corrected.

What is drawn depends on the scans, their numbers and their poses alone: not on the order in which
they came, on when the grid was asked for, or on how it grew, to the last bit.

Source: Simmons et al. 2000, section "Coordinated Mapping"; grids after Elfes 1989.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.geometry import Pose2
from mapping.grid import OccupancyGrid
from mapping.lattice_grid import LatticeGrid, changed_box, lattice_box, lattice_geometry
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings, integrate_scan, scan_extent

# A scan changes cells at most so far around what its beams touch, over and above the depth at which
# they end; with a cell to spare.
_MARGIN = 2


@dataclass(slots=True)
class _Held:
    """A scan, where it was taken as told with it and as known now, and the cells it may change."""

    scan: LaserScan
    observed: Pose2
    T_map_base: Pose2
    window: CellBox  # lattice; empty where it would reach off the map


class ScanMap:
    """Scans by number with their poses, and the occupancy grid drawn from them in that order.

    Attributes:
        integration: how strongly one scan speaks in the grid.
        cells: what is drawn so far; up to date after `draw`. It never shrinks.
        drawn: how many scans were drawn, counting those drawn again.
    """

    __slots__ = (
        "_bounds", "_corrected", "_done", "_held", "_numbers", "_snapshot_every", "_snapshots",
        "_valid", "cells", "drawn", "integration",
    )  # fmt: skip

    def __init__(
        self,
        resolution: float = 0.05,
        integration: IntegrationSettings | None = None,
        bounds: CellBox | None = None,
        snapshot_every: int = 100,
    ) -> None:
        """Begin without any scan.

        Args:
            resolution: edge of a cell [m].
            integration: how strongly one scan speaks; the defaults if not given.
            bounds: scans that reach beyond are not drawn, lattice. None: no bounds.
            snapshot_every: the grid is kept after about every so many scans, for drawing again.
        """
        self.integration = integration or IntegrationSettings()
        self.cells = LatticeGrid(resolution)
        self.drawn = 0
        self._bounds = bounds
        self._snapshot_every = snapshot_every
        self._held: dict[int, _Held] = {}
        self._numbers: list[int] = []  # ascending
        self._corrected: dict[int, Pose2] = {}
        self._done = 0  # so many scans, in the order of their numbers, are drawn in `cells` ...
        self._valid = 0  # ... and the first so many of them are the first ones still, unmoved
        self._snapshots: list[tuple[int, LatticeGrid]] = []  # by how many scans are drawn in it

    def __len__(self) -> int:
        """How many scans there are, those not counted that reach off the map."""
        return sum(1 for _ in self.placed())

    def placed(self) -> Iterator[tuple[int, LaserScan, Pose2]]:
        """Yield number, scan and `T_map_base` of each scan on the map, in the order of numbers."""
        for number in self._numbers:
            held = self._held[number]
            if not held.window.empty:
                yield number, held.scan, held.T_map_base

    def observe(self, number: int, scan: LaserScan, T_map_base: Pose2) -> bool:
        """Take in a scan; one with a number that is known already changes nothing.

        Args:
            number: its place in the order in which scans are drawn.
            scan: what was seen.
            T_map_base: where, map frame, unless `place` told otherwise.

        Returns:
            Whether it lies on the map. If not, it is not drawn unless `place` moves it there.
        """
        held = self._held.get(number)
        if held is None:
            placed = self._corrected.get(number, T_map_base)
            held = _Held(scan, T_map_base, placed, self._window(scan, placed))
            self._held[number] = held
            order = bisect.bisect_left(self._numbers, number)
            self._numbers.insert(order, number)
            self._valid = min(self._valid, order)
        return not held.window.empty

    def place(self, poses: Mapping[int, Pose2]) -> list[int]:
        """Move scans: number -> `T_map_base`, in place of all that was told by this before.

        A scan that is not named lies where it was observed. A number that is not known yet waits
        for its scan, so that it does not matter which of both comes first.

        Returns:
            The numbers of the scans named that are not drawn, for they would reach off the map.
        """
        self._corrected = dict(poses)
        refused = []
        for order, number in enumerate(self._numbers):
            held = self._held[number]
            T_map_base = poses.get(number, held.observed)
            if held.T_map_base != T_map_base:
                window = self._window(held.scan, T_map_base)
                if not (window.empty and held.window.empty):
                    self._valid = min(self._valid, order)
                held.T_map_base, held.window = T_map_base, window
            if held.window.empty and number in poses:
                refused.append(number)
        return refused

    def draw(self) -> CellBox:
        """Draw what is not drawn yet into `cells`; return the box that changed, lattice."""
        before = self._step_back() if self._valid < self._done else None
        changed = EMPTY_BOX
        for number in self._numbers[self._done :]:
            held = self._held[number]
            if not held.window.empty:
                self._integrate(held)
                changed = changed.union(held.window)
            self._done += 1
            if self._done % self._snapshot_every == 0:
                self._keep_snapshot()
        self._valid = self._done
        return changed if before is None else changed_box(before, self.cells)

    def grid(self) -> OccupancyGrid:
        """Return the up-to-date occupancy grid, map frame.

        It belongs to the scan map: copy what must not change.
        """
        self.draw()
        return self.cells.occupancy()

    def _window(self, scan: LaserScan, T_map_base: Pose2) -> CellBox:
        """Return the box around all cells that a scan may change; empty if it reaches off."""
        if not all(math.isfinite(value) for value in T_map_base.as_tuple()):
            return EMPTY_BOX
        resolution = self.cells.resolution
        extent = scan_extent(scan, T_map_base, self.integration.depth * resolution)
        window = lattice_box(extent, resolution, _MARGIN)
        if self._bounds is None or window.intersection(self._bounds) == window:
            return window
        return EMPTY_BOX

    def _integrate(self, held: _Held) -> None:
        """Draw one scan.

        It is drawn in a grid of its own, cut out around it: which cell a point falls in must not
        hang, by rounding, on where the whole grid begins.
        """
        self.cells.grow(held.window, self._bounds)
        part = self.cells.part(held.window)
        geometry = lattice_geometry(held.window, self.cells.resolution)
        cut = OccupancyGrid(geometry, np.ascontiguousarray(part))
        integrate_scan(cut, held.scan, held.T_map_base, self.integration)
        part[:] = cut.log_odds
        self.drawn += 1

    def _step_back(self) -> LatticeGrid:
        """Go back to the last snapshot that still holds; return the cells as they were."""
        before = self.cells
        while self._snapshots and self._snapshots[-1][0] > self._valid:
            self._snapshots.pop()
        resolution = before.resolution
        self._done, kept = self._snapshots[-1] if self._snapshots else (0, LatticeGrid(resolution))
        blank = np.zeros(before.box.shape, dtype=np.float32)
        self.cells = LatticeGrid(resolution, before.box, blank)
        self.cells.part(kept.box)[:] = kept.log_odds
        return before

    def _keep_snapshot(self) -> None:
        """Keep the cells as they are, and of the older snapshots the fewer the older they are.

        Of n about log2(n) stay, at distances that double: never much more than three times as many
        scans are drawn again as have to be.
        """
        latest = self._done // self._snapshot_every
        self._snapshots = [
            (count, cells)
            for count, cells in self._snapshots
            if latest - (k := count // self._snapshot_every) <= 2 * (k & -k)
        ]
        self._snapshots.append((self._done, self.cells.known()))
