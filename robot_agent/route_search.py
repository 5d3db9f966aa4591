"""Search for the cheapest way over the cells of the planning map, stopped at its target.

The same metric as `mapping.path_planning`: a step costs 5 or 7 times the weight of the cell it
enters. One wave from the goal over the whole map tells what is left to go from anywhere; with that
for an estimate, later searches visit little more than the way itself, also round obstacles that
have come up since.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.bucket_wave import BLOCKED, DIAGONAL_STEP, MAX_WEIGHT, STRAIGHT_STEP, UNREACHED
from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import Cells, GridGeometry
from mapping.path_planning import CostField, path_to

# The ring must be longer than estimated totals rise in one step: by a good estimate no more than
# 2 x 7 x 9; what rises more is put where the ring ends. A power of two.
_BUCKETS = 256

Weights = npt.NDArray[np.uint8]
Units = npt.NDArray[np.int32]

NO_LIMIT = int(UNREACHED)
NO_ESTIMATE: Units = np.empty((0, 0), dtype=np.int32)


def search_way(
    weights: Weights,
    start_cell: tuple[int, int],
    target: Weights,
    to_go: Units,
    detour: int = NO_LIMIT,
) -> tuple[Cells, int]:
    """Return the cheapest way from the start to any target cell.

    Args:
        weights: (rows, cols) uint8, `BLOCKED` cells are not entered; the start may be blocked.
        start_cell: (iy, ix).
        target: (rows, cols) uint8, not zero where the way may end.
        to_go: (rows, cols) int32, estimate of what is left from each cell, `UNREACHED` where none
            is known; `NO_ESTIMATE` to search in all directions alike. Where it says too much, the
            way found may be a little dearer than the cheapest.
        detour: give up when the way gets so many units dearer than estimated.

    Returns:
        The cells (n, 2) of the way, start first, and its cost in units of `CostField`; no cells
        if no way leads to a target.

    Source: Hart, Nilsson & Raphael 1968 (A*); the queue is Dial's (1969).
    """
    iy, ix = start_cell
    rows, cols = weights.shape
    if not (0 <= iy < rows and 0 <= ix < cols):
        return np.empty((0, 2), dtype=np.int64), 0
    if to_go.shape == weights.shape:
        # Stepping down the estimate is the whole search, if nothing has come into that way.
        cells = path_to(CostField(to_go, 1.0), start_cell)[::-1]
        if len(cells) and target[tuple(cells[-1])] and _free(cells, weights):
            return cells, int(to_go[iy, ix])
    best, end_iy, end_ix = _drawn_wave(weights, iy, ix, target, to_go, detour)
    if end_iy < 0:
        return np.empty((0, 2), dtype=np.int64), 0
    return path_to(CostField(best, 1.0), (end_iy, end_ix)), int(best[end_iy, end_ix])


def _free(cells: Cells, weights: Weights) -> bool:
    """Whether a way (n, 2) enters no blocked cell and passes no blocked corner."""
    before, after = cells[:-1], cells[1:]
    slanted = (before != after).all(axis=1)
    one = weights[before[slanted, 0], after[slanted, 1]]
    other = weights[after[slanted, 0], before[slanted, 1]]
    return bool(weights[after[:, 0], after[:, 1]].all() and one.all() and other.all())


@compiled
def _drawn_wave(
    weights: Weights,
    start_iy: int,
    start_ix: int,
    target: Weights,
    to_go: Units,
    detour: int,
) -> tuple[Units, int, int]:
    """Return the costs found so far and the target cell met first, (-1, -1) if there is none."""
    rows, cols = weights.shape
    drawn = to_go.shape[0] > 0
    best = np.full((rows, cols), UNREACHED, dtype=np.int32)
    settled = np.zeros((rows, cols), dtype=np.uint8)
    queue = np.empty((_BUCKETS, 64), dtype=np.int32)
    filled = np.zeros(_BUCKETS, dtype=np.int64)
    best[start_iy, start_ix] = 0
    queue[0, 0], filled[0] = start_iy * cols + start_ix, 1
    begin = int(to_go[start_iy, start_ix]) if drawn else 0
    if begin == UNREACHED:
        begin = 0
    total, pending = 0, 1
    while pending > 0 and total <= detour:
        slot = total & (_BUCKETS - 1)
        if filled[slot] == 0:
            total += 1
            continue
        filled[slot] -= 1
        pending -= 1
        cell = queue[slot, filled[slot]]
        cy, cx = cell // cols, cell % cols
        if settled[cy, cx]:
            continue
        settled[cy, cx] = 1
        if target[cy, cx]:
            return best, cy, cx
        for dy in range(-1, 2):
            for dx in range(-1, 2):
                iy, ix = cy + dy, cx + dx
                if iy < 0 or ix < 0 or iy >= rows or ix >= cols or settled[iy, ix]:
                    continue
                if weights[iy, ix] == BLOCKED:
                    continue
                step = STRAIGHT_STEP
                if dy != 0 and dx != 0:
                    if weights[cy, ix] == BLOCKED or weights[iy, cx] == BLOCKED:
                        continue
                    step = DIAGONAL_STEP
                cost = int(best[cy, cx]) + step * min(int(weights[iy, ix]), MAX_WEIGHT)
                if cost >= best[iy, ix]:
                    continue
                best[iy, ix] = cost
                estimated = int(cost)
                if drawn:
                    # The estimate was made from the goal on: it counts this cell, not the last.
                    # Where it knows nothing, what is left is taken to be as at the start.
                    left = int(to_go[iy, ix])
                    left = begin if left == UNREACHED else left
                    estimated += left - STRAIGHT_STEP * int(weights[iy, ix]) - begin
                slot = min(max(estimated, total), total + _BUCKETS - 1) & (_BUCKETS - 1)
                if filled[slot] == queue.shape[1]:
                    larger = np.empty((_BUCKETS, 2 * queue.shape[1]), dtype=np.int32)
                    larger[:, : queue.shape[1]] = queue
                    queue = larger
                queue[slot, filled[slot]] = iy * cols + ix
                filled[slot] += 1
                pending += 1
    return best, -1, -1


def stamp_discs(
    grid: Weights, geometry: GridGeometry, centres: Floats, radius: float, value: int
) -> None:
    """Write `value`, in place, to all cells whose centre is within `radius` of a point.

    Args:
        grid: (rows, cols) uint8.
        geometry: where its cells lie.
        centres: (n, 2) [m], in the grid's frame; may lie off the grid.
        radius: [m].
        value: 0 to 255.
    """
    _stamp(
        grid,
        np.ascontiguousarray(centres, dtype=np.float64),
        geometry.origin_x,
        geometry.origin_y,
        geometry.resolution,
        radius,
        value,
    )


@compiled
def _stamp(
    grid: Weights,
    centres: Floats,
    origin_x: float,
    origin_y: float,
    resolution: float,
    radius: float,
    value: int,
) -> None:
    """Compiled body of `stamp_discs`."""
    rows, cols = grid.shape
    reach = radius / resolution
    for k in range(len(centres)):
        cx = (centres[k, 0] - origin_x) / resolution - 0.5
        cy = (centres[k, 1] - origin_y) / resolution - 0.5
        for iy in range(max(math.ceil(cy - reach), 0), min(math.floor(cy + reach) + 1, rows)):
            for ix in range(max(math.ceil(cx - reach), 0), min(math.floor(cx + reach) + 1, cols)):
                if (iy - cy) ** 2 + (ix - cx) ** 2 <= reach * reach:
                    grid[iy, ix] = value


def standing_places(
    weights: Weights, clear: npt.NDArray[np.bool_], goal_cell: tuple[int, int], reach: int
) -> Weights:
    """Return where a robot may stand to be at the goal, on the goal's side of every wall.

    Args:
        weights: (rows, cols) uint8.
        clear: (rows, cols), what is known to be clear.
        goal_cell: (iy, ix).
        reach: how far from the goal the robot may stand [cells].

    Returns:
        (rows, cols) uint8, 1 for the goal cell alone if it may be entered; else for all enterable
        cells within reach that clear cells connect to the goal.
    """
    places = np.zeros(weights.shape, dtype=np.uint8)
    iy, ix = goal_cell
    rows, cols = weights.shape
    if 0 <= iy < rows and 0 <= ix < cols and weights[iy, ix] != BLOCKED:
        places[iy, ix] = 1
    else:
        _spread(places, weights, clear, iy, ix, reach)
    return places


@compiled
def _spread(
    places: Weights,
    weights: Weights,
    clear: npt.NDArray[np.bool_],
    goal_iy: int,
    goal_ix: int,
    reach: int,
) -> None:
    """Mark the enterable cells that clear cells connect to a goal, which may itself be unknown."""
    rows, cols = weights.shape
    side = 2 * reach + 1
    seen = np.zeros((side, side), dtype=np.uint8)
    queue = np.empty((side * side, 2), dtype=np.int64)
    queue[0, 0], queue[0, 1] = goal_iy, goal_ix
    seen[reach, reach] = 1
    head, tail = 0, 1
    while head < tail:
        cy, cx = queue[head]
        head += 1
        for dy, dx in ((-1, 0), (0, -1), (0, 1), (1, 0)):
            iy, ix = cy + dy, cx + dx
            wy, wx = iy - goal_iy + reach, ix - goal_ix + reach
            if wy < 0 or wx < 0 or wy >= side or wx >= side or seen[wy, wx]:
                continue
            seen[wy, wx] = 1
            if iy < 0 or ix < 0 or iy >= rows or ix >= cols or not clear[iy, ix]:
                continue
            if (iy - goal_iy) ** 2 + (ix - goal_ix) ** 2 > reach * reach:
                continue
            queue[tail, 0], queue[tail, 1] = iy, ix
            tail += 1
            if weights[iy, ix] != BLOCKED:
                places[iy, ix] = 1
