"""Information gains that are worked out again only where the map changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.geometry import Floats
from mapping.grid import Cells
from mapping.information_gain import Gains

# From places (N, 2) to their gains (N,), boxes (N, 4) and boxes of all cells these depend on.
Estimate = Callable[[Cells], tuple[Floats, Cells, Cells]]


class GainCache:
    """Keeps the gains of frontier cells from one map update to the next.

    A gain depends on the cells that were looked at to find it, on nothing else: it stays right
    until something changes there.
    """

    def __init__(self, estimate: Estimate) -> None:
        """Take what works out the gains of places on the map as it is when it is called."""
        self._estimate = estimate
        self._cells: Cells = np.empty((0, 2), dtype=np.int64)
        self._gains = np.empty(0)
        self._boxes: Cells = np.empty((0, 4), dtype=np.int64)
        self._depends: Cells = np.empty((0, 4), dtype=np.int64)
        self.evaluated = 0  # gains worked out in the last call

    def forget(self) -> None:
        """Drop everything kept; needed when the grid has grown and cells were renumbered."""
        self._cells, self._gains = self._cells[:0], self._gains[:0]
        self._boxes, self._depends = self._boxes[:0], self._depends[:0]

    def gains(self, frontier_cells: npt.ArrayLike, changed: Sequence[CellBox]) -> Gains:
        """Return gains and boxes as the estimate would, bit by bit.

        Args:
            frontier_cells: (N, 2), fine cells. What is kept of other cells is dropped.
            changed: boxes of fine cells that hold every change of the map since the last call.
        """
        cells = np.asarray(frontier_cells, dtype=np.int64).reshape(-1, 2)
        known = _rows_of(cells, self._cells, self._still_right(changed))
        have, lack = known >= 0, known < 0
        gains = np.empty(len(cells))
        boxes, depends = np.empty((len(cells), 4), np.int64), np.empty((len(cells), 4), np.int64)
        rows = known[have]
        gains[have], boxes[have] = self._gains[rows], self._boxes[rows]
        depends[have] = self._depends[rows]
        gains[lack], boxes[lack], depends[lack] = self._estimate(cells[lack])
        self.evaluated = int(lack.sum())
        self._cells, self._gains, self._boxes, self._depends = cells, gains, boxes, depends
        return gains.copy(), boxes.copy()

    def _still_right(self, changed: Sequence[CellBox]) -> npt.NDArray[np.int64]:
        """Return the rows of what is kept that no change has touched."""
        on = self._depends
        right = np.ones(len(self._cells), dtype=np.bool_)
        for box in changed:
            apart = (on[:, 0] >= box.iy1) | (on[:, 2] <= box.iy0)
            right &= apart | (on[:, 1] >= box.ix1) | (on[:, 3] <= box.ix0)
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
