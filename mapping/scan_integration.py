"""Fusing laser scans into an occupancy grid.

Per scan every cell changes at most once: it is *hit* when at least as many beams end in it as pass
through it, else *missed*. An end point lies on a surface, the solid is what lies behind: so a beam
ends half a cell behind its end point, and a cell counts as a wall when most of it is one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.beam_votes import cast_votes
from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.grid import OccupancyGrid
from mapping.scan import LaserScan
from mapping.scan_points import scan_points, turned_points


@dataclass(frozen=True, slots=True)
class IntegrationSettings:
    """How strongly one scan speaks.

    Attributes:
        hit: log-odds added to a cell that holds an end point.
        miss: log-odds added to a cell that a beam passed through (negative).
        lowest: clamp of the log-odds of clear cells; keeps the map able to change its mind.
        highest: clamp of the log-odds of occupied cells.
        depth: a beam ends this far behind the surface it hits, along the surface's normal
            [cells]: a thin wall seen from both its sides is drawn once, in its middle.
        clear_margin: a beam clears cells up to this distance before its end point [m], so that
            range noise does not eat the wall.
        fill_between: whether the space between two neighbouring beams counts as seen as far as the
            shorter one, so that a few scans leave no comb of unseen cells far out. Cells that
            count as occupied are neither cleared nor passed that way. And two neighbouring end
            points within `surface_gap` are taken to lie on one surface, without holes, wherever
            nothing was seen to be free.
        surface_gap: see `fill_between` [m]; less than any opening a robot could pass.
    """

    hit: float = 0.9
    miss: float = -0.6
    lowest: float = -4.0
    highest: float = 4.0
    depth: float = 0.5
    clear_margin: float = 0.02
    fill_between: bool = False
    surface_gap: float = 0.3


def beam_ends(scan: LaserScan, T_map_base: Pose2) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Return where the beams end, and which of them hit something.

    Beams to ignore are left out; a beam without a return ends at `range_max`.

    Returns:
        ends: (N, 2) [m], map frame.
        hits: (N,) bool.
    """
    T_map_laser = T_map_base @ scan.T_base_laser
    return _beam_ends(
        scan.ranges,
        scan.bearing_start,
        scan.bearing_step,
        scan.range_max,
        (T_map_laser.x, T_map_laser.y, T_map_laser.theta),
    )


