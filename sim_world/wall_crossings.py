"""How many walls a straight line crosses, compiled.

A wall of any thickness counts once, and so do walls that overlap where they are crossed.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import GridGeometry
from sim_world.walls import Indices, Walls

# Walls whose crossings lie closer together than this [m] are one wall made of several pieces.
_JOINT = 1e-6

# A line that comes nearer to an edge by less than this per metre, times the edge's length [m], runs
# beside it.
_PARALLEL = 1e-12


def count_walls(walls: Walls, x1: float, y1: float, x2: float, y2: float) -> int:
    """Return how many walls lie between two points [m]."""
    count: int = _count_walls(walls.segments, walls.solid_starts, x1, y1, x2, y2)
    return count


@compiled
def _count_walls(
    segments: Floats, solid_starts: Indices, x1: float, y1: float, x2: float, y2: float
) -> int:
    """Clip the line against each solid (Cyrus & Beck 1978), and join what overlaps."""
    solids = len(solid_starts) - 1
    first_bare = solid_starts[solids]
    length = math.hypot(x2 - x1, y2 - y1)
    if length == 0.0:
        return 0
    dx, dy = (x2 - x1) / length, (y2 - y1) / length
    begins = np.empty(solids + len(segments) - first_bare)
    ends = np.empty(len(begins))
    found = 0
    for solid in range(solids):
        t_in, t_out = 0.0, length
        for k in range(solid_starts[solid], solid_starts[solid + 1]):
            along_x, along_y = segments[k, 2] - segments[k, 0], segments[k, 3] - segments[k, 1]
            # Inside is left of each edge: how far left the line begins, and how fast it goes there.
            left = along_x * (y1 - segments[k, 1]) - along_y * (x1 - segments[k, 0])
            rate = along_x * dy - along_y * dx
            if rate > _PARALLEL:
                t_in = max(t_in, -left / rate)
            elif rate < -_PARALLEL:
                t_out = min(t_out, -left / rate)
            elif left < 0.0:
                t_out = -1.0
        if t_in < t_out:
            begins[found], ends[found] = t_in, t_out
            found += 1
    for k in range(first_bare, len(segments)):
        along_x, along_y = segments[k, 2] - segments[k, 0], segments[k, 3] - segments[k, 1]
        turn = dx * along_y - dy * along_x
        if abs(turn) < _PARALLEL:
            continue  # the line runs beside it
        off_x, off_y = segments[k, 0] - x1, segments[k, 1] - y1
        t = (off_x * along_y - off_y * along_x) / turn
        share = (off_x * dy - off_y * dx) / turn
        if 0.0 <= t <= length and 0.0 <= share <= 1.0:
            begins[found], ends[found] = t, t
            found += 1
    return _joined(begins[:found], ends[:found])


@compiled
def _joined(begins: Floats, ends: Floats) -> int:
    """Return how many stretches are left when those that overlap or touch are joined."""
    count, reached = 0, -math.inf
    for k in np.argsort(begins):
        if begins[k] > reached + _JOINT:
            count += 1
        reached = max(reached, ends[k])
    return count


def count_solid_runs(
    clear_rings: npt.NDArray[np.uint8],
    geometry: GridGeometry,
    x1: float,
    y1: float,
    x2: float,
    y2: float,
) -> int:
    """Return how many runs of solid cells lie between two points [m].

    Args:
        clear_rings: (rows, cols) uint8, 0 where a cell is solid, see `raycast.clear_rings_of`.
        geometry: where the cells are; cells outside stop no signal.
        x1: [m], world frame, like the others.

    Source: Amanatides & Woo 1987.
    """
    g = geometry
    count: int = _count_solid_runs(
        clear_rings,
        (x1 - g.origin_x) / g.resolution,
        (y1 - g.origin_y) / g.resolution,
        (x2 - g.origin_x) / g.resolution,
        (y2 - g.origin_y) / g.resolution,
    )
    return count


@compiled
def _count_solid_runs(
    clear_rings: npt.NDArray[np.uint8], x1: float, y1: float, x2: float, y2: float
) -> int:
    rows, cols = clear_rings.shape
    dx, dy = x2 - x1, y2 - y1
    ix, iy = math.floor(x1), math.floor(y1)
    steps = abs(math.floor(x2) - ix) + abs(math.floor(y2) - iy)
    step_x, step_y = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    per_x = 1.0 / abs(dx) if dx != 0.0 else math.inf
    per_y = 1.0 / abs(dy) if dy != 0.0 else math.inf
    t_x = ((ix + 1 - x1) if dx > 0.0 else (x1 - ix)) * per_x if dx != 0.0 else math.inf
    t_y = ((iy + 1 - y1) if dy > 0.0 else (y1 - iy)) * per_y if dy != 0.0 else math.inf
    count, inside = 0, False
    for _ in range(steps + 1):
        solid = 0 <= ix < cols and 0 <= iy < rows and clear_rings[iy, ix] == 0
        if solid and not inside:
            count += 1
        inside = solid
        if t_x <= t_y:
            t_x += per_x
            ix += step_x
        else:
            t_y += per_y
            iy += step_y
    return count
