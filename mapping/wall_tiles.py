"""Walls of many maps at once: what end points say of each cell, in tiles the maps share.

A cell keeps the sums of the end points whose solid it is, as in `SurfaceMap`. But a particle's map
is written to far more often than it is read at any one place, so no surfels and no table of closest
walls are kept up: the line through the cells around is fitted when an end point asks for it.

Source: Biber & Strasser 2003 (normal distributions), Censi 2008 (distances point to line).
"""

from __future__ import annotations

import math

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.shared_tiles import Ids, Shorts, find_cell, own_tile
from mapping.surface_map import layer_of
from mapping.surfel_fitting import shape_surfel

# Fields of a cell: number of end points, sums of their offsets from its centre, in such parts of
# its edge, and with which scan the first one came.
HITS, OFFSET_X, OFFSET_Y, FIRST = range(4)
FIELDS = 4
PARTS = 200.0
# All halve when a cell holds so many end points; an offset is at most one edge, so 16 bits suffice.
MOST_HITS = 120
LAST_SCAN = 32767


@compiled
def add_end_points(
    points: Floats,
    poses: Floats,
    lattice: tuple[float, float, float],
    depth: float,
    now: int,
    tables: Ids,
    pool: Shorts,
    references: Ids,
    free: Ids,
) -> None:
    """Add the end points of one scan to all maps.

    Args:
        points: (N, 4) end points [m] and the directions their surfaces face, base frame.
        poses: (maps, 3), (x, y, theta) of the base as each map has it.
        lattice: (corner x, corner y, edge of a cell) [m], map frame.
        depth: an end point belongs to the cell this far behind its surface [m].
        now: number of the scan.
        tables: `SharedTiles.tables`, and so on. Room must have been reserved: a tile per point.
    """
    for k in range(poses.shape[0]):
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for i in range(points.shape[0]):
            nx = c * points[i, 2] - s * points[i, 3]
            ny = s * points[i, 2] + c * points[i, 3]
            x = (poses[k, 0] + c * points[i, 0] - s * points[i, 1] - lattice[0]) / lattice[2]
            y = (poses[k, 1] + s * points[i, 0] + c * points[i, 1] - lattice[1]) / lattice[2]
            iy = int(math.floor(y - depth / lattice[2] * ny))
            ix = int(math.floor(x - depth / lattice[2] * nx))
            layer = layer_of(nx, ny)
            tile = own_tile(tables[k], layer, iy, ix, pool, references, free)
            if tile >= 0:
                _, place = find_cell(tables[k], layer, iy, ix)
                _add_end_point(pool[tile, place], x - ix - 0.5, y - iy - 0.5, now)


@compiled
def _add_end_point(cell: Shorts, x: float, y: float, now: int) -> None:
    """Add an end point to a cell (FIELDS,), by its offset from the centre [cells]."""
    if cell[HITS] == 0:
        cell[FIRST] = min(now, LAST_SCAN)
    if cell[HITS] >= MOST_HITS:
        for field in (HITS, OFFSET_X, OFFSET_Y):
            cell[field] //= 2
    cell[HITS] += 1
    cell[OFFSET_X] += round(PARTS * x)
    cell[OFFSET_Y] += round(PARTS * y)


@compiled
def find_surfels(
    points: Floats,
    pose: Floats,
    lattice: tuple[float, float, float],
    depth: float,
    table: Ids,
    pool: Shorts,
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
        now: number of scans inserted.
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
    table: Ids, pool: Shorts, layer: int, iy: int, ix: int, reach: int
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
                    if tile >= 0 and pool[tile, place, HITS] > 0:
                        best, best_y, best_x = far, iy + dy, ix + dx
    return best <= reach * reach, best_y, best_x


@compiled
def _fit_surfel(
    table: Ids,
    pool: Shorts,
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
    part = lattice[2] / PARTS
    tile, place = find_cell(table, layer, cell_y, cell_x)
    own = pool[tile, place]
    x0, y0 = part * own[OFFSET_X] / own[HITS], part * own[OFFSET_Y] / own[HITS]
    neighbours = 0
    n = sx = sy = sxx = sxy = syy = 0.0
    first = now
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            tile, place = find_cell(table, layer, cell_y + dy, cell_x + dx)
            if tile < 0 or pool[tile, place, HITS] == 0:
                continue
            cell = pool[tile, place]
            w = float(cell[HITS])
            neighbours += 1
            first = min(first, float(cell[FIRST]))
            x = dx * lattice[2] + part * cell[OFFSET_X] / w - x0
            y = dy * lattice[2] + part * cell[OFFSET_Y] / w - y0
            n += w
            sx += w * x
            sy += w * y
            sxx += w * x * x
            sxy += w * x * y
            syy += w * y * y
    shape_surfel((n, sx, sy, sxx, sxy, syy), (neighbours, first), now, doubt, ratios, surfel)
    surfel[0] += lattice[0] + (cell_x + 0.5) * lattice[2] + x0
    surfel[1] += lattice[1] + (cell_y + 0.5) * lattice[2] + y0
