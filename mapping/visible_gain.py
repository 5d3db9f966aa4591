"""What a robot may expect to see from a place: unknown area, by the chance that it is in sight.

Rays run from the place to the sensor's range and end at obstacles. What is unknown may hide a
wall: the farther a ray has come through it, the less likely it is to get on. With walls in the
unknown as likely everywhere, the chance falls off exponentially with the way through it; the length
over which it falls to 1/e is the *mean free path*.

A flood over the unknown (`mapping.information_gain`) finds much behind every hole in a wall that
was seen at a slant, as it runs round corners as far as the sensor's range goes. Through such a hole
a ray sees little.

Source: ours; the idea to weigh what is expected by occupancy probability is named by Simmons et
al. 2000, section "Constructing Bids"; the exponential is the Poisson process's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import OBSTACLE, UNKNOWN, Cells
from mapping.information_gain import NO_WEIGHT

# Rays end where they are less likely than this to get on.
_FADED = 0.03


@dataclass(frozen=True, slots=True)
class Sight:
    """How far a sensor sees.

    Attributes:
        reach: its range [cells].
        free_path: mean free path through the unknown [cells].
        rays: directions, evenly spread over the full circle: a robot turns.
    """

    reach: float
    free_path: float
    rays: int = 48


class _Fan(NamedTuple):
    """The cells that each ray from the middle of a cell passes, in order, its own left out.

    Attributes:
        cells: (N, 2) int32, offsets from that cell, ray by ray.
        areas: (N,) [cells] of the ray's sector that lie at that cell's distance.
        pass_on: (N,) chance to get through the cell if it is unknown.
        first: (rays + 1,) int64, where each ray begins in these.
    """

    cells: npt.NDArray[np.int32]
    areas: Floats
    pass_on: Floats
    first: npt.NDArray[np.int64]


def visible_gains(
    classes: npt.NDArray[np.uint8],
    weight: npt.NDArray[np.float32] | None,
    places: npt.ArrayLike,
    sight: Sight,
    enough: Floats | None = None,
) -> tuple[Floats, Cells]:
    """Return how much may be seen from each place.

    Args:
        classes: (rows, cols) uint8 of `mapping.grid` classes; off the grid all is unknown.
        weight: (rows, cols) float32, what each unknown cell counts; each counts 1 if it is empty or
            not given.
        places: (N, 2) cells, inside the grid.
        sight: how far a sensor sees.
        enough: (N,) [cells], no need to count on once a gain has come to this; without it all is
            counted.

    Returns:
        gains: (N,) [cells], the expected unknown area in sight, or some value from `enough` on.
        depends: (N, 4) int64, half open (iy0, ix0, iy1, ix1), around all cells on which the result
            depends; may reach over the grid's edge.
    """
    cells = np.asarray(places, dtype=np.int64).reshape(-1, 2)
    return _visible_gains(
        np.ascontiguousarray(classes),
        NO_WEIGHT if weight is None else np.ascontiguousarray(weight),
        cells,
        np.full(len(cells), np.inf) if enough is None else enough,
        _fan(sight),
    )


@compiled
def _visible_gains(
    classes: npt.NDArray[np.uint8],
    weight: npt.NDArray[np.float32],
    places: Cells,
    enough: Floats,
    fan: _Fan,
) -> tuple[Floats, Cells]:
    """Compiled body of `visible_gains`."""
    gains = np.zeros(len(places))
    depends = np.empty((len(places), 4), np.int64)
    for k in range(len(places)):
        depends[k, :2], depends[k, 2:] = places[k], places[k] + 1
        y, x = places[k, 0], places[k, 1]
        gains[k] = _look(classes, weight, y, x, enough[k], fan, depends[k])
    return gains, depends


@compiled
def _look(
    classes: npt.NDArray[np.uint8],
    weight: npt.NDArray[np.float32],
    y: int,
    x: int,
    enough: float,
    fan: _Fan,
    depends: npt.NDArray[np.int64],
) -> float:
    """Return what may be seen from a cell; widen `depends` (4,) by all cells looked at."""
    rows, cols = classes.shape
    gain, y0, x0, y1, x1 = 0.0, y, x, y, x
    for ray in range(len(fan.first) - 1):
        chance, iy, ix = 1.0, y, x
        for at in range(fan.first[ray], fan.first[ray + 1]):
            iy, ix = y + fan.cells[at, 0], x + fan.cells[at, 1]
            inside = 0 <= iy < rows and 0 <= ix < cols
            kind = classes[iy, ix] if inside else UNKNOWN
            if kind == OBSTACLE:
                break
            if kind == UNKNOWN:
                counts = weight[iy, ix] if inside and len(weight) > 0 else np.float32(1.0)
                gain += chance * fan.areas[at] * counts
                chance *= fan.pass_on[at]
                if chance < _FADED:
                    break
        y0, x0, y1, x1 = min(y0, iy), min(x0, ix), max(y1, iy), max(x1, ix)
        if gain >= enough:
            break
    depends[0], depends[1] = min(depends[0], y0), min(depends[1], x0)
    depends[2], depends[3] = max(depends[2], y1 + 1), max(depends[3], x1 + 1)
    return gain


@lru_cache(maxsize=8)
def _fan(sight: Sight) -> _Fan:
    """Return the rays of a sensor, worked out once."""
    sector = 2.0 * math.pi / sight.rays
    cells: list[tuple[int, int]] = []
    spans: list[tuple[float, float]] = []
    first = [0]
    for ray in range(sight.rays):
        for cell, near, far in _passed((ray + 0.5) * sector, sight.reach):
            cells.append(cell)
            spans.append((near, far))
        first.append(len(cells))
    begins, ends = np.array(spans).reshape(-1, 2).T
    return _Fan(
        np.array(cells, dtype=np.int32).reshape(-1, 2),
        0.5 * sector * (ends**2 - begins**2),
        np.exp(-(ends - begins) / sight.free_path),
        np.array(first, dtype=np.int64),
    )


def _passed(bearing: float, reach: float) -> list[tuple[tuple[int, int], float, float]]:
    """Return the cells (dy, dx) a ray passes after its first one, and from where to where.

    Across edges only: a ray that slipped through between two cells that touch at a corner would
    see through every wall drawn askew.

    Source: Amanatides & Woo 1987.
    """
    c, s = math.cos(bearing), math.sin(bearing)
    along_x, along_y = 1.0 / max(abs(c), 1e-12), 1.0 / max(abs(s), 1e-12)
    next_x, next_y = 0.5 * along_x, 0.5 * along_y
    dy = dx = 0
    passed = []
    near = min(next_x, next_y)
    while near < reach:
        if next_x < next_y:
            next_x, dx = next_x + along_x, dx + (1 if c > 0.0 else -1)
        else:
            next_y, dy = next_y + along_y, dy + (1 if s > 0.0 else -1)
        far = min(next_x, next_y, reach)
        passed.append(((dy, dx), near, far))
        near = min(next_x, next_y)
    return passed
