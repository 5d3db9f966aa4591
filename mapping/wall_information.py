"""How firmly the straight walls in a scan hold its pose, and nothing else.

A match's own information is made of the map's surfels. Where a map is young their directions are
noisy, and far along a wall, where end points lie scattered, they look like posts: both seem to hold
a robot along a bare wall, a little by each beam and firmly by all. A constraint that outlives its
map must not claim that. So here the directions come from the scan itself, from pieces of wall long
enough to tell them well; end points that are part of no such piece say nothing.

Source: Censi 2007, "An accurate closed-form estimate of ICP's covariance", for point to line.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.match_map import MatchMap
from mapping.scan import LaserScan
from mapping.surface_map import layer_of

# A piece of wall is the end points within this distance of one of them [m] ...
PIECE = 0.6
# ... at least so many, among so many beams to either side ...
PIECE_POINTS = 5
PIECE_BEAMS = 24
# ... whose variance across is below this share of that along.
PIECE_RATIO = 0.05

# Share of the strongest information that may be an echo of noise, and the distance at which a turn
# counts like a shift [m].
UNSEEN_SHARE = 0.02
LEVER = 3.0


def firm_part(information: Floats) -> Floats:
    """Return information (3, 3) lowered in all directions by a small share of the strongest.

    The directions of pieces of wall are a little off, so each seems to hold a little along itself.
    """
    scale = np.outer((1.0, 1.0, LEVER), (1.0, 1.0, LEVER))
    strengths, directions = np.linalg.eigh(information / scale)
    kept = np.maximum(strengths - UNSEEN_SHARE * strengths[2], 0.0)
    firm: Floats = (directions * kept) @ directions.T * scale
    return firm


def wall_information(map_: MatchMap, scan: LaserScan, T_map_base: Pose2) -> Floats:
    """Return the information (3, 3) of (x, y, theta), map frame, that a scan's walls give.

    Args:
        map_: the map that the scan was matched with.
        scan: the scan.
        T_map_base: where it fits.
    """
    T_map_laser = T_map_base @ scan.T_base_laser
    settings, geometry = map_.settings.matching.perception, map_.grid.geometry
    return _information(
        scan.ranges,
        (scan.bearing_start, scan.bearing_step, scan.range_max),
        (T_map_laser.x, T_map_laser.y, T_map_laser.theta),
        (T_map_base.x, T_map_base.y),
        map_.surfaces.closest,
        map_.surfaces.surfels,
        (geometry.origin_x, geometry.origin_y, geometry.resolution),
        settings.sigma,
    )


@compiled
def _information(
    ranges: npt.NDArray[np.float32],
    beams: tuple[float, float, float],
    laser: tuple[float, float, float],
    base: tuple[float, float],
    closest: npt.NDArray[np.int32],
    surfels: Floats,
    lattice: tuple[float, float, float],
    sigma: float,
) -> Floats:
    """Sum the information of the end points that lie at a wall of the map and on one of the scan.

    Args:
        beams: first bearing, step [rad] and reach [m].
        laser: its pose, map frame.
        base: where the robot is, map frame.
    """
    _, rows, cols = closest.shape
    count = len(ranges)
    points = np.full((count, 2), np.nan)
    for i in range(count):
        if 0.0 < ranges[i] < beams[2]:
            bearing = laser[2] + beams[0] + beams[1] * i
            points[i, 0] = laser[0] + ranges[i] * math.cos(bearing)
            points[i, 1] = laser[1] + ranges[i] * math.sin(bearing)
    information = np.zeros((3, 3))
    row = np.empty(3)
    for i in range(count):
        x, y = points[i, 0], points[i, 1]
        if math.isnan(x):
            continue
        on_wall, nx, ny = _piece(points, i)
        if not on_wall:
            continue
        if nx * (laser[0] - x) + ny * (laser[1] - y) < 0.0:
            nx, ny = -nx, -ny
        ix = int(math.floor((x - lattice[0]) / lattice[2]))
        iy = int(math.floor((y - lattice[1]) / lattice[2]))
        if not (0 <= ix < cols and 0 <= iy < rows):
            continue
        k = closest[layer_of(nx, ny), iy, ix]
        if k < 0:
            continue
        off = nx * (x - surfels[k, 0]) + ny * (y - surfels[k, 1])
        if abs(off) > 3.0 * sigma:
            continue
        row[0], row[1] = nx, ny
        row[2] = ny * (x - base[0]) - nx * (y - base[1])
        for a in range(3):
            for b in range(3):
                information[a, b] += row[a] * row[b] / (sigma * sigma)
    return information


@compiled
def _piece(points: Floats, i: int) -> tuple[bool, float, float]:
    """Return whether end point `i` is part of a straight piece of wall, and the wall's normal."""
    n = 0
    sx = sy = sxx = sxy = syy = 0.0
    for j in range(max(0, i - PIECE_BEAMS), min(points.shape[0], i + PIECE_BEAMS + 1)):
        x, y = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        if x * x + y * y <= PIECE * PIECE:  # false for beams that did not return
            n += 1
            sx += x
            sy += y
            sxx += x * x
            sxy += x * y
            syy += y * y
    if n < PIECE_POINTS:
        return False, 0.0, 0.0
    cxx, cxy, cyy = sxx / n - sx * sx / n / n, sxy / n - sx * sy / n / n, syy / n - sy * sy / n / n
    half = 0.5 * (cxx - cyy)
    spread = math.sqrt(half * half + cxy * cxy)
    middle = 0.5 * (cxx + cyy)
    if middle - spread > PIECE_RATIO * (middle + spread):
        return False, 0.0, 0.0
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
    return True, -math.sin(angle), math.cos(angle)
