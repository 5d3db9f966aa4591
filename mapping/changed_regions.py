"""Where two versions of a grid differ: a few small boxes instead of one around everything.

Robots far apart change a map at far places. Whatever is derived from the map is then to be made
anew around each of them, not on all the floor between them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.compiled import compiled

TILE = 32  # changes in neighbouring tiles of so many cells along an edge count as one region


def changed_regions(
    before: npt.NDArray[np.int8], after: npt.NDArray[np.int8], box: CellBox
) -> list[CellBox]:
    """Return boxes that together hold every cell that differs; they may overlap.

    Args:
        before: (rows, cols), a part of a grid.
        after: (rows, cols), the same part later.
        box: where in the grid that part lies.

    Returns:
        Boxes in cells of the grid, in the grid's order of their first tiles; each reaches to the
        outermost cells of its region that differ.
    """
    rows, cols = before.shape
    differs = np.empty((rows, -(-cols // TILE) * TILE), dtype=np.bool_)
    np.not_equal(before, after, out=differs[:, :cols])
    differs[:, cols:] = False
    extents = _regions(differs, differs.view(np.uint64), TILE)
    return [CellBox(*extent).shifted(box.iy0, box.ix0) for extent in extents.tolist()]


@compiled
def _regions(
    differs: npt.NDArray[np.bool_], words: npt.NDArray[np.uint64], tile: int
) -> npt.NDArray[np.int64]:
    """Return the boxes (N, 4) of the groups of neighbouring tiles that hold a difference.

    Args:
        differs: (rows, whole tiles), which cells differ.
        words: the same eight cells at a time; most are 0.
        tile: cells along an edge of a tile.
    """
    rows, cols = differs.shape
    high, wide = -(-rows // tile), cols // tile
    extents = np.zeros((high, wide, 4), dtype=np.int64)
    for iy in range(rows):
        for tx in range(wide):
            some = False
            for word in words[iy, tx * tile // 8 : (tx + 1) * tile // 8]:
                some = some or word != 0
            if not some:
                continue
            first, last = tx * tile, (tx + 1) * tile
            while not differs[iy, first]:
                first += 1
            while not differs[iy, last - 1]:
                last -= 1
            _stretch(extents[iy // tile, tx], iy, first, iy + 1, last)
    found = np.empty((high * wide, 4), dtype=np.int64)
    stack = np.empty((high * wide, 2), dtype=np.int64)
    count = 0
    for ty in range(high):
        for tx in range(wide):
            if extents[ty, tx, 2] > 0:
                _gather(extents, ty, tx, stack, found[count])
                count += 1
    return found[:count]


@compiled
def _stretch(extent: npt.NDArray[np.int64], iy0: int, ix0: int, iy1: int, ix1: int) -> None:
    """Stretch a box (4,), in place, to hold another one; all zero is empty."""
    if extent[2] == 0:
        extent[0], extent[1], extent[2], extent[3] = iy0, ix0, iy1, ix1
    else:
        extent[0], extent[1] = min(extent[0], iy0), min(extent[1], ix0)
        extent[2], extent[3] = max(extent[2], iy1), max(extent[3], ix1)


@compiled
def _gather(
    extents: npt.NDArray[np.int64],
    ty: int,
    tx: int,
    stack: npt.NDArray[np.int64],
    region: npt.NDArray[np.int64],
) -> None:
    """Write the box around all tiles that hang together with one; empty those tiles' boxes."""
    high, wide, _ = extents.shape
    region[:] = extents[ty, tx]
    extents[ty, tx, 2] = 0
    stack[0, 0], stack[0, 1] = ty, tx
    count = 1
    while count > 0:
        count -= 1
        cy, cx = stack[count, 0], stack[count, 1]
        for ny in range(max(cy - 1, 0), min(cy + 2, high)):
            for nx in range(max(cx - 1, 0), min(cx + 2, wide)):
                extent = extents[ny, nx]
                if extent[2] > 0:
                    _stretch(region, extent[0], extent[1], extent[2], extent[3])
                    extent[2] = 0
                    stack[count, 0], stack[count, 1] = ny, nx
                    count += 1
