"""Grids: where cells are, and the occupancy grid that holds what is known of them.

A grid has shape (rows, cols), is read `[iy, ix]` in C order, cell (0, 0) lies at the origin corner
and +x runs along the columns, so its flat order equals nav_msgs/OccupancyGrid. Points are (x, y)
float (N, 2) [m]; cells are (iy, ix) int (N, 2). Only `GridGeometry` converts between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox, box_of
from mapping.geometry import Floats

_Scalar = TypeVar("_Scalar", bound=np.generic)
Cells = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Padding:
    """Rows and columns added on each side when a grid grows."""

    below: int
    above: int
    left: int
    right: int

    @property
    def none(self) -> bool:
        """Whether nothing is added."""
        return self.below == self.above == self.left == self.right == 0

    def pad(self, array: npt.NDArray[_Scalar], fill: float) -> npt.NDArray[_Scalar]:
        """Return `array` (..., rows, cols) grown by this padding, new cells set to `fill`."""
        *layers, rows, cols = array.shape
        shape = (*layers, rows + self.below + self.above, cols + self.left + self.right)
        grown = np.empty(shape, array.dtype)
        top, right = self.below + rows, self.left + cols
        grown[..., self.below : top, self.left : right] = array
        # Only around it: to fill all first would write most of a large map twice.
        grown[..., : self.below, :] = fill
        grown[..., top:, :] = fill
        grown[..., self.below : top, : self.left] = fill
        grown[..., self.below : top, right:] = fill
        return grown


NO_PADDING = Padding(0, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class GridGeometry:
    """Where a grid lies in its frame.

    Attributes:
        resolution: edge of a cell [m].
        origin_x: x of the corner of cell (0, 0) [m], in the grid's frame.
        origin_y: y of that corner [m].
        rows: number of cells along +y.
        cols: number of cells along +x.
    """

    resolution: float
    origin_x: float
    origin_y: float
    rows: int
    cols: int

    @property
    def lattice(self) -> tuple[int, int]:
        """Row and column of cell (0, 0) on the lattice of cells through the frame's origin."""
        return round(self.origin_y / self.resolution), round(self.origin_x / self.resolution)

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, cols)."""
        return self.rows, self.cols

    @property
    def box(self) -> CellBox:
        """The box of all cells."""
        return CellBox(0, 0, self.rows, self.cols)

    def cells_at(self, points: npt.ArrayLike) -> Cells:
        """Return the cells (N, 2) as (iy, ix) that hold `points` (N, 2) [m]; may lie outside."""
        p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        cells = np.empty(p.shape, dtype=np.int64)
        cells[:, 0] = np.floor((p[:, 1] - self.origin_y) / self.resolution)
        cells[:, 1] = np.floor((p[:, 0] - self.origin_x) / self.resolution)
        return cells

    def cell_at(self, x: float, y: float) -> tuple[int, int]:
        """Return (iy, ix) of the cell that holds the point (x, y) [m]; may lie outside."""
        return (
            math.floor((y - self.origin_y) / self.resolution),
            math.floor((x - self.origin_x) / self.resolution),
        )

    def centres_of(self, cells: npt.ArrayLike) -> Floats:
        """Return the centres (N, 2) as (x, y) [m] of `cells` (N, 2) as (iy, ix)."""
        c = np.asarray(cells, dtype=np.float64).reshape(-1, 2)
        return np.column_stack(
            (
                self.origin_x + (c[:, 1] + 0.5) * self.resolution,
                self.origin_y + (c[:, 0] + 0.5) * self.resolution,
            )
        )

    def centre_of(self, iy: int, ix: int) -> tuple[float, float]:
        """Return the centre (x, y) [m] of one cell."""
        return (
            self.origin_x + (ix + 0.5) * self.resolution,
            self.origin_y + (iy + 0.5) * self.resolution,
        )

    def contains(self, cells: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return for each of `cells` (N, 2) whether it lies in the grid."""
        c = np.asarray(cells).reshape(-1, 2)
        inside: npt.NDArray[np.bool_] = (
            (c[:, 0] >= 0) & (c[:, 0] < self.rows) & (c[:, 1] >= 0) & (c[:, 1] < self.cols)
        )
        return inside

    def holds(self, iy: int, ix: int) -> bool:
        """Whether the cell lies in the grid."""
        return 0 <= iy < self.rows and 0 <= ix < self.cols

    def box_around(self, x_min: float, y_min: float, x_max: float, y_max: float) -> CellBox:
        """Return the box of cells that touch a rectangle [m], clipped to the grid.

        A rectangle beyond the grid gives an empty box, whose `slices` cut out nothing.
        """
        iy0, ix0 = self.cell_at(x_min, y_min)
        iy1, ix1 = self.cell_at(x_max, y_max)
        return CellBox(iy0, ix0, iy1 + 1, ix1 + 1).clipped(self.shape)

    def grown(
        self, x_min: float, y_min: float, x_max: float, y_max: float, chunk: int = 128
    ) -> tuple[GridGeometry, Padding]:
        """Return a geometry that also covers a rectangle [m], and the padding that leads to it.

        Grids grow by whole chunks of cells, so that growing is rare.
        """
        iy0, ix0 = self.cell_at(x_min, y_min)
        iy1, ix1 = self.cell_at(x_max, y_max)
        padding = Padding(
            below=_chunks(-iy0, chunk),
            above=_chunks(iy1 + 1 - self.rows, chunk),
            left=_chunks(-ix0, chunk),
            right=_chunks(ix1 + 1 - self.cols, chunk),
        )
        if padding.none:
            return self, padding
        return self.padded(padding), padding

    def padded(self, padding: Padding) -> GridGeometry:
        """Return the geometry after growing by `padding`."""
        return GridGeometry(
            self.resolution,
            self.origin_x - padding.left * self.resolution,
            self.origin_y - padding.below * self.resolution,
            self.rows + padding.below + padding.above,
            self.cols + padding.left + padding.right,
        )

    def cropped(self, box: CellBox) -> GridGeometry:
        """Return the geometry of the cells of a box of this one."""
        return GridGeometry(
            self.resolution,
            self.origin_x + box.ix0 * self.resolution,
            self.origin_y + box.iy0 * self.resolution,
            box.iy1 - box.iy0,
            box.ix1 - box.ix0,
        )

    def padding_to(self, larger: GridGeometry) -> Padding:
        """Return the padding that makes this geometry into `larger`.

        Raises:
            ValueError: the two do not share one lattice, or `larger` does not cover this one.
        """
        left = round((self.origin_x - larger.origin_x) / self.resolution)
        below = round((self.origin_y - larger.origin_y) / self.resolution)
        above = larger.rows - self.rows - below
        right = larger.cols - self.cols - left
        aligned = (
            abs(self.origin_x - left * self.resolution - larger.origin_x) < 0.01 * self.resolution
            and abs(self.origin_y - below * self.resolution - larger.origin_y)
            < 0.01 * self.resolution
            and abs(self.resolution - larger.resolution) < 1e-9
        )
        if not aligned or min(left, below, above, right) < 0:
            raise ValueError("the larger grid does not contain the smaller one cell by cell")
        return Padding(below, above, left, right)


