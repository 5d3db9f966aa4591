"""Exact rays against walls, grids and discs, compiled.

All rays of one call start at one point of the world frame; ranges are in metres, and a ray that
meets nothing within `range_max` has exactly `range_max`.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_cdt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.grid import GridGeometry
from sim_world.walls import Indices, Walls

# A ray may pass a segment's end by this share of its length and still hit, so that none slips
# through the corner between two joined walls.
_END_SLACK = 1e-9


def cast_segments(walls: Walls, T_world_laser: Pose2, bearings: Floats, range_max: float) -> Floats:
    """Return the exact ranges (beams,) [m] to walls.

    Args:
        walls: the segments with their buckets.
        T_world_laser: where the rays start; bearings count from its heading.
        bearings: (beams,) [rad].
        range_max: reach [m].

    Source: Amanatides & Woo 1987, over the buckets.
    """
    ranges = np.empty(len(bearings))
    _cast_segments(
        walls.segments,
        walls.origin[0],
        walls.origin[1],
        walls.bucket_size,
        walls.bucket_rows,
        walls.bucket_cols,
        walls.bucket_starts,
        walls.bucket_items,
        T_world_laser.x,
        T_world_laser.y,
        T_world_laser.theta,
        bearings,
        range_max,
        ranges,
    )
    return ranges


@compiled
def _cast_segments(
    segments: Floats,
    origin_x: float,
    origin_y: float,
    size: float,
    rows: int,
    cols: int,
    bucket_starts: Indices,
    bucket_items: Indices,
    x: float,
    y: float,
    theta: float,
    bearings: Floats,
    range_max: float,
    ranges: Floats,
) -> None:
    for beam in range(len(bearings)):
        dx, dy = math.cos(theta + bearings[beam]), math.sin(theta + bearings[beam])
        per_x, per_y = _inverse(dx), _inverse(dy)
        ahead_x, ahead_y = (1 if dx > 0.0 else 0), (1 if dy > 0.0 else 0)
        nearest = range_max
        t_in, t_out = _clip(x - origin_x, y - origin_y, dx, dy, cols * size, rows * size)
        t_out = min(t_out, range_max)
        if t_in > t_out:  # never in reach; for a ray all but parallel to the walls even infinite
            ranges[beam] = range_max
            continue
        ix = min(max(math.floor((x + t_in * dx - origin_x) / size), 0), cols - 1)
        iy = min(max(math.floor((y + t_in * dy - origin_y) / size), 0), rows - 1)
        t = t_in
        while t <= t_out and t < nearest and 0 <= ix < cols and 0 <= iy < rows:
            bucket = iy * cols + ix
            for entry in range(bucket_starts[bucket], bucket_starts[bucket + 1]):
                k = bucket_items[entry]
                hit = _meet(
                    segments[k, 0] - x,
                    segments[k, 1] - y,
                    segments[k, 2] - x,
                    segments[k, 3] - y,
                    dx,
                    dy,
                )
                nearest = min(nearest, hit)
            t_x = (origin_x + (ix + ahead_x) * size - x) * per_x if dx != 0.0 else math.inf
            t_y = (origin_y + (iy + ahead_y) * size - y) * per_y if dy != 0.0 else math.inf
            t = min(t_x, t_y)
            if t_x <= t_y:
                ix += 2 * ahead_x - 1
            else:
                iy += 2 * ahead_y - 1
        ranges[beam] = nearest


@compiled
def _inverse(direction: float) -> float:
    """Return 1 / direction; 0 for a ray parallel to an axis, whose lines it never meets."""
    return 0.0 if direction == 0.0 else 1.0 / direction


@compiled
def _clip(
    x: float, y: float, dx: float, dy: float, width: float, height: float
) -> tuple[float, float]:
    """Return where a ray enters and leaves the rectangle (0, 0, width, height); in > out: never."""
    t_in, t_out = 0.0, math.inf
    if dx != 0.0:
        t_in = max(t_in, min(-x / dx, (width - x) / dx))
        t_out = min(t_out, max(-x / dx, (width - x) / dx))
    elif x < 0.0 or x > width:
        t_out = -1.0
    if dy != 0.0:
        t_in = max(t_in, min(-y / dy, (height - y) / dy))
        t_out = min(t_out, max(-y / dy, (height - y) / dy))
    elif y < 0.0 or y > height:
        t_out = -1.0
    return t_in, t_out


@compiled
def _meet(x1: float, y1: float, x2: float, y2: float, dx: float, dy: float) -> float:
    """Return how far along a ray from (0, 0) a segment lies; infinite when they do not meet."""
    along_x, along_y = x2 - x1, y2 - y1
    turn = dx * along_y - dy * along_x
    offset = x1 * dy - y1 * dx
    if abs(turn) <= 1e-12 * (abs(along_x) + abs(along_y)):
        if abs(offset) > 1e-12:
            return math.inf
        # The ray runs along the segment itself: it ends at the nearer end, or where it stands.
        t1, t2 = x1 * dx + y1 * dy, x2 * dx + y2 * dy
        if max(t1, t2) < 0.0:
            return math.inf
        return max(min(t1, t2), 0.0)
    share = offset / turn
    t = (x1 * along_y - y1 * along_x) / turn
    if t < 0.0 or share < -_END_SLACK or share > 1.0 + _END_SLACK:
        return math.inf
    return t


def cast_grid(
    clear_rings: npt.NDArray[np.uint8],
    geometry: GridGeometry,
    T_world_laser: Pose2,
    bearings: Floats,
    range_max: float,
) -> Floats:
    """Return the exact ranges (beams,) [m] to solid cells; all outside the grid is solid.

    A ray ends where it enters the solid cell. Cells are walked one by one near walls; where
    `clear_rings` promises open space, the ray jumps.

    Args:
        clear_rings: (rows, cols) uint8 from `clear_rings_of`.
        geometry: where the cells are.
        T_world_laser: where the rays start; bearings count from its heading.
        bearings: (beams,) [rad].
        range_max: reach [m].

    Source: Amanatides & Woo 1987.
    """
    ranges = np.empty(len(bearings))
    _cast_grid(
        clear_rings,
        geometry.origin_x,
        geometry.origin_y,
        geometry.resolution,
        T_world_laser.x,
        T_world_laser.y,
        T_world_laser.theta,
        bearings,
        range_max,
        ranges,
    )
    return ranges


def clear_rings_of(solid: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """Return for each cell its distance to the nearest solid one in king's moves, at most 255.

    Args:
        solid: (rows, cols) bool; all outside the grid counts as solid too.
    """
    free = np.pad(~solid, 1, constant_values=False)
    rings = distance_transform_cdt(free, metric="chessboard")[1:-1, 1:-1]
    return np.ascontiguousarray(np.minimum(rings, 255).astype(np.uint8))


@compiled
def _cast_grid(
    clear_rings: npt.NDArray[np.uint8],
    origin_x: float,
    origin_y: float,
    resolution: float,
    x: float,
    y: float,
    theta: float,
    bearings: Floats,
    range_max: float,
    ranges: Floats,
) -> None:
    rows, cols = clear_rings.shape
    # In units of cells, from the grid's corner.
    start_x, start_y = (x - origin_x) / resolution, (y - origin_y) / resolution
    t_max = range_max / resolution
    for beam in range(len(bearings)):
        dx, dy = math.cos(theta + bearings[beam]), math.sin(theta + bearings[beam])
        per_x, per_y = _inverse(dx), _inverse(dy)
        stride = 1.0 / max(abs(dx), abs(dy))
        ahead_x, ahead_y = (1 if dx > 0.0 else 0), (1 if dy > 0.0 else 0)
        ix, iy = math.floor(start_x), math.floor(start_y)
        t = 0.0
        while t < t_max:
            if ix < 0 or iy < 0 or ix >= cols or iy >= rows:
                break
            rings = clear_rings[iy, ix]
            if rings == 0:
                break
            if rings > 2:
                # All cells less than `rings` king's moves away are free: no ray can leave them in
                # `rings - 1` strides of one cell along its faster axis.
                t += (rings - 1) * stride
                ix = math.floor(start_x + t * dx)
                iy = math.floor(start_y + t * dy)
                continue
            t_x = (ix + ahead_x - start_x) * per_x if dx != 0.0 else math.inf
            t_y = (iy + ahead_y - start_y) * per_y if dy != 0.0 else math.inf
            if t_x <= t_y:
                t = max(t, t_x)
                ix += 2 * ahead_x - 1
            else:
                t = max(t, t_y)
                iy += 2 * ahead_y - 1
        ranges[beam] = min(t * resolution, range_max) if t < t_max else range_max


def cast_discs(discs: Floats, T_world_laser: Pose2, bearings: Floats, range_max: float) -> Floats:
    """Return the exact ranges (beams,) [m] to the nearest of some discs; 0 from inside one.

    Args:
        discs: (D, 3) as centre x, y and radius [m], world frame.
        T_world_laser: where the rays start; bearings count from its heading.
        bearings: (beams,) [rad].
        range_max: reach [m].
    """
    ranges = np.empty(len(bearings))
    pose = T_world_laser
    _cast_discs(discs, pose.x, pose.y, pose.theta, bearings, range_max, ranges)
    return ranges


@compiled
def _cast_discs(
    discs: Floats,
    x: float,
    y: float,
    theta: float,
    bearings: Floats,
    range_max: float,
    ranges: Floats,
) -> None:
    ranges[:] = range_max
    cosines, sines = np.cos(theta + bearings), np.sin(theta + bearings)
    for k in range(discs.shape[0]):
        off_x, off_y, radius = discs[k, 0] - x, discs[k, 1] - y, discs[k, 2]
        beyond = off_x * off_x + off_y * off_y - radius * radius
        if beyond <= 0.0:
            ranges[:] = 0.0
            return
        if math.hypot(off_x, off_y) - radius >= range_max:
            continue
        for beam in range(len(bearings)):
            along = off_x * cosines[beam] + off_y * sines[beam]
            inner = along * along - beyond
            if along > 0.0 and inner >= 0.0:
                ranges[beam] = min(ranges[beam], along - math.sqrt(inner))
