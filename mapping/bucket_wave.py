"""One wave of least costs over a grid, with a ring of buckets for its priority queue.

The wave carries whole numbers: a step costs 5 along a row or column and 7 along a diagonal, times
the weight of the cell it enters. Steps are short, so the cells still to be visited lie within
`_BUCKETS` units of the current cost, and a ring of that many buckets keeps them in order without
any comparing (Dial 1969).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.grid import Cells

BLOCKED = 0  # the weight of a cell that may not be entered
MAX_WEIGHT = 9  # heavier cells count as this: the ring must be longer than a step of 7 x weight
UNREACHED = np.iinfo(np.int32).max
STRAIGHT_STEP = 5
DIAGONAL_STEP = 7
NOWHERE = (-1, -1)  # no cell in particular

_BUCKETS = 64  # a power of two above DIAGONAL_STEP * MAX_WEIGHT
_OUTSIDE = -1  # in the padded array: a cell that no step can improve


@compiled
def bucket_wave(
    weights: npt.NDArray[np.uint8], starts: Cells, until: tuple[int, int], beyond: int
) -> npt.NDArray[np.int32]:
    """Return the cost of each cell; `UNREACHED` where no path leads, or the wave did not come.

    It stops `beyond` units after it has come to the cell `until` (iy, ix), if that is not off the
    grid; the cells at its edge then have the cost of a path, which may not be the cheapest.

    Cells are numbered in a grid with one more row and column on each side, `_OUTSIDE` like all
    blocked cells, so that steps need no bounds check. A cell is pushed each time it gets cheaper,
    and ignored when it turns up in a bucket later than its last cost says.
    """
    rows, cols = weights.shape
    stride = cols + 2
    best = np.empty((rows + 2) * stride, dtype=np.int32)
    heavy = np.empty((rows + 2) * stride, dtype=np.uint8)
    _pad(weights, best, heavy)
    buckets = np.empty((_BUCKETS, 256), dtype=np.int32)
    filled = np.zeros(_BUCKETS, dtype=np.int64)
    for k in range(len(starts)):
        cell = (starts[k, 0] + 1) * stride + starts[k, 1] + 1
        if best[cell] != 0:
            buckets = _with_room(buckets, filled, 1)
            best[cell] = 0
            buckets[0, filled[0]] = cell
            filled[0] += 1
    wanted = 0  # the corner of the border, where no wave comes
    if 0 <= until[0] < rows and 0 <= until[1] < cols:
        wanted = (until[0] + 1) * stride + until[1] + 1
    cost = idle = 0
    end = np.int64(UNREACHED)
    while idle < _BUCKETS and cost <= end:
        slot = cost & (_BUCKETS - 1)
        idle += 1
        if filled[slot] > 0:
            buckets = _with_room(buckets, filled, 8 * filled[slot])
            _settle(best, heavy, buckets, filled, cost, stride)
            filled[slot] = idle = 0
        if cost == best[wanted]:
            end = np.int64(cost + beyond)
        cost += 1
    return _unpadded(best, rows, cols)


@compiled
def _pad(
    weights: npt.NDArray[np.uint8], best: npt.NDArray[np.int32], heavy: npt.NDArray[np.uint8]
) -> None:
    """Fill the padded arrays before a wave; row by row in slices, so that registers are used."""
    rows, cols = weights.shape
    stride = cols + 2
    for edge in (0, (rows + 1) * stride):
        best[edge : edge + stride] = _OUTSIDE
        heavy[edge : edge + stride] = BLOCKED
    for iy in range(rows):
        base = (iy + 1) * stride
        best[base] = best[base + cols + 1] = _OUTSIDE
        heavy[base] = heavy[base + cols + 1] = BLOCKED
        line = weights[iy]
        costs, kinds = best[base + 1 : base + 1 + cols], heavy[base + 1 : base + 1 + cols]
        for ix in range(cols):
            kinds[ix] = line[ix] if line[ix] < MAX_WEIGHT else MAX_WEIGHT
        for ix in range(cols):
            costs[ix] = UNREACHED if line[ix] != BLOCKED else _OUTSIDE


@compiled
def _with_room(
    buckets: npt.NDArray[np.int32], filled: npt.NDArray[np.int64], pushes: int
) -> npt.NDArray[np.int32]:
    """Return the buckets, made larger if any of them could not take so many more cells."""
    capacity = buckets.shape[1]
    needed = filled.max() + pushes
    if needed <= capacity:
        return buckets
    larger = np.empty((_BUCKETS, max(2 * capacity, needed)), dtype=np.int32)
    larger[:, :capacity] = buckets
    return larger


@compiled
def _settle(
    best: npt.NDArray[np.int32],
    heavy: npt.NDArray[np.uint8],
    buckets: npt.NDArray[np.int32],
    filled: npt.NDArray[np.int64],
    cost: int,
    stride: int,
) -> None:
    """Let the wave step on from every cell that costs `cost`.

    Every step costs something, and less than the ring is long: this bucket does not grow meanwhile.
    Indices are unsigned because signed ones cost a test for negative values at each access.
    """
    straight = (-stride, -1, 1, stride)
    up, side = (-stride, -stride, stride, stride), (-1, 1, -1, 1)
    capacity = buckets.shape[1]
    entries = buckets.reshape(-1)
    first = (cost & (_BUCKETS - 1)) * capacity
    for k in range(first, first + filled[cost & (_BUCKETS - 1)]):
        cell = np.int64(entries[np.uint64(k)])
        if best[np.uint64(cell)] != cost:
            continue  # it has become cheaper since it was put here
        for way in range(4):
            other = np.uint64(cell + straight[way])
            reached = cost + STRAIGHT_STEP * np.int64(heavy[other])
            if reached < best[other]:
                best[other] = reached
                goal = np.uint64(reached & (_BUCKETS - 1))
                entries[np.uint64(goal * capacity + filled[goal])] = other
                filled[goal] += 1
        for way in range(4):
            other = np.uint64(cell + up[way] + side[way])
            reached = cost + DIAGONAL_STEP * np.int64(heavy[other])
            if (
                reached < best[other]
                and heavy[np.uint64(cell + up[way])] != BLOCKED
                and heavy[np.uint64(cell + side[way])] != BLOCKED
            ):
                best[other] = reached
                goal = np.uint64(reached & (_BUCKETS - 1))
                entries[np.uint64(goal * capacity + filled[goal])] = other
                filled[goal] += 1


@compiled
def _unpadded(best: npt.NDArray[np.int32], rows: int, cols: int) -> npt.NDArray[np.int32]:
    """Return the wave's array without its border, blocked cells as `UNREACHED`."""
    units = np.empty((rows, cols), dtype=np.int32)
    for iy in range(rows):
        base = (iy + 1) * (cols + 2) + 1
        costs, line = best[base : base + cols], units[iy]
        for ix in range(cols):
            line[ix] = UNREACHED if costs[ix] == _OUTSIDE else costs[ix]
    return units
