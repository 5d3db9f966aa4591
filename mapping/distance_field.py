"""Distance from every cell to the nearest obstacle, exact up to a limit.

Path planning asks for it to keep away from walls, scan matching to know how far an end point lies
from the map. Nobody asks what lies beyond a metre or so, and with the distance truncated there a
change of the map can only be felt within that limit: that is what makes updates cheap.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.compiled import compiled

_BAND_ROWS = 128  # whole grids are done in bands whose buffers stay in the processor's cache


def truncated_distance(
    obstacle: npt.NDArray[np.bool_] | npt.NDArray[np.uint8], resolution: float, limit: float
) -> npt.NDArray[np.float32]:
    """Return the distance [m] from each cell's centre to the nearest obstacle cell's centre.

    Args:
        obstacle: (rows, cols) bool or uint8; not zero where an obstacle is.
        resolution: edge of a cell [m].
        limit: distances are cut off here [m]; also what cells far from any obstacle get.

    Returns:
        (rows, cols) float32 [m], Euclidean.

    Source: Felzenszwalb & Huttenlocher 2012, the separation into columns and rows; the lower
    envelope is replaced by a window as wide as the limit.
    """
    solid = _as_bytes(obstacle)
    field = np.empty(solid.shape, dtype=np.float32)
    rows, cols = solid.shape
    reach = reach_cells(limit, resolution)
    for iy in range(0, rows, _BAND_ROWS):
        above = min(iy + _BAND_ROWS, rows)
        _fill_window(solid, field, iy, 0, above, cols, reach, resolution, limit)
    return field


def update_distance(
    field: npt.NDArray[np.float32],
    obstacle: npt.NDArray[np.bool_] | npt.NDArray[np.uint8],
    box: CellBox,
    resolution: float,
    limit: float,
) -> CellBox:
    """Bring `field` up to date, in place, after obstacles changed inside `box`.

    The result equals `truncated_distance` of the whole grid, bit by bit.

    Args:
        field: (rows, cols) float32 [m], right for the obstacles before the change.
        obstacle: (rows, cols) bool or uint8, after the change.
        box: where obstacles may have come or gone; may reach over the edge of the grid.
        resolution: edge of a cell [m].
        limit: the limit `field` was made with [m].

    Returns:
        The box of the cells recomputed: `box` grown by the limit, clipped to the grid.
    """
    rows, cols = field.shape
    reach = reach_cells(limit, resolution)
    touched = box.dilated(reach, (rows, cols))
    if not touched.empty:
        solid = _as_bytes(obstacle)
        iy0, ix0, iy1, ix1 = touched.iy0, touched.ix0, touched.iy1, touched.ix1
        _fill_window(solid, field, iy0, ix0, iy1, ix1, reach, resolution, limit)
    return touched


def reach_cells(limit: float, resolution: float) -> int:
    """Return how many cells away an obstacle can still lower a distance cut off at `limit` [m]."""
    return max(math.ceil(limit / resolution), 0)


def _as_bytes(
    obstacle: npt.NDArray[np.bool_] | npt.NDArray[np.uint8],
) -> npt.NDArray[np.uint8]:
    """Return `obstacle` as uint8 in C order, without a copy where possible."""
    return np.ascontiguousarray(obstacle).view(np.uint8)


@compiled
def _fill_window(
    solid: npt.NDArray[np.uint8],
    field: npt.NDArray[np.float32],
    iy0: int,
    ix0: int,
    iy1: int,
    ix1: int,
    reach: int,
    resolution: float,
    limit: float,
) -> None:
    """Write the distances of the cells in [iy0, iy1) x [ix0, ix1).

    Rows are swept down, then up; `gaps` holds how far the nearest obstacle of the same column is.
    It has `reach` columns more on each side than the window, so that the search along a row needs
    no bounds check. Counts of cells are float32, exact to 2^24: the compiler widens small
    integers, and would then leave the vector registers unused.
    """
    rows, cols = solid.shape
    height, width = iy1 - iy0, ix1 - ix0
    left, right = max(ix0 - reach, 0), min(ix1 + reach, cols)
    offset = left - (ix0 - reach)
    far = np.float32(reach + 1)
    gaps = np.full((height, width + 2 * reach), far, dtype=np.float32)
    run = np.full(right - left, far, dtype=np.float32)
    for iy in range(max(iy0 - reach, 0), iy1):
        _pass_row(solid[iy, left:right], run, far)
        if iy >= iy0:
            gaps[iy - iy0, offset : offset + right - left] = run
    run[:] = far
    squared = np.empty(width, dtype=np.float32)
    for iy in range(min(iy1 + reach, rows) - 1, iy0 - 1, -1):
        _pass_row(solid[iy, left:right], run, far)
        if iy < iy1:
            line = gaps[iy - iy0]
            inner = line[offset : offset + right - left]
            for k in range(right - left):
                inner[k] = run[k] if run[k] < inner[k] else inner[k]
            _nearest_along_row(line, squared, reach)
            _to_metres(squared, field[iy, ix0:ix1], resolution, limit)


@compiled
def _pass_row(
    solid_row: npt.NDArray[np.uint8], run: npt.NDArray[np.float32], far: np.float32
) -> None:
    """Move `run`, the gap to the last obstacle passed in each column, on by one row."""
    for k in range(len(run)):
        grown = run[k] + np.float32(1.0)
        grown = grown if grown < far else far
        run[k] = np.float32(0.0) if solid_row[k] != 0 else grown


@compiled
def _nearest_along_row(
    line: npt.NDArray[np.float32], squared: npt.NDArray[np.float32], reach: int
) -> None:
    """Write the least squared distance [cells^2] of each cell over a window of columns.

    `line` holds the gaps within the columns and is squared in place.
    """
    width = len(squared)
    near = 0
    for k in range(len(line)):
        near += line[k] <= reach
    for k in range(len(line)):
        line[k] = line[k] * line[k]
    squared[:] = line[reach : reach + width]
    if near == 0:
        return
    for shift in range(1, reach + 1):
        sideways = np.float32(shift * shift)
        before = line[reach - shift : reach - shift + width]
        after = line[reach + shift : reach + shift + width]
        for k in range(width):
            nearer = before[k] if before[k] < after[k] else after[k]
            nearer += sideways
            squared[k] = nearer if nearer < squared[k] else squared[k]


@compiled
def _to_metres(
    squared: npt.NDArray[np.float32],
    metres: npt.NDArray[np.float32],
    resolution: float,
    limit: float,
) -> None:
    """Write the square root of each of `squared` [cells^2] in metres, cut off at `limit`."""
    for k in range(len(squared)):
        distance = resolution * math.sqrt(np.float64(squared[k]))
        metres[k] = distance if distance < limit else limit
