"""The compiled core of scan integration: beams that end in a cell vote against those that pass it.

Source: Amanatides & Woo 1987 for the walk along a beam.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats


@compiled
def cast_votes(
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
    own = _end_cells(solid, corner_x, corner_y, resolution)
    _count_ends(ended, own)
    k = 0
    for i in range(ends.shape[0]):
        own_iy = own_ix = -1
        if hits[i]:
            own_iy, own_ix = own[k]
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
def _end_cells(
    solid: Floats, corner_x: float, corner_y: float, resolution: float
) -> npt.NDArray[np.int64]:
    """Return the cell (N, 2) of each point [m], counted from the box's corner [m]."""
    cells = np.empty(solid.shape, dtype=np.int64)
    for i in range(solid.shape[0]):
        cells[i, 0] = int(math.floor((solid[i, 1] - corner_y) / resolution))
        cells[i, 1] = int(math.floor((solid[i, 0] - corner_x) / resolution))
    return cells


@compiled
def _count_ends(ended: npt.NDArray[np.uint8], cells: npt.NDArray[np.int64]) -> None:
    """Count in each cell of the box the beams that end there."""
    rows, cols = ended.shape
    for i in range(cells.shape[0]):
        iy, ix = cells[i]
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
