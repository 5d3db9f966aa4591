"""End points of a scan with the directions their surfaces face."""

from __future__ import annotations

import math

import numpy as np

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
    points = scan.points_base()
    facing = np.empty((len(points), 4))
    _fit_normals(points, scan.T_base_laser.x, scan.T_base_laser.y, facing)
    return facing


def turned_points(points_base: Floats, T_map_base: Pose2) -> Floats:
    """Return points with normals (N, 4) in the map frame."""
    turned = np.empty_like(points_base)
    turned[:, :2] = T_map_base.apply(points_base[:, :2])
    turned[:, 2:] = Pose2(0.0, 0.0, T_map_base.theta).apply(points_base[:, 2:])
    return turned


@compiled
def _fit_normals(points: Floats, laser_x: float, laser_y: float, facing: Floats) -> None:
    """Fit a line through the neighbours of each end point; fill `facing` (N, 4)."""
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
        facing[i, 0], facing[i, 1], facing[i, 2], facing[i, 3] = x0, y0, nx, ny
