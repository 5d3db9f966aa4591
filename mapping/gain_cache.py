"""Information gains that are worked out again only where the map changed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from mapping.coarse_gain import START_CELLS, CoarseClasses, coarse_information_gains
from mapping.grid import CellBox, Cells
from mapping.information_gain import Gains


class GainCache:
    """Keeps the gains of frontier cells from one map update to the next.

    A flood depends on the cells it covered and on those beside them, on nothing else. So a gain
    stays right until something changes in its box or one block around, or where the flood starts;
    the rest of the circle of the sensor's range does not matter.
    """

    def __init__(self, range_cells: float) -> None:
        """Take the sensor's range in fine cells."""
        self._range_cells = range_cells
        self._cells: Cells = np.empty((0, 2), dtype=np.int64)
        self._gains = np.empty(0)
        self._boxes: Cells = np.empty((0, 4), dtype=np.int64)
        self.evaluated = 0  # floods run in the last call

    def forget(self) -> None:
        """Drop everything kept; needed when the grid has grown and cells were renumbered."""
        self._cells, self._gains, self._boxes = self._cells[:0], self._gains[:0], self._boxes[:0]

    def gains(
        self, coarse: CoarseClasses, frontier_cells: npt.ArrayLike, changed: Sequence[CellBox]
    ) -> Gains:
        """Return gains and boxes as `coarse_information_gains` would, bit by bit.

        Args:
            coarse: the classes now, always of the same factor.
            frontier_cells: (N, 2), fine cells. What is kept of other cells is dropped.
            changed: boxes of fine cells that hold every change of classes or weights since the
                last call.
        """
        cells = np.asarray(frontier_cells, dtype=np.int64).reshape(-1, 2)
        kept = self._still_right(changed, coarse.factor)
        known = _rows_of(cells, self._cells, kept)
        have, lack = known >= 0, known < 0
        gains, boxes = np.empty(len(cells)), np.empty((len(cells), 4), dtype=np.int64)
        gains[have], boxes[have] = self._gains[known[have]], self._boxes[known[have]]
        gains[lack], boxes[lack] = coarse_information_gains(coarse, cells[lack], self._range_cells)
        self.evaluated = int(lack.sum())
        self._cells, self._gains, self._boxes = cells, gains, boxes
        return gains.copy(), boxes.copy()

    def _still_right(self, changed: Sequence[CellBox], factor: int) -> npt.NDArray[np.int64]:
        """Return the rows of what is kept that no change has touched."""
        start = START_CELLS + factor
        low = np.minimum(self._boxes[:, :2] - factor, self._cells - start)
        high = np.maximum(self._boxes[:, 2:] + factor, self._cells + 1 + start)
        right = np.ones(len(self._cells), dtype=np.bool_)
        for box in changed:
            apart = (low[:, 0] >= box.iy1) | (high[:, 0] <= box.iy0)
            right &= apart | (low[:, 1] >= box.ix1) | (high[:, 1] <= box.ix0)
        return np.flatnonzero(right)


def _rows_of(cells: Cells, among: Cells, rows: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return for each of `cells` (N, 2) the one of `rows` in which `among` holds it, else -1."""
    if not len(rows):
        return np.full(len(cells), -1, dtype=np.int64)
    keys = among[rows, 0] << 32 | among[rows, 1]
    order = np.argsort(keys, kind="stable")
    wanted = cells[:, 0] << 32 | cells[:, 1]
    at = np.minimum(np.searchsorted(keys, wanted, sorter=order), len(rows) - 1)
    found = rows[order[at]]
    return np.where((among[found] == cells).all(axis=1), found, -1)