@compiled
def _beam_ends(
    ranges: npt.NDArray[np.float32],
    start: float,
    step: float,
    range_max: float,
    pose: tuple[float, float, float],
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Return ends (N, 2) [m] of the beams of a laser at `pose`, and which of them hit."""
    ends = np.empty((len(ranges), 2))
    hits = np.empty(len(ranges), dtype=np.bool_)
    count = 0
    for i in range(len(ranges)):
        if ranges[i] > 0.0:
            hits[count] = ranges[i] < range_max
            reach = min(float(ranges[i]), range_max)
            bearing = pose[2] + start + step * i
            ends[count, 0] = pose[0] + reach * math.cos(bearing)
            ends[count, 1] = pose[1] + reach * math.sin(bearing)
            count += 1
    return ends[:count], hits[:count]


def scan_extent(
    scan: LaserScan, T_map_base: Pose2, behind: float = 0.0
) -> tuple[float, float, float, float]:
    """Return the rectangle (x_min, y_min, x_max, y_max) [m] that a scan touches, map frame.

    Args:
        scan: the scan.
        T_map_base: where it was taken.
        behind: how far behind its end points a scan changes cells, too [m].
    """
    T_map_laser = T_map_base @ scan.T_base_laser
    ends, _ = beam_ends(scan, T_map_base)
    x_min, y_min, x_max, y_max = _extent(ends, T_map_laser.x, T_map_laser.y)
    return x_min - behind, y_min - behind, x_max + behind, y_max + behind


@compiled
def _extent(ends: Floats, x: float, y: float) -> tuple[float, float, float, float]:
    """Return the rectangle around a laser at (x, y) and the ends of its beams [m]."""
    x_min = x_max = x
    y_min = y_max = y
    for i in range(ends.shape[0]):
        x_min, x_max = min(x_min, ends[i, 0]), max(x_max, ends[i, 0])
        y_min, y_max = min(y_min, ends[i, 1]), max(y_max, ends[i, 1])
    return x_min, y_min, x_max, y_max


def integrate_scan(
    grid: OccupancyGrid,
    scan: LaserScan,
    T_map_base: Pose2,
    settings: IntegrationSettings | None = None,
    keep_above: float = math.inf,
    points_map: Floats | None = None,
) -> CellBox:
    """Fuse one scan into `grid.log_odds`, in place; return the box of cells it may have changed.

    The grid is never grown here: what lies outside is left out. Call
    `grid.grow(*scan_extent(scan, T_map_base, depth))` first to keep everything.

    Args:
        grid: the map so far, in the map frame.
        scan: a beam without a return clears cells up to `range_max`; a range of 0 is ignored.
        T_map_base: pose of the robot when the scan was taken.
        settings: how strongly one scan speaks; the defaults if not given.
        keep_above: cells with log-odds above this are walls that beams neither erase nor see
            through; used where the pose is too uncertain to argue with the map.
        points_map: (N, 4) end points [m] and the directions their surfaces face, if they are known
            already, see `scan_points`.

    Source: Moravec & Elfes 1985; Thrun, Burgard & Fox, *Probabilistic Robotics* (2005), Table 9.1.
    """
    settings = settings or IntegrationSettings()
    geometry = grid.geometry
    ends, hits = beam_ends(scan, T_map_base)
    T_map_laser = T_map_base @ scan.T_base_laser
    box = geometry.box_around(*_extent(ends, T_map_laser.x, T_map_laser.y)).dilated(
        1, geometry.shape
    )
    if box.empty:
        return EMPTY_BOX
    if points_map is None:
        points_map = turned_points(scan_points(scan), T_map_base)
    between = _ends_between(scan, settings, geometry.resolution)
    cast_votes(
        grid.log_odds,
        ends,
        hits,
        solid_points(points_map, settings.depth * geometry.resolution),
        T_map_laser.apply(between),
        T_map_laser.x,
        T_map_laser.y,
        (geometry.origin_x, geometry.origin_y, geometry.resolution),
        (box.iy0, box.ix0, box.iy1, box.ix1),
        (settings.hit, settings.miss, settings.lowest, settings.highest),
        settings.clear_margin,
        keep_above,
        settings.surface_gap if settings.fill_between else 0.0,
    )
    return box


def _ends_between(scan: LaserScan, settings: IntegrationSettings, resolution: float) -> Floats:
    """Return where rays between the beams end, (N, 2) [m], laser frame; none if not asked for."""
    if not settings.fill_between:
        return np.zeros((0, 2))
    return _rays_between(
        scan.ranges,
        scan.bearing_start,
        scan.bearing_step,
        scan.range_max,
        resolution,
        settings.clear_margin,
    )


@compiled
def solid_points(points: Floats, depth: float) -> Floats:
    """Return the points (N, 2) [m] that lie `depth` [m] behind end points (N, 4) with normals."""
    solid = np.empty((points.shape[0], 2))
    for i in range(points.shape[0]):
        solid[i, 0] = points[i, 0] - depth * points[i, 2]
        solid[i, 1] = points[i, 1] - depth * points[i, 3]
    return solid


@compiled
def _rays_between(
    ranges: npt.NDArray[np.float32],
    start: float,
    step: float,
    range_max: float,
    resolution: float,
    margin: float,
) -> Floats:
    """Return the ends (N, 2) [m] of rays that close the gaps between beams, laser frame.

    Neighbouring rays are at most a cell apart at their ends; each is as long as the shorter of
    the two beams beside it, less the margin. A beam to be ignored closes no gap.
    """
    count = 0
    for i in range(len(ranges) - 1):
        reach = min(min(ranges[i], ranges[i + 1]), range_max) - margin
        if reach > 0.0:
            count += max(math.ceil(abs(step) * reach / resolution) - 1, 0)
    ends = np.empty((count, 2))
    k = 0
    for i in range(len(ranges) - 1):
        reach = min(min(ranges[i], ranges[i + 1]), range_max) - margin
        if reach > 0.0:
            gaps = max(math.ceil(abs(step) * reach / resolution), 1)
            for j in range(1, gaps):
                bearing = start + step * (i + j / gaps)
                ends[k, 0], ends[k, 1] = reach * math.cos(bearing), reach * math.sin(bearing)
                k += 1
    return ends
