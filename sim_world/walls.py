"""Walls as line segments, sorted into a grid of square buckets so that hundreds stay cheap.

A solid body (a thick wall, a box, a pillar) is a convex polygon whose edges are segments; a bare
segment is a wall without thickness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats

Indices = npt.NDArray[np.int64]

# About the width of a corridor: a beam crosses a dozen buckets, a bucket holds a few segments.
BUCKET_SIZE = 1.0
# Segments are entered in every bucket they touch within this margin [m], so that a wall which lies
# exactly on the line between two buckets is found from both sides.
_MARGIN = 1e-6


@dataclass(frozen=True, slots=True)
class Walls:
    """Every segment of a world and where to find it.

    Attributes:
        segments: (M, 4) as x1, y1, x2, y2 [m], world frame.
        solid_starts: (S + 1,) int64; rows `solid_starts[k]:solid_starts[k + 1]` of `segments` are
            the edges of convex solid k, counter-clockwise; rows after the last are bare segments.
        origin: (2,) corner of the first bucket [m].
        bucket_size: edge of a bucket [m].
        bucket_rows: buckets along +y.
        bucket_cols: buckets along +x.
        bucket_starts: (rows * cols + 1,) int64, each bucket's first entry in `bucket_items`.
        bucket_items: int64, rows of `segments`.
    """

    segments: Floats
    solid_starts: Indices
    origin: Floats
    bucket_size: float
    bucket_rows: int
    bucket_cols: int
    bucket_starts: Indices
    bucket_items: Indices

    @property
    def bare(self) -> Floats:
        """The segments that belong to no solid, (B, 4) [m]."""
        return self.segments[int(self.solid_starts[-1]) :]

    def solid(self, k: int) -> Floats:
        """Return the corners (K, 2) [m] of solid k, counter-clockwise."""
        return self.segments[int(self.solid_starts[k]) : int(self.solid_starts[k + 1]), :2]

    @property
    def solid_count(self) -> int:
        """How many solids there are."""
        return len(self.solid_starts) - 1

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """(x_min, y_min, x_max, y_max) [m] of all segments; zeros when there is none."""
        if len(self.segments) == 0:
            return 0.0, 0.0, 0.0, 0.0
        xs, ys = self.segments[:, 0::2], self.segments[:, 1::2]
        return float(xs.min()), float(ys.min()), float(xs.max()), float(ys.max())


def build_walls(
    solids: Sequence[npt.ArrayLike],
    bare_segments: npt.ArrayLike = (),
    bucket_size: float = BUCKET_SIZE,
) -> Walls:
    """Return the walls for convex solids and bare segments, ready for rays.

    Args:
        solids: corners (K, 2) [m] of each convex solid, in either sense of turning.
        bare_segments: (B, 4) as x1, y1, x2, y2 [m].
        bucket_size: edge of a bucket [m].
    """
    rings = [_counter_clockwise(np.asarray(solid, dtype=np.float64)) for solid in solids]
    edges = [np.hstack((ring, np.roll(ring, -1, axis=0))) for ring in rings]
    bare = np.asarray(bare_segments, dtype=np.float64).reshape(-1, 4)
    segments = np.ascontiguousarray(np.vstack([*edges, bare]))
    solid_starts = np.cumsum([0, *(len(ring) for ring in rings)], dtype=np.int64)
    if len(segments) == 0:
        lower, upper = np.zeros(2), np.zeros(2)
    else:
        ends = segments.reshape(-1, 2)
        lower, upper = ends.min(axis=0), ends.max(axis=0)
    origin = lower - 2.0 * _MARGIN
    cols, rows = (max(1, math.ceil(v)) for v in (upper + 2.0 * _MARGIN - origin) / bucket_size)
    counts = np.zeros(rows * cols + 1, dtype=np.int64)
    no_items = np.empty(0, dtype=np.int64)
    _enter(segments, origin[0], origin[1], bucket_size, rows, cols, counts, no_items)
    bucket_starts = np.concatenate(([0], np.cumsum(counts[:-1])))
    items = np.empty(int(bucket_starts[-1]), dtype=np.int64)
    _enter(
        segments, origin[0], origin[1], bucket_size, rows, cols, bucket_starts[:-1].copy(), items
    )
    return Walls(segments, solid_starts, origin, bucket_size, rows, cols, bucket_starts, items)


def _counter_clockwise(corners: Floats) -> Floats:
    """Return the corners (K, 2) in counter-clockwise order."""
    following = np.roll(corners, -1, axis=0)
    doubled_area = float((corners[:, 0] * following[:, 1] - following[:, 0] * corners[:, 1]).sum())
    return corners if doubled_area >= 0.0 else corners[::-1]


@compiled
def _enter(
    segments: Floats,
    origin_x: float,
    origin_y: float,
    size: float,
    rows: int,
    cols: int,
    next_free: Indices,
    items: Indices,
) -> None:
    """Enter each segment in every bucket it touches; with empty `items` only count, in place."""
    filling = len(items) > 0
    half = 0.5 * size
    for k in range(segments.shape[0]):
        x1, y1, x2, y2 = segments[k, 0], segments[k, 1], segments[k, 2], segments[k, 3]
        normal_x, normal_y = y1 - y2, x2 - x1
        length = math.hypot(normal_x, normal_y)
        reach = half * (abs(normal_x) + abs(normal_y)) + _MARGIN * length
        ix0 = max(math.floor((min(x1, x2) - _MARGIN - origin_x) / size), 0)
        ix1 = min(math.floor((max(x1, x2) + _MARGIN - origin_x) / size), cols - 1)
        iy0 = max(math.floor((min(y1, y2) - _MARGIN - origin_y) / size), 0)
        iy1 = min(math.floor((max(y1, y2) + _MARGIN - origin_y) / size), rows - 1)
        for iy in range(iy0, iy1 + 1):
            for ix in range(ix0, ix1 + 1):
                centre_x = origin_x + (ix + 0.5) * size
                centre_y = origin_y + (iy + 0.5) * size
                if abs(normal_x * (centre_x - x1) + normal_y * (centre_y - y1)) <= reach:
                    bucket = iy * cols + ix
                    if filling:
                        items[next_free[bucket]] = k
                    next_free[bucket] += 1


def clearance(walls: Walls, x: float, y: float, limit: float) -> float:
    """Return the distance [m] from a point to the nearest wall, at most `limit`; 0 in a solid."""
    found: float = _clearance(
        walls.segments,
        walls.solid_starts,
        walls.origin[0],
        walls.origin[1],
        walls.bucket_size,
        walls.bucket_rows,
        walls.bucket_cols,
        walls.bucket_starts,
        walls.bucket_items,
        x,
        y,
        limit,
    )
    return found


@compiled
def _clearance(
    segments: Floats,
    solid_starts: Indices,
    origin_x: float,
    origin_y: float,
    size: float,
    rows: int,
    cols: int,
    bucket_starts: Indices,
    bucket_items: Indices,
    x: float,
    y: float,
    limit: float,
) -> float:
    if _in_solid(segments, solid_starts, x, y):
        return 0.0
    nearest = limit * limit
    ix0 = max(math.floor((x - limit - origin_x) / size), 0)
    ix1 = min(math.floor((x + limit - origin_x) / size), cols - 1)
    iy0 = max(math.floor((y - limit - origin_y) / size), 0)
    iy1 = min(math.floor((y + limit - origin_y) / size), rows - 1)
    for iy in range(iy0, iy1 + 1):
        for ix in range(ix0, ix1 + 1):
            bucket = iy * cols + ix
            for entry in range(bucket_starts[bucket], bucket_starts[bucket + 1]):
                k = bucket_items[entry]
                squared = _squared_distance(
                    segments[k, 0], segments[k, 1], segments[k, 2], segments[k, 3], x, y
                )
                nearest = min(nearest, squared)
    return math.sqrt(nearest)


@compiled
def _squared_distance(x1: float, y1: float, x2: float, y2: float, x: float, y: float) -> float:
    """Return the squared distance [m2] from a point to a segment."""
    along_x, along_y = x2 - x1, y2 - y1
    squared_length = along_x * along_x + along_y * along_y
    share = 0.0
    if squared_length > 0.0:
        share = ((x - x1) * along_x + (y - y1) * along_y) / squared_length
        share = min(max(share, 0.0), 1.0)
    off_x, off_y = x - (x1 + share * along_x), y - (y1 + share * along_y)
    return off_x * off_x + off_y * off_y


@compiled
def _in_solid(segments: Floats, solid_starts: Indices, x: float, y: float) -> bool:
    """Whether a point lies in a convex solid: left of, or on, every one of its edges."""
    for solid in range(len(solid_starts) - 1):
        inside = True
        for k in range(solid_starts[solid], solid_starts[solid + 1]):
            x1, y1 = segments[k, 0], segments[k, 1]
            if (segments[k, 2] - x1) * (y - y1) - (segments[k, 3] - y1) * (x - x1) < 0.0:
                inside = False
                break
        if inside:
            return True
    return False