def _chunks(cells: int, chunk: int) -> int:
    """Return the least multiple of `chunk` that is at least `cells`, and not negative."""
    return 0 if cells <= 0 else -(-cells // chunk) * chunk


def geometry_around(
    x_min: float, y_min: float, x_max: float, y_max: float, resolution: float
) -> GridGeometry:
    """Return the smallest geometry over a rectangle [m] whose corners lie on the cell lattice."""
    ix0, iy0 = math.floor(x_min / resolution), math.floor(y_min / resolution)
    ix1, iy1 = math.ceil(x_max / resolution), math.ceil(y_max / resolution)
    return GridGeometry(
        resolution, ix0 * resolution, iy0 * resolution, max(iy1 - iy0, 1), max(ix1 - ix0, 1)
    )


@dataclass(slots=True)
class OccupancyGrid:
    """What is known of each cell, as the log-odds that it is occupied.

    Attributes:
        geometry: where the cells are.
        log_odds: (rows, cols) float32; 0.0 means unknown, positive occupied, negative clear.
    """

    geometry: GridGeometry
    log_odds: npt.NDArray[np.float32]

    @classmethod
    def unknown(cls, geometry: GridGeometry) -> OccupancyGrid:
        """Return a grid of which nothing is known."""
        return cls(geometry, np.zeros(geometry.shape, dtype=np.float32))

    def grow(self, x_min: float, y_min: float, x_max: float, y_max: float) -> Padding:
        """Grow, in place, to cover a rectangle [m]; return by how much."""
        geometry, padding = self.geometry.grown(x_min, y_min, x_max, y_max)
        if not padding.none:
            self.log_odds = padding.pad(self.log_odds, 0.0)
            self.geometry = geometry
        return padding

    def crop(self, margin: int) -> CellBox:
        """Let go, in place, of all around what is known; return the box of cells that stay.

        Args:
            margin: so many cells around what is known stay, too.
        """
        box = box_of(self.log_odds)
        if box.empty:
            return self.geometry.box
        box = box.dilated(margin, self.geometry.shape)
        self.log_odds = self.log_odds[box.slices].copy()
        self.geometry = self.geometry.cropped(box)
        return box

    def probability(self) -> npt.NDArray[np.float32]:
        """Return the probability of occupancy of each cell, (rows, cols) float32."""
        result: npt.NDArray[np.float32] = (1.0 / (1.0 + np.exp(-self.log_odds))).astype(np.float32)
        return result


# Cell classes of Simmons et al. 2000 (section "Constructing Bids").
UNKNOWN = 0
CLEAR = 1
OBSTACLE = 2


def classify(
    log_odds: npt.NDArray[np.float32], p_obstacle: float, p_clear: float
) -> npt.NDArray[np.uint8]:
    """Return the class of each cell: OBSTACLE above p_o, CLEAR below p_c, else UNKNOWN.

    Args:
        log_odds: any shape.
        p_obstacle: threshold p_o on the probability of occupancy, in (0.5, 1).
        p_clear: threshold p_c, in (0, 0.5).

    Source: Simmons et al. 2000, section "Constructing Bids".
    """
    high = math.log(p_obstacle / (1.0 - p_obstacle))
    low = math.log(p_clear / (1.0 - p_clear))
    classes = np.zeros(log_odds.shape, dtype=np.uint8)
    classes[log_odds < low] = CLEAR
    classes[log_odds > high] = OBSTACLE
    return classes
