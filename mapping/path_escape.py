"""A way out for a robot that stands nearer to an obstacle than paths may lead.

A push, an error of its pose or a wall seen late can put it there. It must never be trapped by
the margin kept around obstacles.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.bucket_wave import BLOCKED
from mapping.compiled import compiled

ESCAPE_WEIGHT = 8  # dearer than any other cell, so that the way out is the shortest there is


def with_escape(
    weights: npt.NDArray[np.uint8],
    clear: npt.NDArray[np.bool_],
    clearance: npt.NDArray[np.float32],
    start_cell: tuple[int, int],
    resolution: float,
    radius: float,
    body_radius: float = 0.0,
) -> npt.NDArray[np.uint8]:
    """Return weights by which a robot can leave a place too near to an obstacle.

    If the start is blocked, clear cells around it are opened at `ESCAPE_WEIGHT`, up to the first
    cells that may be entered: first only along ways on which clearance does not fall, so that no
    gap too narrow for the body opens on the way; if that leads nowhere, along any way.

    Args:
        weights: (rows, cols) uint8, see `traversal_weights`; not changed.
        clear: (rows, cols), the cells known to be clear.
        clearance: (rows, cols) float32 [m].
        start_cell: (iy, ix) of the robot.
        resolution: edge of a cell [m].
        radius: how far from the start cells may be opened [m].
        body_radius: cells this near to the start count as clear, whatever the map says: the body
            stands there [m].

    Returns:
        `weights` itself if the start needs no escape or none was found.
    """
    rows, cols = weights.shape
    iy, ix = start_cell
    if not (0 <= iy < rows and 0 <= ix < cols) or weights[iy, ix] != BLOCKED:
        return weights
    reach, body = radius / resolution, body_radius / resolution
    for climbing in (True, False):
        opened = weights.copy()
        if _open_escape(opened, clear, clearance, iy, ix, reach, body, climbing):
            return opened
    return weights


@compiled
def _open_escape(
    weights: npt.NDArray[np.uint8],
    clear: npt.NDArray[np.bool_],
    clearance: npt.NDArray[np.float32],
    start_iy: int,
    start_ix: int,
    reach: float,
    body: float,
    climbing: bool,
) -> bool:
    """Open blocked cells around the start, in place; return whether a free cell was met.

    `reach` and `body` are radii in cells.
    """
    rows, cols = weights.shape
    side = 2 * math.ceil(reach) + 1
    queue = np.empty((side * side, 2), dtype=np.int64)
    queue[0, 0], queue[0, 1] = start_iy, start_ix
    weights[start_iy, start_ix] = ESCAPE_WEIGHT
    head, tail, met = 0, 1, False
    while head < tail:
        cy, cx = queue[head]
        head += 1
        for dy, dx in ((-1, 0), (0, -1), (0, 1), (1, 0)):
            iy, ix = cy + dy, cx + dx
            if iy < 0 or ix < 0 or iy >= rows or ix >= cols:
                continue
            if weights[iy, ix] != BLOCKED:
                met = met or weights[iy, ix] != ESCAPE_WEIGHT
                continue
            away = math.hypot(iy - start_iy, ix - start_ix)
            falls = clearance[iy, ix] < clearance[cy, cx]
            if away > reach or (climbing and falls) or not (clear[iy, ix] or away <= body):
                continue
            weights[iy, ix] = ESCAPE_WEIGHT
            queue[tail, 0], queue[tail, 1] = iy, ix
            tail += 1
    return met
