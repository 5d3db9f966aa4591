"""A grid that grows on the lattice of cells through (0, 0): its boxes stay valid as it grows.

A cell of the lattice is named by whole numbers (iy, ix) alone; its corner lies at
(ix, iy) * resolution in the map frame. So two grids that grew in different ways agree on which cell
is which, without any rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from mapping.cell_box import EMPTY_BOX, CellBox, box_of
from mapping.grid import GridGeometry, OccupancyGrid, Padding

_CHUNK = 128  # a grid ends at multiples of so many cells, so that growing is rare


@dataclass(slots=True)
class LatticeGrid:
    """Log-odds of the cells of one box of the lattice.

    Attributes:
        resolution: edge of a cell [m].
        box: the cells that are held, lattice.
        log_odds: (rows, cols) float32, of the cells in `box`; 0.0 means unknown.
    """

    resolution: float
    box: CellBox = EMPTY_BOX
    log_odds: npt.NDArray[np.float32] = field(
        default_factory=lambda: np.zeros((0, 0), dtype=np.float32)
    )

    def grow(self, box: CellBox, bounds: CellBox | None = None) -> None:
        """Grow, in place, to hold a box of the lattice.

        Args:
            box: to be held.
            bounds: the grid does not grow beyond; the box lies within. None: no bounds.
        """
        own, needed = self.box, self.box.union(box)
        if needed == own:
            return
        aligned = CellBox(
            needed.iy0 // _CHUNK * _CHUNK,
            needed.ix0 // _CHUNK * _CHUNK,
            -(-needed.iy1 // _CHUNK) * _CHUNK,
            -(-needed.ix1 // _CHUNK) * _CHUNK,
        )
        self.box = aligned if bounds is None else aligned.intersection(bounds)
        if own.empty:
            self.log_odds = np.zeros(self.box.shape, dtype=np.float32)
            return
        self.log_odds = Padding(
            below=own.iy0 - self.box.iy0,
            above=self.box.iy1 - own.iy1,
            left=own.ix0 - self.box.ix0,
            right=self.box.ix1 - own.ix1,
        ).pad(self.log_odds, 0.0)

    def part(self, box: CellBox) -> npt.NDArray[np.float32]:
        """Return the log-odds of a box of the lattice within this grid, as a view."""
        return self.log_odds[box.shifted(-self.box.iy0, -self.box.ix0).slices]

    def known(self) -> LatticeGrid:
        """Return a copy of the part of which anything is known."""
        inner = box_of(self.log_odds)
        box = inner.shifted(self.box.iy0, self.box.ix0)
        return LatticeGrid(self.resolution, box, self.log_odds[inner.slices].copy())

    def occupancy(self) -> OccupancyGrid:
        """Return the same cells as an occupancy grid, map frame; one unknown cell if none is held.

        The cells are shared, not copied.
        """
        if self.box.empty:
            return OccupancyGrid.unknown(lattice_geometry(CellBox(0, 0, 1, 1), self.resolution))
        return OccupancyGrid(lattice_geometry(self.box, self.resolution), self.log_odds)


def lattice_geometry(box: CellBox, resolution: float) -> GridGeometry:
    """Return where a box of the lattice lies, map frame."""
    return GridGeometry(resolution, box.ix0 * resolution, box.iy0 * resolution, *box.shape)


def lattice_box(
    rectangle: tuple[float, float, float, float], resolution: float, margin: int = 0
) -> CellBox:
    """Return the box of lattice cells that touch a rectangle; empty where it is not finite.

    Args:
        rectangle: (x_min, y_min, x_max, y_max) [m], map frame.
        resolution: edge of a cell [m].
        margin: so many cells more on every side.
    """
    if not all(math.isfinite(edge) for edge in rectangle):
        return EMPTY_BOX
    ix0, iy0, ix1, iy1 = (math.floor(edge / resolution) for edge in rectangle)
    return CellBox(iy0 - margin, ix0 - margin, iy1 + 1 + margin, ix1 + 1 + margin)


def changed_box(before: LatticeGrid, after: LatticeGrid) -> CellBox:
    """Return the box of lattice cells that differ; `before` grows to hold what `after` holds.

    Args:
        before: holds no cell that `after` does not hold.
        after: the same grid later.
    """
    before.grow(after.box, after.box)
    differs: npt.NDArray[np.bool_] = before.log_odds != after.log_odds
    return box_of(differs).shifted(after.box.iy0, after.box.ix0)
