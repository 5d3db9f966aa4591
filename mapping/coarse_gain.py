"""Information gains from floods over blocks of cells: much cheaper, and nearly the same.

Blocks remember how much in them is unknown. Cells, ranges, gains and boxes are those of the fine
grid all the same, so these functions stand in for `mapping.information_gain` as they are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox, around_both
from mapping.coarse_weights import block_box
from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import CLEAR, OBSTACLE, UNKNOWN, Cells
from mapping.information_gain import (
    CLOSED,
    NO_WEIGHT,
    Gains,
    circle_rows,
    flood,
    flood_from,
    flood_space,
    information_gains,
    unvisited,
)

START_CELLS = 10  # how far around a frontier cell the flood runs over fine cells
_DOUBTFUL = 2.0  # a flood that leaves the start should find more than this times what lies there


@dataclass(frozen=True, slots=True)
class CoarseClasses:
    """Classes of blocks of cells, and the fine ones they come from.

    Attributes:
        classes: (rows, cols) uint8, of blocks. Any obstacle makes a block an obstacle, so that
            the thinnest wall stays closed; else any unknown cell makes it unknown, so that a
            frontier cell stays beside something unknown; else it is clear.
        weight: (rows, cols) float32, the sum over the block's unknown cells of their weights [fine
            cells]. Counting a mixed block by its share keeps gains true on average.
        factor: fine cells along a block's edge.
        fine: the classes these were made from, uint8; not copied.
        fine_weight: the weight of each fine cell, float32; (0, 0) if each counts 1.
    """

    classes: npt.NDArray[np.uint8]
    weight: npt.NDArray[np.float32]
    factor: int
    fine: npt.NDArray[np.uint8]
    fine_weight: npt.NDArray[np.float32]


def coarsen_classes(
    classes: npt.NDArray[np.uint8], factor: int, weight: npt.NDArray[np.float32] | None = None
) -> CoarseClasses:
    """Return the classes of blocks of `factor` x `factor` cells.

    Args:
        classes: (rows, cols) uint8 of `mapping.grid` classes.
        factor: cells along a block's edge. Blocks at the far edges may be cut.
        weight: (rows, cols) float32, what each unknown cell counts; without it each counts 1.
    """
    fine = np.ascontiguousarray(classes)
    fine_weight = NO_WEIGHT if weight is None else np.ascontiguousarray(weight)
    blocks = (-(-fine.shape[0] // factor), -(-fine.shape[1] // factor))
    kinds, sums = np.empty(blocks, dtype=np.uint8), np.empty(blocks, dtype=np.float32)
    coarse = CoarseClasses(kinds, sums, factor, fine, fine_weight)
    refresh_classes(coarse, CellBox(0, 0, *fine.shape))
    return coarse


def refresh_classes(coarse: CoarseClasses, box: CellBox) -> None:
    """Bring blocks up to date, in place, after fine cells or their weights changed in `box`."""
    block = block_box(box, coarse.factor)
    _coarsen(
        coarse.fine,
        coarse.fine_weight,
        coarse.factor,
        (block.iy0, block.ix0, block.iy1, block.ix1),
        coarse.classes,
        coarse.weight,
    )


@compiled
def _coarsen(
    classes: npt.NDArray[np.uint8],
    weight: npt.NDArray[np.float32],
    factor: int,
    box: tuple[int, int, int, int],
    coarse: npt.NDArray[np.uint8],
    sums: npt.NDArray[np.float32],
) -> None:
    """Compiled body of `refresh_classes`; an empty `weight` counts 1 everywhere."""
    rows, cols = classes.shape
    for by in range(box[0], box[2]):
        for bx in range(box[1], box[3]):
            kind, total = CLEAR, np.float32(0.0)
            for iy in range(by * factor, min((by + 1) * factor, rows)):
                for ix in range(bx * factor, min((bx + 1) * factor, cols)):
                    if classes[iy, ix] == UNKNOWN:
                        total += weight[iy, ix] if len(weight) > 0 else np.float32(1.0)
                        kind = UNKNOWN if kind == CLEAR else kind
                    elif classes[iy, ix] == OBSTACLE:
                        kind = OBSTACLE
            coarse[by, bx], sums[by, bx] = kind, total


def coarse_information_gains(
    coarse: CoarseClasses, frontier_cells: npt.ArrayLike, range_cells: float
) -> Gains:
    """Return expected information gains and their extents, as `information_gains` does.

    Around the frontier cell the flood runs over fine cells, so that it starts on the right side
    of a wall and through narrow gaps; a pocket that ends there is counted exactly. Beyond, it
    runs over blocks. Where that leads almost nowhere, because the way on is a gap between
    obstacles narrower than blocks, the whole flood is done again over fine cells.

    Args:
        coarse: from `coarsen_classes`.
        frontier_cells: (N, 2), fine cells inside the grid.
        range_cells: nominal range of the sensor [fine cells].

    Returns:
        gains (N,) in fine cells, or the sums of their weights; and boxes (N, 4) int64, half open,
        in fine cells, around all that was flooded (whole blocks, which may reach over the
        grid's far edges).
    """
    cells = np.asarray(frontier_cells, dtype=np.int64).reshape(-1, 2)
    gains, boxes, doubtful = _coarse_gains(
        unvisited(coarse.classes),
        coarse.weight,
        coarse.factor,
        coarse.fine,
        coarse.fine_weight,
        cells,
        range_cells,
    )
    if doubtful.any():
        weight = coarse.fine_weight if coarse.fine_weight.size else None
        again, around = information_gains(coarse.fine, weight, cells[doubtful], range_cells)
        gains[doubtful] = again
        boxes[doubtful] = around_both(boxes[doubtful], around)
    return gains, boxes


def coarse_grounds(cells: Cells, boxes: Cells, factor: int) -> Cells:
    """Return boxes (N, 4) around all fine cells on which coarse gains depend, half open.

    A flood depends on the cells it covered and on those one block around, and on where it starts;
    the rest of the circle of the sensor's range does not matter.

    Args:
        cells: (N, 2) int64, the frontier cells.
        boxes: (N, 4) from `coarse_information_gains`.
        factor: fine cells along a block's edge.
    """
    start = START_CELLS + factor
    low = np.minimum(boxes[:, :2] - factor, cells - start)
    high = np.maximum(boxes[:, 2:] + factor, cells + 1 + start)
    return np.concatenate((low, high), axis=1)


@compiled
def _coarse_gains(
    visits: npt.NDArray[np.int32],
    weight: npt.NDArray[np.float32],
    factor: int,
    fine: npt.NDArray[np.uint8],
    fine_weight: npt.NDArray[np.float32],
    cells: Cells,
    range_cells: float,
) -> tuple[Floats, Cells, npt.NDArray[np.bool_]]:
    """Return gains, boxes, and which of them blocks are too coarse for."""
    gains = np.zeros(len(cells))
    doubtful = np.zeros(len(cells), dtype=np.bool_)
    boxes = np.empty((len(cells), 4), dtype=np.int64)
    reach, near_reach = range_cells / factor, min(range_cells, 1.0 * START_CELLS)
    span = math.ceil(near_reach) + 1
    stack, circle = flood_space(max(reach, near_reach))
    for k in range(len(cells)):
        iy, ix, box = cells[k, 0], cells[k, 1], boxes[k]
        y0, x0 = max(iy - span, 0), max(ix - span, 0)
        near = unvisited(fine[y0 : iy + span + 1, x0 : ix + span + 1])
        values = fine_weight[y0 : iy + span + 1, x0 : ix + span + 1].copy()
        gains[k] = flood_from(near, values, stack, circle, iy - y0, ix - x0, near_reach, 1, box)
        if box[2] == 0:
            box[0], box[1], box[2], box[3] = iy, ix, iy, ix
            continue
        box[0], box[1], box[2], box[3] = box[0] + y0, box[1] + x0, box[2] + y0, box[3] + x0
        if near_reach == range_cells or not _leaves(near, iy - y0, ix - x0, near_reach):
            continue
        seeds, here = _seeds(near, y0, x0, visits, factor, stack), gains[k]
        if seeds > 0:
            middle_y, middle_x = (iy + 0.5) / factor + 0.5, (ix + 0.5) / factor + 0.5
            top = circle_rows(circle, middle_y, middle_x, reach)
            gains[k] = flood(visits, weight, stack, seeds, circle, top, k + 1, box)
            box *= factor
        doubtful[k] = seeds == 0 or gains[k] <= _DOUBTFUL * here
    return gains, boxes, doubtful


@compiled
def _leaves(near: npt.NDArray[np.int32], centre_y: int, centre_x: int, reach: float) -> bool:
    """Whether the flood marked 1 in `near` has come to the rim of its circle."""
    inner = max(reach - 1.0, 0.0)
    for iy in range(near.shape[0] - 2):
        for ix in range(near.shape[1] - 2):
            away = (iy - centre_y) ** 2 + (ix - centre_x) ** 2
            if near[iy + 1, ix + 1] == 1 and away > inner * inner:
                return True
    return False


@compiled
def _seeds(
    near: npt.NDArray[np.int32],
    y0: int,
    x0: int,
    visits: npt.NDArray[np.int32],
    factor: int,
    stack: Cells,
) -> int:
    """Put on the stack each unknown block in which the flood marked 1 in `near` has been.

    `y0` and `x0` are the fine cell where `near` begins. Returns how many there are.
    """
    seeds = 0
    y1, x1 = y0 + near.shape[0] - 2, x0 + near.shape[1] - 2
    for by in range(y0 // factor, (y1 - 1) // factor + 1):
        for bx in range(x0 // factor, (x1 - 1) // factor + 1):
            met = False
            if visits[by + 1, bx + 1] != CLOSED:
                for iy in range(max(by * factor, y0), min((by + 1) * factor, y1)):
                    for ix in range(max(bx * factor, x0), min((bx + 1) * factor, x1)):
                        met = met or near[iy - y0 + 1, ix - x0 + 1] == 1
            if met:
                stack[0, seeds], stack[1, seeds] = by + 1, bx + 1
                seeds += 1
    return seeds
