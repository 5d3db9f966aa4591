"""Straight lines in place of a path's staircase."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.bucket_wave import BLOCKED, DIAGONAL_STEP, STRAIGHT_STEP
from mapping.compiled import compiled
from mapping.grid import Cells

# The wave measures diagonals 1 % short; a line may be dearer than its path by that and a little.
_TOLERANCE = 1.02


@compiled
def line_care(
    weights: npt.NDArray[np.uint8], iy0: int, ix0: int, iy1: int, ix1: int
) -> tuple[float, int]:
    """Return what the straight line between two cells' centres costs, and its heaviest weight.

    Every cell the line crosses counts but the first: the robot stands there. Where the line
    passes exactly through a corner, neither of the two cells beside it may be blocked.

    Args:
        weights: (rows, cols) uint8; both cells lie inside.
        iy0: row of the first cell.
        ix0: column of the first cell.
        iy1: row of the last cell.
        ix1: column of the last cell.

    Returns:
        (cost in cells of weight 1, heaviest weight); (inf, 0) if the line meets a blocked cell.

    Source: Amanatides & Woo 1987, in whole numbers.
    """
    rise, run = abs(iy1 - iy0), abs(ix1 - ix0)
    dy, dx = (1 if iy1 > iy0 else -1), (1 if ix1 > ix0 else -1)
    iy, ix, crossed_y, crossed_x = iy0, ix0, 0, 0
    touched, total, heaviest = 0, 0, 0
    while crossed_y < rise or crossed_x < run:
        # The line leaves the cell where (2 n + 1) / (2 rise) of it, or of the run, are behind.
        along_x, along_y = (2 * crossed_x + 1) * rise, (2 * crossed_y + 1) * run
        if along_x == along_y and (
            weights[iy + dy, ix] == BLOCKED or weights[iy, ix + dx] == BLOCKED
        ):
            return np.inf, 0
        if along_x <= along_y:
            ix += dx
            crossed_x += 1
        if along_y <= along_x:
            iy += dy
            crossed_y += 1
        weight = int(weights[iy, ix])
        if weight == BLOCKED:
            return np.inf, 0
        heaviest = max(heaviest, weight)
        total += weight
        touched += 1
    return math.hypot(rise, run) * total / max(touched, 1), heaviest


@compiled
def shortcuts(cells: Cells, weights: npt.NDArray[np.uint8]) -> npt.NDArray[np.int64]:
    """Return which cells of a path to keep, so that straight lines between them can replace it.

    From each kept cell the line is drawn out as far as it stays no dearer and no heavier than the
    path beside it.

    Args:
        cells: (N, 2), a path of neighbouring cells inside the grid.
        weights: (rows, cols) uint8, see `mapping.path_planning.traversal_weights`.

    Returns:
        Indices into `cells`, ascending, first and last included.
    """
    count = len(cells)
    kept = np.empty(count, dtype=np.int64)
    if count == 0:
        return kept
    kept[0], bends, anchor = 0, 1, 0
    while anchor < count - 1:
        reach, heaviest, units = anchor + 1, 0, 0
        for k in range(anchor + 1, count):
            weight = int(weights[cells[k, 0], cells[k, 1]])
            diagonal = cells[k, 0] != cells[k - 1, 0] and cells[k, 1] != cells[k - 1, 1]
            units += weight * (DIAGONAL_STEP if diagonal else STRAIGHT_STEP)
            heaviest = max(heaviest, weight)
            cost, line_heaviest = line_care(
                weights, cells[anchor, 0], cells[anchor, 1], cells[k, 0], cells[k, 1]
            )
            if line_heaviest > heaviest or cost * STRAIGHT_STEP > _TOLERANCE * units:
                if k > 2 * reach - anchor + 8:
                    break  # a line that failed for so long seldom comes free again
                continue
            reach = k
        anchor = reach
        kept[bends] = anchor
        bends += 1
    return kept[:bends]
