"""Walls of many maps at once: what end points say of each cell, in tiles the maps share.

A cell keeps the sums of the end points whose solid it is, and of the directions their surfaces
face: what `SurfaceMap` keeps, too. But a particle's map is written to far more often than it is
read at any one place, so no surfels and no table of closest walls are kept up: the line through
the cells around is fitted when an end point asks for it.

Source: Biber & Strasser 2003 (normal distributions), Censi 2008 (distances point to line).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.shared_tiles import Ids, find_cell, own_tile
from mapping.surface_map import layer_of
from mapping.surfel_fitting import FEW_CELLS, FEW_HITS

# Fields of a cell: number of end points, sums of their offsets from the cell's centre [m] and of
# the directions their surfaces face, and the number of the scan the first one came with.
HITS, OFFSET_X, OFFSET_Y, FACING_X, FACING_Y, FIRST = range(6)
FIELDS = 6


@compiled
def add_end_points(
    points: Floats,
    pose: tuple[float, float, float],
    lattice: tuple[float, float, float],
    depth: float,
    now: float,
    table: Ids,
    pool: npt.NDArray[np.float32],
    references: Ids,
    free: Ids,
) -> None:
    """Add the end points of one scan to one map.

    Args:
        points: (N, 4) end points [m] and the directions their surfaces face, base frame.
        pose: (x, y, theta) of the base, map frame.
        lattice: (corner x, corner y, resolution) [m], map frame.
        depth: an end point belongs to the cell this far behind its surface [m].
        now: number of the scan.
        table: (layers, rows, cols) int32 of the map; see `SharedTiles` for the rest.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for i in range(points.shape[0]):
        x = pose[0] + c * points[i, 0] - s * points[i, 1]
        y = pose[1] + s * points[i, 0] + c * points[i, 1]
        nx = c * points[i, 2] - s * points[i, 3]
        ny = s * points[i, 2] + c * points[i, 3]
        iy = int(math.floor((y - depth * ny - lattice[1]) / lattice[2]))
        ix = int(math.floor((x - depth * nx - lattice[0]) / lattice[2]))
        layer = layer_of(nx, ny)
        tile = own_tile(table, layer, iy, ix, pool, references, free)
        if tile < 0:
            continue
        _, place = find_cell(table, layer, iy, ix)
        cell = pool[tile, place]
        if cell[HITS] == 0.0:
            cell[FIRST] = now
        cell[HITS] += 1.0
        cell[OFFSET_X] += x - (lattice[0] + (ix + 0.5) * lattice[2])
        cell[OFFSET_Y] += y - (lattice[1] + (iy + 0.5) * lattice[2])
        cell[FACING_X] += nx
        cell[FACING_Y] += ny


@compiled
def find_surfels(
    points: Floats,
    pose: Floats,
    lattice: tuple[float, float, float],
    depth: float,
    table: Ids,
    pool: npt.NDArray[np.float32],
    reach: int,
    radius: int,
    doubt: float,
    now: float,
    ratios: tuple[float, float],
    cells: Ids,
    surfels: Floats,
) -> None:
    """Find for each end point the closest piece of wall that faces its way.

    Args:
        points: (N, 4), base frame, as for `add_end_points`; `pose` (3,), `lattice`, `depth` alike.
        table: (layers, rows, cols) int32 of the map.
        pool: its tiles.
        reach: how far walls are looked for [cells].
        radius: the line is fitted to the cells up to this far [cells].
        doubt: see `SurfaceSettings.doubt`.
        now: number of scans taken in.
        ratios: `SurfaceSettings.line_below` and `blob_above`.
        cells: (N, 3) int32, the layer and cell each point was last looked up in, -1 at first;
            changed here. What is still in the same cell keeps its surfel.
        surfels: (N, 6), changed here: point [m], matrix and trust, see `perceptual_model`; a trust
            of -1 says that there is no wall.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for i in range(points.shape[0]):
        nx = c * points[i, 2] - s * points[i, 3]
        ny = s * points[i, 2] + c * points[i, 3]
        x = pose[0] + c * points[i, 0] - s * points[i, 1] - depth * nx
        y = pose[1] + s * points[i, 0] + c * points[i, 1] - depth * ny
        iy = int(math.floor((y - lattice[1]) / lattice[2]))
        ix = int(math.floor((x - lattice[0]) / lattice[2]))
        layer = layer_of(nx, ny)
        if cells[i, 0] == layer and cells[i, 1] == iy and cells[i, 2] == ix:
            continue
        cells[i, 0], cells[i, 1], cells[i, 2] = layer, iy, ix
        found, wall_y, wall_x = _closest_wall(table, pool, layer, iy, ix, reach)
        if found:
            _fit_surfel(
                table, pool, layer, wall_y, wall_x, lattice, radius, doubt, now, ratios, surfels[i]
            )
        else:
            surfels[i, 5] = -1.0


@compiled
def _closest_wall(
    table: Ids, pool: npt.NDArray[np.float32], layer: int, iy: int, ix: int, reach: int
) -> tuple[bool, int, int]:
    """Return whether there is a wall cell within `reach`, and the closest one's row and column."""
    best, best_y, best_x = reach * reach + 1, 0, 0
    for ring in range(reach + 1):
        if ring * ring >= best:
            break
        for dy in range(-ring, ring + 1):
            stride = 1 if abs(dy) == ring or ring == 0 else 2 * ring
            for dx in range(-ring, ring + 1, stride):
                far = dy * dy + dx * dx
                if far < best:
                    tile, place = find_cell(table, layer, iy + dy, ix + dx)
                    if tile >= 0 and pool[tile, place, HITS] > 0.0:
                        best, best_y, best_x = far, iy + dy, ix + dx
    return best <= reach * reach, best_y, best_x


