"""End points of a scan with the directions their surfaces face."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.scan import LaserScan

# Columns of an array of points: position (x, y) [m], direction (x, y) that the surface faces, and
# the squared cosine of the angle between that direction and the beam.
COLUMNS = 5

# A surface's direction is fitted to the end points within this distance [m]: a few times the range
# noise, less than a door leaf ...
NEIGHBOURHOOD = 0.25
# ... or this many times the gap to the nearer neighbour, if that is more: far out on a wall seen at
# a grazing angle end points lie far apart ...
GAPS = 2.5
# ... as long as the gap, divided by the range and the angle between two beams, stays below this,
# which means angles above five degrees. Wider gaps lie between different things.
WIDEST_GAP = 11.0
# At most this many beams to either side count, which bounds the work close to walls.
NEIGHBOURS = 12

# The neighbours on one side alone must fit a line this much better than those on both sides
# (ratio of variances) for a corner.
CORNER = 0.4


def scan_points(scan: LaserScan) -> Floats:
    """Return where the beams hit and which way the surfaces there face, base frame.

    Returns:
        (N, 5): x, y [m]; the unit normal of the surface, pointing towards the laser; the squared
        cosine between normal and beam. An end point without neighbours is taken to face the laser.
    """
    T_base_laser = scan.T_base_laser
    points = _hit_points(
        scan.ranges,
        scan.bearing_start,
        scan.bearing_step,
        scan.range_max,
        (T_base_laser.x, T_base_laser.y, T_base_laser.theta),
    )
    _fit_normals(points, T_base_laser.x, T_base_laser.y, abs(scan.bearing_step))
    return points


def turned_points(points_base: Floats, T_map_base: Pose2) -> Floats:
    """Return points with normals (N, 5) in the map frame."""
    return _turned(points_base, T_map_base.x, T_map_base.y, T_map_base.theta)


@compiled
def _turned(points: Floats, x: float, y: float, theta: float) -> Floats:
    """Return points with normals (N, 5) in the frame in which their own lies at (x, y, theta)."""
    c, s = math.cos(theta), math.sin(theta)
    turned = np.empty_like(points)
    for i in range(points.shape[0]):
        turned[i, 0] = x + c * points[i, 0] - s * points[i, 1]
        turned[i, 1] = y + s * points[i, 0] + c * points[i, 1]
        turned[i, 2] = c * points[i, 2] - s * points[i, 3]
        turned[i, 3] = s * points[i, 2] + c * points[i, 3]
        turned[i, 4] = points[i, 4]
    return turned


@compiled
def _hit_points(
    ranges: npt.NDArray[np.float32],
    start: float,
    step: float,
    range_max: float,
    pose: tuple[float, float, float],
) -> Floats:
    """Return (N, 5): end points [m] of the beams that hit, and room for the rest."""
    points = np.zeros((len(ranges), COLUMNS))
    count = 0
    for i in range(len(ranges)):
        if 0.0 < ranges[i] < range_max:
            bearing = pose[2] + start + step * i
            points[count, 0] = pose[0] + ranges[i] * math.cos(bearing)
            points[count, 1] = pose[1] + ranges[i] * math.sin(bearing)
            count += 1
    return points[:count]


@compiled
def _fit_normals(points: Floats, laser_x: float, laser_y: float, step: float) -> None:
    """Fit a line through the neighbours of each end point; put its normal beside it.

    Where the line through the neighbours on both sides fits badly, there is a corner: then the
    better of the two sides alone counts.
    """
    before, after, both = np.empty(6), np.empty(6), np.empty(6)
    for i in range(points.shape[0]):
        to_x, to_y = laser_x - points[i, 0], laser_y - points[i, 1]
        distance = math.sqrt(to_x * to_x + to_y * to_y)
        to_x, to_y = (to_x / distance, to_y / distance) if distance > 0.0 else (1.0, 0.0)
        nx, ny = to_x, to_y
        reach = _reach(points, i, WIDEST_GAP * step * distance)
        _gather(points, i, -1, reach, before)
        _gather(points, i, 1, reach, after)
        both[:] = before + after
        both[0] -= 1.0
        if both[0] >= 3.0:
            nx, ny, width = _normal(both)
            for side in (before, after):
                side_x, side_y, side_width = _normal(side)
                if side[0] >= 3.0 and side_width < CORNER * width:
                    nx, ny, width = side_x, side_y, side_width / CORNER
            if nx * to_x + ny * to_y < 0.0:
                nx, ny = -nx, -ny
        points[i, 2], points[i, 3] = nx, ny
        points[i, 4] = (nx * to_x + ny * to_y) ** 2


@compiled
def _reach(points: Floats, i: int, widest: float) -> float:
    """Return how far away the neighbours of end point `i` may be [m]."""
    gap = math.inf
    for j in (i - 1, i + 1):
        if 0 <= j < points.shape[0]:
            gap = min(gap, math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]))
    return max(NEIGHBOURHOOD, GAPS * gap) if gap < widest else NEIGHBOURHOOD


@compiled
def _gather(points: Floats, i: int, direction: int, reach: float, sums: Floats) -> None:
    """Sum (1, x, y, xx, xy, yy) over end point `i` and its neighbours on one side of it."""
    sums[:] = 0.0
    sums[0] = 1.0
    for k in range(1, NEIGHBOURS + 1):
        j = i + direction * k
        if not 0 <= j < points.shape[0]:
            return
        x, y = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        if x * x + y * y <= reach * reach:
            sums[0] += 1.0
            sums[1] += x
            sums[2] += y
            sums[3] += x * x
            sums[4] += x * y
            sums[5] += y * y


@compiled
def _normal(sums: Floats) -> tuple[float, float, float]:
    """Return the unit normal of the line through some points, and the variance across it [m^2]."""
    n = sums[0]
    mx, my = sums[1] / n, sums[2] / n
    cxx, cxy, cyy = sums[3] / n - mx * mx, sums[4] / n - mx * my, sums[5] / n - my * my
    half = 0.5 * (cxx - cyy)
    spread = math.sqrt(half * half + cxy * cxy)
    width = max(0.5 * (cxx + cyy) - spread, 0.0) * n / max(n - 2.0, 1.0)
    # Across the line: the eigenvector of the smaller eigenvalue, from the better conditioned row.
    nx, ny = (-cxy, half + spread) if half >= 0.0 else (-(spread - half), cxy)
    size = math.sqrt(nx * nx + ny * ny)
    if size == 0.0:
        return 0.0, 1.0, width
    return nx / size, ny / size, width
