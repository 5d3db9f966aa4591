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

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.grid import EMPTY_BOX, CellBox, OccupancyGrid
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
    box = geometry.box_around(*_extent(ends, T_map_laser.x, T_map_laser.y)).dilated(1, geometry)
    if box.empty:
        return EMPTY_BOX
    if points_map is None:
        points_map = turned_points(scan_points(scan), T_map_base)
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
        solid_points(points_map, settings.depth * geometry.resolution),
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
def solid_points(points: Floats, depth: float) -> Floats:
    """Return the points (N, 2) [m] that lie `depth` [m] behind end points (N, 4) with normals."""
    solid = np.empty((points.shape[0], 2))
    for i in range(points.shape[0]):
        solid[i, 0] = points[i, 0] - depth * points[i, 2]
        solid[i, 1] = points[i, 1] - depth * points[i, 3]
    return solid


@compiled
def _integrate(
    log_odds: npt.NDArray[np.float32],
    ends: Floats,
    hits: npt.NDArray[np.bool_],
    solid: Floats,
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
    """Let the beams of one scan vote on the cells, then update each cell once.

    Args:
        solid: (N, 2) points [m] behind the end points of the beams that hit, map frame.
        between: (M, 2) ends [m] of rays that clear what is not occupied, map frame.
        lattice: (origin_x, origin_y, resolution) [m].
        box: (iy0, ix0, iy1, ix1), the cells that may change.
        weights: (hit, miss, lowest, highest) log-odds.
    """
    resolution = lattice[2]
    iy0, ix0, iy1, ix1 = box
    x, y = (x0 - lattice[0]) / resolution, (y0 - lattice[1]) / resolution
    ended = np.zeros((iy1 - iy0, ix1 - ix0), dtype=np.uint8)
    passed = np.zeros((iy1 - iy0, ix1 - ix0), dtype=np.uint8)
    filled = np.zeros((iy1 - iy0, ix1 - ix0), dtype=np.uint8)
    corner_x, corner_y = lattice[0] + ix0 * resolution, lattice[1] + iy0 * resolution
    _count_ends(ended, solid, corner_x, corner_y, resolution)
    k = 0
    for i in range(ends.shape[0]):
        own_iy = own_ix = -1
        if hits[i]:
            own_iy = int(math.floor((solid[k, 1] - corner_y) / resolution))
            own_ix = int(math.floor((solid[k, 0] - corner_x) / resolution))
            k += 1
        _count_beam(
            log_odds, passed, x, y, (ends[i, 0] - x0) / resolution, (ends[i, 1] - y0) / resolution,
            margin / resolution if hits[i] else 0.0, iy0, ix0, own_iy, own_ix,
            np.float32(keep_above),
        )  # fmt: skip
    if surface_gap > 0.0:
        _close_surfaces(
            log_odds, ended, passed, ends, hits, solid, corner_x, corner_y, resolution, surface_gap,
            iy0, ix0,
        )  # fmt: skip
    for i in range(between.shape[0]):
        _count_beam(
            log_odds, filled, x, y, (between[i, 0] - x0) / resolution,
            (between[i, 1] - y0) / resolution, 0.0, iy0, ix0, -1, -1, np.float32(0.0),
        )  # fmt: skip
    hit, miss = np.float32(weights[0]), np.float32(weights[1])
    lowest, highest = np.float32(weights[2]), np.float32(weights[3])
    for iy in range(ended.shape[0]):
        line = log_odds[iy + iy0]
        for ix in range(ended.shape[1]):
            if ended[iy, ix] > 0 and ended[iy, ix] >= passed[iy, ix]:
                line[ix + ix0] = min(highest, line[ix + ix0] + hit)
            elif passed[iy, ix] > 0 or filled[iy, ix] > 0:
                line[ix + ix0] = max(lowest, line[ix + ix0] + miss)


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
def _count_ends(
    ended: npt.NDArray[np.uint8], solid: Floats, corner_x: float, corner_y: float, resolution: float
) -> None:
    """Count in each cell the beams that end there; (corner_x, corner_y) [m] is that of `ended`."""
    rows, cols = ended.shape
    for i in range(solid.shape[0]):
        iy = int(math.floor((solid[i, 1] - corner_y) / resolution))
        ix = int(math.floor((solid[i, 0] - corner_x) / resolution))
        if 0 <= iy < rows and 0 <= ix < cols and ended[iy, ix] < 255:
            ended[iy, ix] += 1


@compiled
def _close_surfaces(
    log_odds: npt.NDArray[np.float32],
    ended: npt.NDArray[np.uint8],
    passed: npt.NDArray[np.uint8],
    ends: Floats,
    hits: npt.NDArray[np.bool_],
    solid: Floats,
    corner_x: float,
    corner_y: float,
    resolution: float,
    surface_gap: float,
    iy0: int,
    ix0: int,
) -> None:
    """Let neighbouring beams that end close together also end in the cells between their ends.

    Cells that more than one beam passes, or that were seen to be free, are left as they are.
    """
    rows, cols = ended.shape
    k = -1
    for i in range(ends.shape[0] - 1):
        if not hits[i]:
            continue
        k += 1
        gap = math.sqrt((ends[i + 1, 0] - ends[i, 0]) ** 2 + (ends[i + 1, 1] - ends[i, 1]) ** 2)
        if not hits[i + 1] or gap <= resolution or gap > surface_gap:
            continue
        dx, dy = solid[k + 1, 0] - solid[k, 0], solid[k + 1, 1] - solid[k, 1]
        pieces = math.ceil(2.0 * gap / resolution)
        for j in range(1, pieces):
            iy = int(math.floor((solid[k, 1] + dy * j / pieces - corner_y) / resolution))
            ix = int(math.floor((solid[k, 0] + dx * j / pieces - corner_x) / resolution))
            if not (0 <= iy < rows and 0 <= ix < cols) or log_odds[iy + iy0, ix + ix0] < 0.0:
                continue
            if ended[iy, ix] == 0 and passed[iy, ix] <= 1:
                ended[iy, ix] = 1


@compiled
def _count_beam(
    log_odds: npt.NDArray[np.float32],
    passed: npt.NDArray[np.uint8],
    x: float,
    y: float,
    dx: float,
    dy: float,
    margin: float,
    iy0: int,
    ix0: int,
    own_iy: int,
    own_ix: int,
    keep_above: np.float32,
) -> None:
    """Walk one beam cell by cell and count it in every cell it passes.

    The cell it ends in, (own_iy, own_ix) of `passed`, it does not pass.

    Args:
        x: start of the beam, in cells from the grid's origin corner; `y` alike.
        dx: from start to end of the beam, in cells; `dy` alike.
        margin: stop this many cells before the end.

    Source: Amanatides & Woo 1987.
    """
    rows, cols = passed.shape
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
        if 0 <= iy < rows and 0 <= ix < cols:
            if log_odds[iy + iy0, ix + ix0] > keep_above:
                return
            if passed[iy, ix] < 255 and not (iy == own_iy and ix == own_ix):
                passed[iy, ix] += 1
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
