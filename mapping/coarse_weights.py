"""Traversal weights on a coarser grid, where knowing the cost of every place need not be exact."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.bucket_wave import BLOCKED
from mapping.compiled import compiled


@compiled
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
    coarse = np.full((-(-rows // factor), -(-cols // factor)), BLOCKED, dtype=np.uint8)
    for iy in range(rows):
        line = coarse[iy // factor]
        for ix in range(cols):
            weight = weights[iy, ix]
            if weight != BLOCKED:
                best = line[ix // factor]
                if best == BLOCKED or weight < best:
                    line[ix // factor] = weight
    return coarse
