"""Traversal weights on a coarser grid, where knowing the cost of every place need not be exact."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.compiled import compiled


def block_box(box: CellBox, factor: int) -> CellBox:
    """Return the box of blocks of `factor` x `factor` cells that hold the cells of a box."""
    return CellBox(
        box.iy0 // factor, box.ix0 // factor, -(-box.iy1 // factor), -(-box.ix1 // factor)
    )


def coarsen_weights(weights: npt.NDArray[np.uint8], factor: int) -> npt.NDArray[np.uint8]:
    """Return the weights of blocks of `factor` x `factor` cells.

    A block may be entered if any of its cells may, at the cost of the cheapest. Walls cannot leak
    that way: cells within a body's radius of an obstacle are blocked, so a wall blocks a band that
    is several blocks wide.

    Args:
        weights: (rows, cols) uint8, see `mapping.path_planning.traversal_weights`.
        factor: cells along a block's edge. Blocks at the far edges may be cut.

    Returns:
        (ceil(rows / factor), ceil(cols / factor)) uint8.
    """
    rows, cols = weights.shape
    coarse = np.empty((-(-rows // factor), -(-cols // factor)), dtype=np.uint8)
    refresh_weights(coarse, weights, factor, CellBox(0, 0, rows, cols))
    return coarse


def refresh_weights(
    coarse: npt.NDArray[np.uint8], weights: npt.NDArray[np.uint8], factor: int, box: CellBox
) -> None:
    """Bring the weights of blocks up to date, in place, after those of cells changed in `box`.

    Args:
        coarse: from `coarsen_weights`.
        weights: (rows, cols) uint8, after the change.
        factor: cells along a block's edge.
        box: cells of `weights`, within the grid.
    """
    block = block_box(box, factor)
    _coarsen(weights, factor, (block.iy0, block.ix0, block.iy1, block.ix1), coarse)


@compiled
def _coarsen(
    weights: npt.NDArray[np.uint8],
    factor: int,
    box: tuple[int, int, int, int],
    coarse: npt.NDArray[np.uint8],
) -> None:
    """Compiled body of `refresh_weights`; `box` counts blocks.

    A blocked cell counts as dearer than any other: `weight - 1` wraps round at `BLOCKED`, 0.
    """
    rows, cols = weights.shape
    for by in range(box[0], box[2]):
        for bx in range(box[1], box[3]):
            least = 255
            for iy in range(by * factor, min((by + 1) * factor, rows)):
                for ix in range(bx * factor, min((bx + 1) * factor, cols)):
                    least = min(least, (int(weights[iy, ix]) - 1) & 255)
            coarse[by, bx] = (least + 1) & 255
