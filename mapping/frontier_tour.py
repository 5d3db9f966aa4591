"""Rounds through many frontiers: what going somewhere first does to the length of all the rest.

A robot that leaves a small corner unseen has to come back for it. To weigh that, the ways *between*
places are needed, not only those from the robot. They are read off the one wave that told the costs
from the robot: the cheapest ways from it form a tree, and the way between two places through the
point where theirs part is an upper bound, exact where rooms hang on corridors. Places in sight of
one another take the straight way.

Source: the upper bound is ours; rounds by nearest neighbour and 2-opt, Croes 1958.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import Cells
from mapping.path_planning import CostField, step_down
from mapping.path_smoothing import line_care

_Indices = npt.NDArray[np.int64]
_PASSES = 8  # of 2-opt; rounds of some tens of places settle in fewer


def ways_between(
    field: CostField, weights: npt.NDArray[np.uint8], cells: npt.ArrayLike, sight: float
) -> Floats:
    """Return about how long the ways between places are, (N, N) [m], as `CostField` counts.

    Args:
        field: costs from the robot.
        weights: (rows, cols) uint8, those the field was made with.
        cells: (N, 2), reachable places.
        sight: places up to this far apart [m] are tried for a straight way.
    """
    places = np.asarray(cells, dtype=np.int64).reshape(-1, 2)
    lengths = _tree_ways(field.units, places).astype(np.float64) * field.metres_per_unit
    _shorten(lengths, np.ascontiguousarray(weights), places, sight / field.resolution,
             field.resolution)  # fmt: skip
    return lengths


def round_lengths(between: Floats, first: Floats, beyond: Floats, wanted: _Indices) -> Floats:
    """Return for each place how long a short round is that begins there, (N,) [m].

    Args:
        between: (N, N) [m] ways between places.
        first: (N,) [m] ways from the robot.
        beyond: (N,) [m] what has to be driven beyond each place and back, once there, before the
            round goes on; nothing of it counts at the round's end.
        wanted: (M,) the places that every round visits.
    """
    return _round_lengths(between, first, beyond, wanted)


@compiled
def _tree_ways(units: npt.NDArray[np.int32], cells: Cells) -> npt.NDArray[np.int64]:
    """Return the lengths [units] of the ways between cells along the tree of ways from the start.

    Each way is followed down to the start or to the first cell of an earlier one: its parent. It
    leaves its parent's at the cost of that cell.
    """
    count = len(cells)
    parent = np.full(count, -1, dtype=np.int64)
    branch = np.zeros(count, dtype=np.int64)
    owner = np.full(units.shape, -1, dtype=np.int32)
    for k in range(count):
        iy, ix, dy, dx = cells[k, 0], cells[k, 1], 0, 0
        while owner[iy, ix] < 0:
            owner[iy, ix] = k
            dy, dx = step_down(units, iy, ix, dy, dx)
            if dy == 0 and dx == 0:
                break
            iy, ix = iy + dy, ix + dx
        if owner[iy, ix] != k:
            parent[k] = owner[iy, ix]
            branch[k] = units[iy, ix]
    ways = np.zeros((count, count), dtype=np.int64)
    for j in range(count):
        for k in range(j):
            a, b = j, k
            cost_a, cost_b = (
                int(units[cells[a, 0], cells[a, 1]]),
                int(units[cells[b, 0], cells[b, 1]]),
            )
            total = cost_a + cost_b
            while a != b:
                if a > b:
                    cost_a, a = min(cost_a, branch[a]), parent[a]
                else:
                    cost_b, b = min(cost_b, branch[b]), parent[b]
            shared = min(cost_a, cost_b) if a >= 0 else 0
            ways[j, k] = ways[k, j] = total - 2 * shared
    return ways


@compiled
def _shorten(
    lengths: Floats, weights: npt.NDArray[np.uint8], cells: Cells, sight: float, resolution: float
) -> None:
    """Lower lengths (N, N) [m] by straight ways up to `sight` [cells], and by going over others."""
    count = len(cells)
    for j in range(count):
        for k in range(j):
            if math.hypot(cells[j, 0] - cells[k, 0], cells[j, 1] - cells[k, 1]) <= sight:
                cost, _ = line_care(weights, cells[j, 0], cells[j, 1], cells[k, 0], cells[k, 1])
                lengths[j, k] = lengths[k, j] = min(lengths[j, k], cost * resolution)
    for over in range(count):  # Floyd 1962
        for j in range(count):
            for k in range(count):
                way = lengths[j, over] + lengths[over, k]
                lengths[j, k] = min(lengths[j, k], way)


@compiled
def _round_lengths(between: Floats, first: Floats, beyond: Floats, wanted: _Indices) -> Floats:
    """Compiled body of `round_lengths`."""
    lengths = np.empty(len(first))
    order = np.empty(len(wanted) + 1, dtype=np.int64)
    for j in range(len(first)):
        count = _nearest_neighbours(between, wanted, j, order)
        total = first[j]
        for i in range(count):
            total += beyond[order[i]]
        lengths[j] = total + _improved(between, beyond, order[:count])
    return lengths


@compiled
def _nearest_neighbours(between: Floats, wanted: _Indices, start: int, order: _Indices) -> int:
    """Fill `order` with a round from `start` through all that is wanted; return its length."""
    count = 1
    order[0] = start
    for k in wanted:
        if k != start:
            order[count] = k
            count += 1
    for i in range(1, count):
        nearest = i
        for k in range(i + 1, count):
            if between[order[i - 1], order[k]] < between[order[i - 1], order[nearest]]:
                nearest = k
        order[i], order[nearest] = order[nearest], order[i]
    return count


@compiled
def _improved(between: Floats, beyond: Floats, order: _Indices) -> float:
    """Shorten an open round by 2-opt, in place; return its length less what lies beyond its end."""
    count = len(order)
    for _ in range(_PASSES):
        better = False
        for i in range(1, count - 1):
            for j in range(i + 1, count):
                before, a, b = order[i - 1], order[i], order[j]
                gain = between[before, a] - between[before, b]
                if j + 1 < count:
                    gain += between[b, order[j + 1]] - between[a, order[j + 1]]
                else:
                    gain += beyond[a] - beyond[b]
                if gain > 1e-9:
                    order[i : j + 1] = order[i : j + 1][::-1].copy()
                    better = True
        if not better:
            break
    total: float = -beyond[order[count - 1]]
    for i in range(1, count):
        total += between[order[i - 1], order[i]]
    return total
