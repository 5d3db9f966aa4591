"""Frontiers: clear cells beside unknown ones, where exploring goes on.

Cells count as beside each other across an edge only: across a corner, the unknown inside of a
wall seen from one side would touch the clear floor behind every step in the wall. Cells of one
frontier hang together across edges and corners. What lies off the grid is not unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.compiled import compiled
from mapping.grid import CLEAR, UNKNOWN, Cells


@dataclass(frozen=True, slots=True)
class Frontiers:
    """Places to bid for, grouped by the connected frontier they stand for.

    Attributes:
        cells: (N, 2) int64, frontier cells; the centre-most of each component comes first, then
            others outwards from it.
        component: (N,) int64, which component a cell is of: 0, 1, ... in the grid's order.
        component_size: (N,) int64, how many frontier cells that component has.
    """

    cells: Cells
    component: npt.NDArray[np.int64]
    component_size: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.cells)


def find_frontiers(
    classes: npt.NDArray[np.uint8],
    spacing_cells: int = 6,
    min_cells: int = 4,
    box: CellBox | None = None,
) -> Frontiers:
    """Return representative frontier cells of every connected frontier.

    Cells of one component are kept at least `spacing_cells` apart. Those of different components
    are not: a thin wall may lie between them, and each needs its own visit.

    Args:
        classes: (rows, cols) uint8 of `mapping.grid` classes.
        spacing_cells: least distance between representatives of one component [cells]. The
            default is 0.3 m in cells of 0.05 m, "approximate radius of the robots".
        min_cells: components of fewer cells are taken for noise.
        box: look for frontier cells only here; components end at its edge.

    Source: Simmons et al. 2000, section "Constructing Bids".
    """
    rows, cols = classes.shape
    window = (box or CellBox(0, 0, rows, cols)).clipped((rows, cols))
    if window.empty:
        none = np.empty(0, dtype=np.int64)
        return Frontiers(np.empty((0, 2), dtype=np.int64), none, none)
    marks = _frontier_marks(
        np.ascontiguousarray(classes), window.iy0, window.ix0, window.iy1, window.ix1
    )
    seeds = np.flatnonzero(marks.view(np.bool_))
    chosen, component, size = _representatives(marks, seeds, max(spacing_cells, 1), min_cells)
    iy, ix = np.divmod(chosen, marks.shape[1])
    return Frontiers(np.column_stack((iy + window.iy0 - 1, ix + window.ix0 - 1)), component, size)


@compiled
def _frontier_marks(
    classes: npt.NDArray[np.uint8], iy0: int, ix0: int, iy1: int, ix1: int
) -> npt.NDArray[np.uint8]:
    """Return 1 for each frontier cell of a window and 0 elsewhere.

    The result has one row and column more than the window on each side, all 0, so that walks over
    it need no bounds check. On the grid's edge a clear cell stands in for its missing neighbour.
    """
    rows, cols = classes.shape
    marks = np.zeros((iy1 - iy0 + 2, ix1 - ix0 + 2), dtype=np.uint8)
    inner0, inner1 = max(ix0, 1), min(ix1, cols - 1)
    for iy in range(iy0, iy1):
        here, row = classes[iy], marks[iy - iy0 + 1]
        below, above = classes[max(iy - 1, 0)], classes[min(iy + 1, rows - 1)]
        middle, left, right = (
            here[inner0:inner1],
            here[inner0 - 1 : inner1 - 1],
            here[inner0 + 1 : inner1 + 1],
        )
        under, over = below[inner0:inner1], above[inner0:inner1]
        out = row[inner0 - ix0 + 1 : inner1 - ix0 + 1]
        for k in range(inner1 - inner0):
            out[k] = (middle[k] == CLEAR) & (
                (under[k] == UNKNOWN)
                | (over[k] == UNKNOWN)
                | (left[k] == UNKNOWN)
                | (right[k] == UNKNOWN)
            )
        for ix in (0, cols - 1):
            if ix0 <= ix < ix1 and here[ix] == CLEAR:
                row[ix - ix0 + 1] = (
                    (below[ix] == UNKNOWN)
                    | (above[ix] == UNKNOWN)
                    | (here[max(ix - 1, 0)] == UNKNOWN)
                    | (here[min(ix + 1, cols - 1)] == UNKNOWN)
                )
    return marks


@compiled
def _representatives(
    marks: npt.NDArray[np.uint8], seeds: npt.NDArray[np.int64], spacing: int, min_cells: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return flat indices into `marks` of the chosen cells, their component and its size.

    `marks` is used up: 1 not seen, 2 in a component, 3 seen again on the walk from its centre, 0
    too near to a chosen cell.
    """
    stride = marks.shape[1]
    flat = marks.reshape(-1)
    queue = np.empty(len(seeds), dtype=np.int64)
    chosen = np.empty(len(seeds), dtype=np.int64)
    component = np.empty(len(seeds), dtype=np.int64)
    sizes = np.empty(len(seeds), dtype=np.int64)
    count = components = 0
    for seed in seeds:
        if flat[seed] != 1:
            continue
        size = _walk(flat, queue, seed, 1, 2, stride)
        if size >= min_cells:
            centre = _centre_most(queue[:size], stride)
            _walk(flat, queue, centre, 2, 3, stride)
            last = _keep_apart(marks, queue[:size], chosen, count, spacing)
            component[count:last] = components
            sizes[count:last] = size
            count = last
            components += 1
    return chosen[:count], component[:count], sizes[:count]


@compiled
def _walk(
    flat: npt.NDArray[np.uint8],
    queue: npt.NDArray[np.int64],
    start: int,
    old: int,
    new: int,
    stride: int,
) -> int:
    """Turn all cells marked `old` that hang together with `start` into `new`.

    Writes them to `queue` in the order of their distance along the frontier; returns how many.
    """
    around = (-stride - 1, -stride, -stride + 1, -1, 1, stride - 1, stride, stride + 1)
    queue[0], head, tail = start, 0, 1
    flat[start] = new
    while head < tail:
        cell = queue[head]
        head += 1
        for step in around:
            if flat[cell + step] == old:
                flat[cell + step] = new
                queue[tail] = cell + step
                tail += 1
    return tail


@compiled
def _centre_most(cells: npt.NDArray[np.int64], stride: int) -> int:
    """Return the one of `cells` nearest to their mean; of equals the first in the grid's order."""
    mean_y = np.mean(cells // stride)
    mean_x = np.mean(cells % stride)
    best, least = cells[0], np.inf
    for cell in cells:
        away = (cell // stride - mean_y) ** 2 + (cell % stride - mean_x) ** 2
        if away < least or (away == least and cell < best):
            best, least = cell, away
    return int(best)


@compiled
def _keep_apart(
    marks: npt.NDArray[np.uint8],
    cells: npt.NDArray[np.int64],
    chosen: npt.NDArray[np.int64],
    count: int,
    spacing: int,
) -> int:
    """Append to `chosen`, from `count` on, each of `cells` that keeps its distance from those.

    Whatever lies too near to a chosen cell loses its mark. Returns the new count.
    """
    height, stride = marks.shape
    for cell in cells:
        cy, cx = cell // stride, cell % stride
        if marks[cy, cx] != 3:
            continue
        chosen[count] = cell
        count += 1
        for iy in range(max(cy - spacing + 1, 0), min(cy + spacing, height)):
            for ix in range(max(cx - spacing + 1, 0), min(cx + spacing, stride)):
                near = (iy - cy) ** 2 + (ix - cx) ** 2 < spacing * spacing
                if near and marks[iy, ix] == 3:
                    marks[iy, ix] = 0
    return count
