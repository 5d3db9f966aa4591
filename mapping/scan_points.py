"""End points of a scan with the directions their surfaces face."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.scan import LaserScan

# A surface's direction is fitted to the end points within this distance [m]: a few times the range
# noise, less than a door leaf ...
NEIGHBOURHOOD = 0.25
# ... and at most this many beams to either side, which bounds the work close to walls.
NEIGHBOURS = 12


def scan_points(scan: LaserScan) -> Floats:
    """Return where the beams hit and which way the surfaces there face, base frame.

    Returns:
        (N, 4): x, y [m] and the unit normal of the surface, pointing towards the laser. An end
        point without neighbours is taken to face the laser.
    """
    T_base_laser = scan.T_base_laser
    points = _hit_points(
        scan.ranges,
        scan.bearing_start,
        scan.bearing_step,
        scan.range_max,
        (T_base_laser.x, T_base_laser.y, T_base_laser.theta),
    )
    _fit_normals(points, T_base_laser.x, T_base_laser.y)
    return points


def turned_points(points_base: Floats, T_map_base: Pose2) -> Floats:
    """Return points with normals (N, 4) in the map frame."""
    return _turned(points_base, T_map_base.x, T_map_base.y, T_map_base.theta)


@compiled
def _turned(points: Floats, x: float, y: float, theta: float) -> Floats:
    """Return points with normals (N, 4) in the frame in which their own lies at (x, y, theta)."""
    c, s = math.cos(theta), math.sin(theta)
    turned = np.empty_like(points)
    for i in range(points.shape[0]):
        turned[i, 0] = x + c * points[i, 0] - s * points[i, 1]
        turned[i, 1] = y + s * points[i, 0] + c * points[i, 1]
        turned[i, 2] = c * points[i, 2] - s * points[i, 3]
        turned[i, 3] = s * points[i, 2] + c * points[i, 3]
    return turned


@compiled
def _hit_points(
    ranges: npt.NDArray[np.float32],
    start: float,
    step: float,
    range_max: float,
    pose: tuple[float, float, float],
) -> Floats:
    """Return (N, 4): end points [m] of the beams that hit, and room for the normals."""
    points = np.zeros((len(ranges), 4))
    count = 0
    for i in range(len(ranges)):
        if 0.0 < ranges[i] < range_max:
            bearing = pose[2] + start + step * i
            points[count, 0] = pose[0] + ranges[i] * math.cos(bearing)
            points[count, 1] = pose[1] + ranges[i] * math.sin(bearing)
            count += 1
    return points[:count]


@compiled
def _fit_normals(points: Floats, laser_x: float, laser_y: float) -> None:
    """Fit a line through the neighbours of each end point; put its normal beside it."""
    count = points.shape[0]
    for i in range(count):
        x0, y0 = points[i, 0], points[i, 1]
        n = 0
        sx = sy = sxx = sxy = syy = 0.0
        for j in range(max(0, i - NEIGHBOURS), min(count, i + NEIGHBOURS + 1)):
            x, y = points[j, 0] - x0, points[j, 1] - y0
            if x * x + y * y <= NEIGHBOURHOOD * NEIGHBOURHOOD:
                n += 1
                sx += x
                sy += y
                sxx += x * x
                sxy += x * y
                syy += y * y
        to_x, to_y = laser_x - x0, laser_y - y0
        distance = math.sqrt(to_x * to_x + to_y * to_y)
        nx, ny = (to_x / distance, to_y / distance) if distance > 0.0 else (1.0, 0.0)
        if n >= 3:
            cxx, cxy, cyy = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
            angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
            nx, ny = -math.sin(angle), math.cos(angle)
            if nx * to_x + ny * to_y < 0.0:
                nx, ny = -nx, -ny
        points[i, 2], points[i, 3] = nx, ny
