"""How many points of a scan lie near walls: a quick look before anything is matched."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats

# Edge of a block [m].
BLOCK = 0.2


class WallBlocks:
    """The blocks of a plane in which there are walls.

    Attributes:
        radius: how far from the frame's origin the walls reach [m].
    """

    def __init__(self, walls: Floats) -> None:
        """Sort points on walls (N, 2) [m] into blocks."""
        self.radius = float(np.hypot(walls[:, 0], walls[:, 1]).max(initial=0.0))
        low = walls.min(axis=0, initial=0.0)
        blocks = ((walls - low) / BLOCK).astype(np.int64)
        self._corner = (float(low[0]), float(low[1]))
        self._blocks = np.zeros(tuple(blocks.max(axis=0, initial=-1) + 1), dtype=np.bool_)
        self._blocks[blocks[:, 0], blocks[:, 1]] = True

    def near(self, points: Floats, reach: float) -> int:
        """Return how many of the points (N, 2) lie within `reach` [m] of a wall, same frame.

        By blocks: some that lie up to a block or so farther away count as well.
        """
        return _count_near(points, self._blocks, *self._corner, math.ceil(reach / BLOCK))


@compiled
def _count_near(
    points: Floats, blocks: npt.NDArray[np.bool_], low_x: float, low_y: float, around: int
) -> int:
    """Return how many points lie at most so many blocks away from one with a wall, by axes."""
    count = 0
    for n in range(points.shape[0]):
        bx = math.floor((points[n, 0] - low_x) / BLOCK)
        by = math.floor((points[n, 1] - low_y) / BLOCK)
        near = False
        for x in range(max(bx - around, 0), min(bx + around + 1, blocks.shape[0])):
            for y in range(max(by - around, 0), min(by + around + 1, blocks.shape[1])):
                near = near or blocks[x, y]
        count += 1 if near else 0
    return count
