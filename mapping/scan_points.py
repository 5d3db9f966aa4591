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

# Far away, where a wall is met at a slant, the next end point on it lies farther off than that.
# Two end points in a row belong to one surface if no beam meets it flatter than this [rad] ...
FLATTEST = math.radians(7.0)
# ... and three in a row if they scatter about a line by no more than this [m].
SCATTER = 0.04

# The neighbours on one side alone must fit a line this much better than those on both sides
# (ratio of variances) for a corner.
CORNER = 0.4


def scan_points(scan: LaserScan) -> Floats:
    """Return where the beams hit and which way the surfaces there face, base frame.

    Returns:
        (N, 4): x, y [m] and the unit normal of the surface, pointing towards the laser. An end
        point without neighbours is taken to face the laser. Kept with the scan, and read-only.
    """
    if scan.found_points:
        return scan.found_points[0]
    T_base_laser = scan.T_base_laser
    points = _hit_points(
        scan.ranges,
        scan.bearing_start,
        scan.bearing_step,
        scan.range_max,
        (T_base_laser.x, T_base_laser.y, T_base_laser.theta),
    )
    _fit_normals(points, T_base_laser.x, T_base_laser.y)
    points.flags.writeable = False
    scan.found_points.append(points)
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
    """Fit a line through the neighbours of each end point; put its normal beside it.

    Where the line through the neighbours on both sides fits badly, there is a corner: then the
    better of the two sides alone counts. An end point without near neighbours may still lie on a
    wall that the beams meet at a slant. That wall faces sideways; taken to face the laser, half of
    all such walls would count as seen from behind, and be matched with their other face.
    """
    for i in range(points.shape[0]):
        to_x, to_y = laser_x - points[i, 0], laser_y - points[i, 1]
        distance = math.sqrt(to_x * to_x + to_y * to_y)
        nx, ny = (to_x / distance, to_y / distance) if distance > 0.0 else (1.0, 0.0)
        count, angle, width = _fit_line(points, i, NEIGHBOURS, NEIGHBOURS)
        if count >= 3:
            for before, after in ((NEIGHBOURS, 0), (0, NEIGHBOURS)):
                beams, side_angle, side_width = _fit_line(points, i, before, after)
                if beams >= 3 and side_width < CORNER * width:
                    angle, width = side_angle, side_width / CORNER
            nx, ny = -math.sin(angle), math.cos(angle)
        else:
            slanted, angle = _fit_slanted(points, i, laser_x, laser_y)
            if slanted:
                nx, ny = -math.sin(angle), math.cos(angle)
        if nx * to_x + ny * to_y < 0.0:
            nx, ny = -nx, -ny
        points[i, 2], points[i, 3] = nx, ny


@compiled
def _fit_slanted(points: Floats, i: int, laser_x: float, laser_y: float) -> tuple[bool, float]:
    """Return whether end point `i` lies on a slanted wall, and the wall's direction [rad].

    Of the three end points in a row with `i` among them those count that fit a line best.
    """
    best, angle = SCATTER * SCATTER, math.nan
    for first in range(max(0, i - 2), min(i, points.shape[0] - 3) + 1):
        if _joined(points, first, laser_x, laser_y) and _joined(
            points, first + 1, laser_x, laser_y
        ):
            direction, scatter = _line_of_three(points, first)
            if scatter < best:
                best, angle = scatter, direction
    return not math.isnan(angle), angle


@compiled
def _joined(points: Floats, i: int, laser_x: float, laser_y: float) -> bool:
    """Whether end points `i` and `i` + 1 may lie on one surface, by how flat a beam would meet it.

    Source: Borges & Aldon 2004, "Line extraction in 2D range images for mobile robotics", the
    adaptive breakpoint detector.
    """
    ax, ay = points[i, 0] - laser_x, points[i, 1] - laser_y
    dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
    distance = math.sqrt(dx * dx + dy * dy)
    # The sine of the angle between surface and beam, times both lengths.
    across = abs(ax * dy - ay * dx)
    joined: bool = across >= math.sin(FLATTEST) * distance * math.sqrt(ax * ax + ay * ay)
    return joined


@compiled
def _line_of_three(points: Floats, first: int) -> tuple[float, float]:
    """Return direction [rad] and scatter across [m^2] of the line through three end points."""
    sx = sy = sxx = sxy = syy = 0.0
    for j in range(first, first + 3):
        x, y = points[j, 0] - points[first, 0], points[j, 1] - points[first, 1]
        sx += x
        sy += y
        sxx += x * x
        sxy += x * y
        syy += y * y
    cxx, cxy, cyy = sxx - sx * sx / 3.0, sxy - sx * sy / 3.0, syy - sy * sy / 3.0
    half = 0.5 * (cxx - cyy)
    scatter = 0.5 * (cxx + cyy) - math.sqrt(half * half + cxy * cxy)
    return 0.5 * math.atan2(2.0 * cxy, cxx - cyy), scatter


@compiled
def _fit_line(points: Floats, i: int, before: int, after: int) -> tuple[int, float, float]:
    """Fit a line through end point `i` and its neighbours in the order of the beams.

    Returns:
        Number of points, direction of the line [rad], and the variance across it [m^2].
    """
    x0, y0 = points[i, 0], points[i, 1]
    n = 0
    sx = sy = sxx = sxy = syy = 0.0
    for j in range(max(0, i - before), min(points.shape[0], i + after + 1)):
        x, y = points[j, 0] - x0, points[j, 1] - y0
        if x * x + y * y <= NEIGHBOURHOOD * NEIGHBOURHOOD:
            n += 1
            sx += x
            sy += y
            sxx += x * x
            sxy += x * y
            syy += y * y
    cxx, cxy, cyy = sxx / n - sx * sx / n / n, sxy / n - sx * sy / n / n, syy / n - sy * sy / n / n
    half = 0.5 * (cxx - cyy)
    width = 0.5 * (cxx + cyy) - math.sqrt(half * half + cxy * cxy)
    free = n - 2 if n > 2 else 1
    return n, 0.5 * math.atan2(2.0 * cxy, cxx - cyy), max(width, 0.0) * n / free