@compiled
def _fit_surfel(
    table: Ids,
    pool: npt.NDArray[np.float32],
    layer: int,
    cell_y: int,
    cell_x: int,
    lattice: tuple[float, float, float],
    radius: int,
    doubt: float,
    now: float,
    ratios: tuple[float, float],
    surfel: Floats,
) -> None:
    """Fit a line to the end points around a wall cell, as `surfel_fitting` does."""
    tile, place = find_cell(table, layer, cell_y, cell_x)
    own = pool[tile, place]
    hits = float(own[HITS])
    facing_x, facing_y = own[FACING_X] / hits, own[FACING_Y] / hits
    x0, y0 = own[OFFSET_X] / hits, own[OFFSET_Y] / hits
    neighbours = 0
    n = sx = sy = sxx = sxy = syy = 0.0
    first = now
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            tile, place = find_cell(table, layer, cell_y + dy, cell_x + dx)
            if tile < 0 or pool[tile, place, HITS] == 0.0:
                continue
            cell = pool[tile, place]
            count = float(cell[HITS])
            # Around a corner the other wall must not bend the line: it counts less.
            agree = (facing_x * cell[FACING_X] + facing_y * cell[FACING_Y]) / count
            if agree <= 0.0:
                continue
            w = count * agree * agree
            neighbours += 1
            first = min(first, float(cell[FIRST]))
            x = dx * lattice[2] + cell[OFFSET_X] / count - x0
            y = dy * lattice[2] + cell[OFFSET_Y] / count - y0
            n += w
            sx += w * x
            sy += w * y
            sxx += w * x * x
            sxy += w * x * y
            syy += w * y * y
    mx, my = sx / n, sy / n
    cxx, cxy, cyy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
    half = 0.5 * (cxx - cyy)
    spread = math.sqrt(half * half + cxy * cxy)
    middle = 0.5 * (cxx + cyy)
    ratio = (middle - spread) / (middle + spread) if middle + spread > 1e-9 else 1.0
    blob = min(1.0, max(0.0, (ratio - ratios[0]) / (ratios[1] - ratios[0])))
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
    nx, ny = -math.sin(angle), math.cos(angle)
    # A blob sits at its own cell's mean, a line passes through the mean of all.
    surfel[0] = lattice[0] + (cell_x + 0.5) * lattice[2] + x0 + (1.0 - blob) * mx
    surfel[1] = lattice[1] + (cell_y + 0.5) * lattice[2] + y0 + (1.0 - blob) * my
    surfel[2] = nx * nx + blob * ny * ny
    surfel[3] = nx * ny * (1.0 - blob)
    surfel[4] = ny * ny + blob * nx * nx
    seen = min(n, now - first + 1.0)
    surfel[5] = 0.0 if neighbours < FEW_CELLS and n < FEW_HITS else seen / (seen + doubt)
