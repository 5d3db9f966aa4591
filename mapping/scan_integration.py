"""Fusing laser scans into an occupancy grid.

Per scan every cell changes at most once: it is *hit* when an end point lies in it, else *missed*
when a beam passes through it. Hits win, so beams that graze a wall on their way do not erase it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.grid import EMPTY_BOX, CellBox, OccupancyGrid
from mapping.scan import LaserScan


@dataclass(frozen=True, slots=True)
class IntegrationSettings:
    """How strongly one scan speaks.

    Attributes:
        hit: log-odds added to a cell that holds an end point.
        miss: log-odds added to a cell that a beam passed through (negative).
        lowest: clamp of the log-odds of clear cells; keeps the map able to change its mind.
        highest: clamp of the log-odds of occupied cells.
        clear_margin: a beam clears cells up to this distance before its end point [m]: about one
            cell, so that range noise does not eat the wall, yet the cell in front of it is cleared.
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
    clear_margin: float = 0.05
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


def scan_extent(scan: LaserScan, T_map_base: Pose2) -> tuple[float, float, float, float]:
    """Return the rectangle (x_min, y_min, x_max, y_max) [m] that a scan touches, map frame."""
    T_map_laser = T_map_base @ scan.T_base_laser
    ends, _ = beam_ends(scan, T_map_base)
    return _extent(ends, T_map_laser.x, T_map_laser.y)


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
) -> CellBox:
    """Fuse one scan into `grid.log_odds`, in place; return the box of cells it may have changed.

    The grid is never grown here: what lies outside is left out. Call
    `grid.grow(*scan_extent(scan, T_map_base))` first to keep everything.

    Args:
        grid: the map so far, in the map frame.
        scan: a beam without a return clears cells up to `range_max`; a range of 0 is ignored.
        T_map_base: pose of the robot when the scan was taken.
        settings: how strongly one scan speaks; the defaults if not given.
        keep_above: cells with log-odds above this are walls that beams neither erase nor see
            through; used where the pose is too uncertain to argue with the map.

    Source: Moravec & Elfes 1985; Thrun, Burgard & Fox, *Probabilistic Robotics* (2005), Table 9.1.
    """
    settings = settings or IntegrationSettings()
    geometry = grid.geometry
    ends, hits = beam_ends(scan, T_map_base)
    T_map_laser = T_map_base @ scan.T_base_laser
    box = geometry.box_around(*_extent(ends, T_map_laser.x, T_map_laser.y))
    if box.empty:
        return EMPTY_BOX
    between = np.zeros((0, 2))
    if settings.fill_between:
        rays = _rays_between(
            scan.ranges,
            scan.bearing_start,
            scan.bearing_step,
            scan.range_max,
            geometry.resolution,
            settings.clear_margin,
        )
        between = T_map_laser.apply(rays)
    _integrate(
        grid.log_odds,
        ends,
        hits,
        between,
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


@compiled
def _integrate(
    log_odds: npt.NDArray[np.float32],
    ends: Floats,
    hits: npt.NDArray[np.bool_],
    between: Floats,
    x0: float,
    y0: float,
    lattice: tuple[float, float, float],
    box: tuple[int, int, int, int],
    weights: tuple[float, float, float, float],
    margin: float,
    keep_above: float,
    surface_gap: float,
) -> None:
    """Update the cells of one scan: first all hits, then the beams' misses on cells not yet seen.

    Args:
        lattice: (origin_x, origin_y, resolution) [m].
        between: (M, 2) ends [m] of rays that clear what is not occupied, map frame.
        box: (iy0, ix0, iy1, ix1), the cells that may change.
        weights: (hit, miss, lowest, highest) log-odds.
    """
    origin_x, origin_y, resolution = lattice
    iy0, ix0, iy1, ix1 = box
    hit, miss, lowest, highest = weights
    seen = np.zeros((iy1 - iy0, ix1 - ix0), dtype=np.uint8)
    for i in range(ends.shape[0]):
        if hits[i]:
            iy = int(math.floor((ends[i, 1] - origin_y) / resolution))
            ix = int(math.floor((ends[i, 0] - origin_x) / resolution))
            if iy0 <= iy < iy1 and ix0 <= ix < ix1 and seen[iy - iy0, ix - ix0] == 0:
                seen[iy - iy0, ix - ix0] = 1
                log_odds[iy, ix] = min(np.float32(highest), log_odds[iy, ix] + np.float32(hit))
    for i in range(ends.shape[0] - 1):
        dx, dy = ends[i + 1, 0] - ends[i, 0], ends[i + 1, 1] - ends[i, 1]
        gap = math.sqrt(dx * dx + dy * dy)
        if hits[i] and hits[i + 1] and resolution < gap <= surface_gap:
            pieces = math.ceil(2.0 * gap / resolution)
            for j in range(1, pieces):
                iy = math.floor((ends[i, 1] + dy * j / pieces - origin_y) / resolution)
                ix = math.floor((ends[i, 0] + dx * j / pieces - origin_x) / resolution)
                if not (iy0 <= iy < iy1 and ix0 <= ix < ix1) or log_odds[iy, ix] < 0.0:
                    continue
                if seen[iy - iy0, ix - ix0] == 0:
                    seen[iy - iy0, ix - ix0] = 1
                    log_odds[iy, ix] = min(np.float32(highest), log_odds[iy, ix] + np.float32(hit))
    for i in range(ends.shape[0]):
        _clear_beam(
            log_odds,
            seen,
            (x0 - origin_x) / resolution,
            (y0 - origin_y) / resolution,
            (ends[i, 0] - x0) / resolution,
            (ends[i, 1] - y0) / resolution,
            margin / resolution if hits[i] else 0.0,
            iy0,
            ix0,
            np.float32(miss),
            np.float32(lowest),
            np.float32(keep_above),
        )
    for i in range(between.shape[0]):
        _clear_beam(
            log_odds,
            seen,
            (x0 - origin_x) / resolution,
            (y0 - origin_y) / resolution,
            (between[i, 0] - x0) / resolution,
            (between[i, 1] - y0) / resolution,
            0.0,
            iy0,
            ix0,
            np.float32(miss),
            np.float32(lowest),
            np.float32(0.0),
        )


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


@compiled
def _clear_beam(
    log_odds: npt.NDArray[np.float32],
    seen: npt.NDArray[np.uint8],
    x: float,
    y: float,
    dx: float,
    dy: float,
    margin: float,
    iy0: int,
    ix0: int,
    miss: np.float32,
    lowest: np.float32,
    keep_above: np.float32,
) -> None:
    """Walk one beam cell by cell and count a miss on every cell not yet seen in this scan.

    Args:
        x: start of the beam, in cells from the grid's origin corner; `y` alike.
        dx: from start to end of the beam, in cells; `dy` alike.
        margin: stop this many cells before the end.

    Source: Amanatides & Woo 1987.
    """
    rows, cols = seen.shape
    length = math.sqrt(dx * dx + dy * dy)
    reach = length - margin
    if reach <= 0.0:
        return
    ix, iy = int(math.floor(x)), int(math.floor(y))
    step_x = 1 if dx > 0.0 else -1
    step_y = 1 if dy > 0.0 else -1
    along_x = length / abs(dx) if dx != 0.0 else math.inf
    along_y = length / abs(dy) if dy != 0.0 else math.inf
    next_x = ((ix + 1 - x) if dx > 0.0 else (x - ix)) * along_x if dx != 0.0 else math.inf
    next_y = ((iy + 1 - y) if dy > 0.0 else (y - iy)) * along_y if dy != 0.0 else math.inf
    iy -= iy0
    ix -= ix0
    while True:
        if 0 <= iy < rows and 0 <= ix < cols and seen[iy, ix] == 0:
            value = log_odds[iy + iy0, ix + ix0]
            if value > keep_above:
                return
            seen[iy, ix] = 1
            log_odds[iy + iy0, ix + ix0] = max(lowest, value + miss)
        if next_x < next_y:
            if next_x >= reach:
                return
            next_x += along_x
            ix += step_x
        else:
            if next_y >= reach:
                return
            next_y += along_y
            iy += step_y
