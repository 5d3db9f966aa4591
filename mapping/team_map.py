"""The map that each member of a team draws of what the team observed.

"All information is retained, but instead of actually drawing the scan into the grid, pose and scan
are stored"; the grid is rendered when it is needed. Members that hold the same observations at the
same poses have the same map to the last bit, whatever the order in which these came.

Source: Pfingsthorn et al. 2007, section 2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.geometry import Pose2
from mapping.grid import OccupancyGrid
from mapping.lattice_grid import LatticeGrid
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings
from mapping.scan_map import ScanMap


class Ordered(Protocol):
    """What the name of an author must be: it has a place in an order, and a hash."""

    def __lt__(self, other: Any, /) -> bool: ...

    def __hash__(self) -> int: ...


Author = TypeVar("Author", bound=Ordered)


@dataclass(frozen=True, slots=True)
class PlacedScan(Generic[Author]):
    """One scan and where it was taken.

    Attributes:
        author: who took it.
        number: which of the author's scans it is.
        scan: the ranges.
        T_map_base: pose of the robot as known now, map frame.
    """

    author: Author
    number: int
    scan: LaserScan
    T_map_base: Pose2


class TeamMap(Generic[Author]):
    """A layer per author, drawn from its scans in the order of their numbers, and their sum.

    The sum is taken cell by cell in the order of the sorted authors, and kept within the limits of
    the log-odds. So a pose that changes, or a scan that comes late, has one layer drawn again and
    leaves the others alone.

    Attributes:
        resolution: edge of a cell [m].
        integration: how strongly one scan speaks in the grid.
        bounds: the cells the map may have at most, lattice.
        layers: by author, in the order in which these were heard of first.
    """

    __slots__ = (
        "_changed", "_snapshot_every", "_sum", "bounds", "integration", "layers", "resolution",
    )  # fmt: skip

    def __init__(
        self,
        resolution: float = 0.05,
        integration: IntegrationSettings | None = None,
        largest_cells: int = 25_000_000,
        snapshot_every: int = 100,
    ) -> None:
        """Begin without any scan.

        Args:
            resolution: edge of a cell [m].
            integration: how strongly one scan speaks; the defaults if not given.
            largest_cells: the map may reach to the edges of a square of so many cells around the
                map frame's origin. A scan that reaches beyond is refused: by itself, not for what
                others saw before, so that all members refuse the same scans.
            snapshot_every: see `ScanMap`.
        """
        half = math.isqrt(largest_cells) // 2
        self.resolution = resolution
        self.integration = integration or IntegrationSettings()
        self.bounds = CellBox(-half, -half, half, half)
        self.layers: dict[Author, ScanMap] = {}
        self._snapshot_every = snapshot_every
        self._sum = LatticeGrid(resolution)
        self._changed = EMPTY_BOX  # since `take_changes`, lattice

    def __len__(self) -> int:
        """How many scans there are, those not counted that were refused."""
        return sum(len(layer) for layer in self.layers.values())

    def observe(self, author: Author, number: int, scan: LaserScan, T_map_base: Pose2) -> bool:
        """Take in a scan; one with a number that is known already changes nothing.

        Args:
            author: who took it.
            number: which of the author's scans it is.
            scan: what was seen.
            T_map_base: where, map frame, unless `place` told otherwise.

        Returns:
            Whether it lies on the map; it is refused otherwise, see `largest_cells`, until `place`
            moves it there.
        """
        return self._layer(author).observe(number, scan, T_map_base)

    def place(self, author: Author, poses: Mapping[int, Pose2]) -> list[int]:
        """Move an author's scans, in place of all that was told by this of that author before.

        Args:
            author: whose scans.
            poses: number -> `T_map_base`. A scan that is not named lies where it was observed; a
                number that is not known yet waits for its scan.

        Returns:
            The numbers of the scans that were refused, see `observe`.
        """
        return self._layer(author).place(poses)

    def forget(self, author: Author) -> None:
        """Take all scans of an author out of the map."""
        layer = self.layers.pop(author, None)
        if layer is None:
            return
        box = layer.cells.box.intersection(self._sum.box)
        self._add_up(box)
        self._changed = self._changed.union(box)

    def placed(self) -> Iterator[PlacedScan[Author]]:
        """Yield all scans on the map, by author and number."""
        for author in sorted(self.layers):
            for number, scan, T_map_base in self.layers[author].placed():
                yield PlacedScan(author, number, scan, T_map_base)

    def grid(self) -> OccupancyGrid:
        """Return the up-to-date grid of the team, map frame; it grows, and never shrinks.

        Only what changed since last asked is drawn. The grid belongs to the team map: copy what
        must not change.
        """
        changes = [layer.draw() for layer in self.layers.values()]
        for layer in self.layers.values():
            self._sum.grow(layer.cells.box, self.bounds)
        for box in changes:
            self._add_up(box)
            self._changed = self._changed.union(box)
        return self._sum.occupancy()

    def take_changes(self) -> CellBox:
        """Return the box of cells of the grid as it is now that changed since the last call."""
        self.grid()
        changed, self._changed = self._changed, EMPTY_BOX
        if changed.empty:
            return EMPTY_BOX
        return changed.shifted(-self._sum.box.iy0, -self._sum.box.ix0)

    def _layer(self, author: Author) -> ScanMap:
        """Return an author's layer, a new one at first."""
        layer = self.layers.get(author)
        if layer is None:
            layer = ScanMap(self.resolution, self.integration, self.bounds, self._snapshot_every)
            self.layers[author] = layer
        return layer

    def _add_up(self, box: CellBox) -> None:
        """Add the layers up in a box of the lattice, in a fixed order: rounding hangs on it."""
        if box.empty:
            return
        total = self._sum.part(box)
        total[:] = 0.0
        for author in sorted(self.layers):
            cells = self.layers[author].cells
            common = box.intersection(cells.box)
            if not common.empty:
                self._sum.part(common)[:] += cells.part(common)
        lowest, highest = self.integration.lowest, self.integration.highest
        np.clip(total, np.float32(lowest), np.float32(highest), out=total)
