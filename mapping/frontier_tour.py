"""Routes through many frontiers: what going somewhere first does to all the rest.

A robot that passes a half seen room on its way to a large unseen one has to come back for it, or
leaves it unseen for good. To weigh that, the ways *between* places are needed, not only those from
the robot. They are read off the one wave that told the costs from the robot: the cheapest ways from
it form a tree, and the way between two places through the point where theirs part is an upper
bound, exact where rooms hang on corridors. Places in sight of one another take the straight way.

A route visits a place if what there is to gain is worth the way it makes the route longer. This
is the lookahead that Simmons et al. 2000 name as future work: "moving to a given area may
facilitate, or possibly hinder, subsequent exploration".

Source: the bound on ways is ours; routes by insertion, as for the orienteering problem (Golden,
Levy & Vohra 1987), and 2-opt (Croes 1958).
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


def values_after(
    between: Floats, gains: Floats, beyond: Floats, wanted: _Indices, worth: float
) -> Floats:
    """Return for each place what a good route is worth that goes on from there, (N,) [m2].

    The worth of a route is what it gains less `worth` for each metre of way.

    Args:
        between: (N, N) [m] ways between places.
        gains: (N,) [m2].
        beyond: (N,) [m] what has to be driven beyond each place and back, once there, before the
            route goes on; at its end nothing of it counts.
        wanted: (M,) the places that the routes may visit.
        worth: [m2 per m].
    """
    values = np.zeros(len(gains))
    if len(wanted):
        _values_after(between + beyond[:, np.newaxis], gains, beyond, wanted, worth, values)
    return values


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
def _values_after(
    steps: Floats, gains: Floats, beyond: Floats, wanted: _Indices, worth: float, values: Floats
) -> None:
    """Fill `values`; `steps` (N, N) [m] are ways between places with what lies beyond the first."""
    route = np.empty(len(wanted) + 1, dtype=np.int64)
    for start in range(len(gains)):
        route[0] = start
        count, value = _insert_all(steps, gains, wanted, worth, route)
        values[start] = value + worth * _shorten_route(steps, beyond, route[:count])


@compiled
def _insert_all(
    steps: Floats, gains: Floats, wanted: _Indices, worth: float, route: _Indices
) -> tuple[int, float]:
    """Insert into a route from route[0] what pays most, until nothing pays.

    Returns:
        Number of places on the route, and what it is worth [m2].
    """
    count, value = 1, 0.0
    on_route = np.zeros(len(gains), dtype=np.bool_)
    on_route[route[0]] = True
    while count <= len(wanted):
        best, best_place, best_at = 0.0, -1, 0
        for place in wanted:
            if on_route[place] or gains[place] <= best:
                continue
            for at in range(1, count + 1):
                longer = steps[route[at - 1], place]
                if at < count:
                    longer += steps[place, route[at]] - steps[route[at - 1], route[at]]
                if gains[place] - worth * longer > best:
                    best, best_place, best_at = gains[place] - worth * longer, place, at
        if best_place < 0:
            break
        for k in range(count, best_at, -1):
            route[k] = route[k - 1]
        route[best_at] = best_place
        on_route[best_place] = True
        count += 1
        value += best
    return count, value


@compiled
def _shorten_route(steps: Floats, beyond: Floats, route: _Indices) -> float:
    """Shorten an open route by 2-opt, in place; return by how much [m].

    Ways back are as long as ways there, so only the ends of a reversed piece change, and at the
    route's end what lies beyond its last place.
    """
    count, saved = len(route), 0.0
    for _ in range(_PASSES):
        better = False
        for i in range(1, count - 1):
            for j in range(i + 1, count):
                before, a, b = route[i - 1], route[i], route[j]
                gain = steps[before, a] - steps[before, b]
                if j + 1 < count:
                    after = route[j + 1]
                    gain += steps[b, after] - beyond[b] - steps[a, after] + beyond[a]
                else:
                    gain += beyond[a] - beyond[b]
                if gain > 1e-9:
                    route[i : j + 1] = route[i : j + 1][::-1].copy()
                    saved += gain
                    better = True
        if not better:
            break
    return saved
