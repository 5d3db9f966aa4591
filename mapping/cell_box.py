"""Rectangles of cells of a grid: read `[iy, ix]`, half open, as slices are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

_Boxes = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class CellBox:
    """A rectangle of cells, half open: rows iy0 <= iy < iy1 and columns ix0 <= ix < ix1."""

    iy0: int
    ix0: int
    iy1: int
    ix1: int

    @property
    def empty(self) -> bool:
        """Whether the box holds no cell."""
        return self.iy1 <= self.iy0 or self.ix1 <= self.ix0

    def union(self, other: CellBox) -> CellBox:
        """Return the smallest box around both; an empty box adds nothing."""
        if self.empty:
            return other
        if other.empty:
            return self
        return CellBox(
            min(self.iy0, other.iy0),
            min(self.ix0, other.ix0),
            max(self.iy1, other.iy1),
            max(self.ix1, other.ix1),
        )

    def intersection(self, other: CellBox) -> CellBox:
        """Return the cells that both boxes hold; an empty box if there are none."""
        return CellBox(
            max(self.iy0, other.iy0),
            max(self.ix0, other.ix0),
            min(self.iy1, other.iy1),
            min(self.ix1, other.ix1),
        )

    def overlaps(self, other: CellBox) -> bool:
        """Whether the boxes have a cell in common."""
        return not self.intersection(other).empty

    def shifted(self, rows: int, cols: int) -> CellBox:
        """Return the box moved by whole cells."""
        return CellBox(self.iy0 + rows, self.ix0 + cols, self.iy1 + rows, self.ix1 + cols)

    def clipped(self, shape: tuple[int, int]) -> CellBox:
        """Return the part that lies in a grid of `shape`; or an empty box."""
        rows, cols = shape
        return CellBox(
            min(max(self.iy0, 0), rows),
            min(max(self.ix0, 0), cols),
            min(max(self.iy1, 0), rows),
            min(max(self.ix1, 0), cols),
        )

    def dilated(self, cells: int, shape: tuple[int, int]) -> CellBox:
        """Return the box grown by `cells` on every side, clipped to a grid of `shape`.

        An empty box stays empty.
        """
        if self.empty:
            return self.clipped(shape)
        grown = CellBox(self.iy0 - cells, self.ix0 - cells, self.iy1 + cells, self.ix1 + cells)
        return grown.clipped(shape)

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, cols); negative or 0 for a box that holds no cell."""
        return self.iy1 - self.iy0, self.ix1 - self.ix0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Return the index that cuts this box out of a grid: `array[box.slices]`."""
        return slice(self.iy0, self.iy1), slice(self.ix0, self.ix1)


EMPTY_BOX = CellBox(0, 0, 0, 0)


def box_of(cells: npt.NDArray[np.generic]) -> CellBox:
    """Return the smallest box around the cells (rows, cols) that are not 0 or False."""
    rows = np.flatnonzero(cells.any(axis=1))
    if len(rows) == 0:
        return EMPTY_BOX
    cols = np.flatnonzero(cells.any(axis=0))
    return CellBox(int(rows[0]), int(cols[0]), int(rows[-1]) + 1, int(cols[-1]) + 1)


def around_both(boxes: _Boxes, others: _Boxes) -> _Boxes:
    """Return the smallest boxes (N, 4), each around one of `boxes` and its one of `others`.

    All half open (iy0, ix0, iy1, ix1), (N, 4) int64.
    """
    low, high = np.minimum(boxes[:, :2], others[:, :2]), np.maximum(boxes[:, 2:], others[:, 2:])
    return np.concatenate((low, high), axis=1)
