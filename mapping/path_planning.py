"""Path costs from one place to everywhere, found in one wave over clear cells.

The wave carries whole numbers, so its priority queue is a ring of buckets. A step costs 5 along a
row or column and 7 along a diagonal, times a small whole weight of the cell it enters. In the open
(weight 1) that measures a straight way 1 % too short (diagonals) to 7.7 % too long (22 degrees off
an axis); any metric of 8 neighbours errs by that much, and utilities do not need better. The paths
themselves are straightened afterwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.bucket_wave import (
    BLOCKED,
    DIAGONAL_STEP,
    MAX_WEIGHT,
    NOWHERE,
    STRAIGHT_STEP,
    UNREACHED,
    bucket_wave,
)
from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import Cells, GridGeometry
from mapping.path_smoothing import shortcuts

CARE_LEVELS = 6  # the weight of a cell as near to an obstacle as the body may come


@dataclass(frozen=True, slots=True)
class CostField:
    """What it costs to go from the start to every cell.

    Attributes:
        units: (rows, cols) int32, `UNREACHED` where no path leads; 5 per straight step in the open.
        resolution: edge of a cell [m].
    """

    units: npt.NDArray[np.int32]
    resolution: float

    @property
    def metres_per_unit(self) -> float:
        """What one unit stands for [m]."""
        return self.resolution / STRAIGHT_STEP

    @property
    def cost(self) -> npt.NDArray[np.float32]:
        """Costs as metres of way in the open, (rows, cols) float32; inf where no path leads."""
        metres = self.units.astype(np.float32) * np.float32(self.metres_per_unit)
        metres[self.units == UNREACHED] = np.inf
        return metres

    def at(self, cells: npt.ArrayLike) -> Floats:
        """Return the costs (N,) [m] of `cells` (N, 2); inf where none leads, or off the grid."""
        wanted = np.asarray(cells, dtype=np.int64).reshape(-1, 2)
        costs = np.full(len(wanted), np.inf)
        inside = ((wanted >= 0) & (wanted < self.units.shape)).all(axis=1)
        units = self.units[wanted[inside, 0], wanted[inside, 1]]
        costs[inside] = np.where(units == UNREACHED, np.inf, units * self.metres_per_unit)
        return costs

    def reaches(self, iy: int, ix: int) -> bool:
        """Whether a path leads to the cell."""
        rows, cols = self.units.shape
        return 0 <= iy < rows and 0 <= ix < cols and int(self.units[iy, ix]) != UNREACHED


def traversal_weights(
    clear: npt.NDArray[np.bool_],
    clearance: npt.NDArray[np.float32],
    body_radius: float,
    comfort: float,
    squeeze: float = 0.0,
) -> npt.NDArray[np.uint8]:
    """Return how dear it is to enter each cell, so that paths keep to the middle of doors.

    Args:
        clear: (rows, cols), the cells known to be clear.
        clearance: (rows, cols) float32 [m], distance to the nearest obstacle.
        body_radius: nearer to an obstacle the robot's centre may not come [m].
        comfort: from this clearance on a cell is free of care [m]. With `comfort` no more than
            `body_radius` every cell that may be entered weighs 1, and costs are path lengths.
        squeeze: where this much of clearance is lacking [m] the body may just fit: an obstacle
            seldom fills its cells to the edge. Such cells are the dearest of all.

    Returns:
        (rows, cols) uint8: `BLOCKED`, or 1 where clearance is `comfort` or more, rising evenly
        to `CARE_LEVELS` as it falls to `body_radius`, and `MAX_WEIGHT` where it takes a squeeze.
    """
    return _weights(
        np.ascontiguousarray(clear), np.ascontiguousarray(clearance), body_radius, comfort, squeeze
    )


@compiled
def _weights(
    clear: npt.NDArray[np.bool_],
    clearance: npt.NDArray[np.float32],
    body_radius: float,
    comfort: float,
    squeeze: float,
) -> npt.NDArray[np.uint8]:
    """Compiled body of `traversal_weights`."""
    rows, cols = clear.shape
    weights = np.empty((rows, cols), dtype=np.uint8)
    slope = CARE_LEVELS / max(comfort - body_radius, 1e-9)
    for iy in range(rows):
        for ix in range(cols):
            care = int(max((comfort - clearance[iy, ix]) * slope, 0.0))
            weight = min(1 + care, CARE_LEVELS)
            if not clear[iy, ix] or clearance[iy, ix] < body_radius - squeeze:
                weight = BLOCKED
            elif clearance[iy, ix] < body_radius:
                weight = MAX_WEIGHT
            weights[iy, ix] = weight
    return weights


def cost_field(
    weights: npt.NDArray[np.uint8],
    start_cells: npt.ArrayLike,
    resolution: float,
    until: tuple[int, int] | None = None,
    beyond: float = 0.0,
) -> CostField:
    """Return the cost of the cheapest path from the start to every cell.

    A step along a diagonal needs both cells beside it to be enterable: paths cut no corners. To
    plan around teammates, set the weights of the cells where they stand to `BLOCKED`.

    Args:
        weights: (rows, cols) uint8, see `traversal_weights`; `BLOCKED` cells are not entered,
            weights above `MAX_WEIGHT` count as that.
        start_cells: one cell (iy, ix), or several (N, 2), of which the nearest counts. They may
            be blocked themselves. Those off the grid are ignored.
        resolution: edge of a cell [m].
        until: a cell (iy, ix) whose cost is wanted; the rest of the field may then be missing
        beyond: where it costs more than that cell and this [m].

    Source: Simmons et al. 2000, section "Constructing Bids"; the queue is Dial's (1969).
    """
    starts = np.asarray(start_cells, dtype=np.int64).reshape(-1, 2)
    inside = ((starts >= 0) & (starts < weights.shape)).all(axis=1)
    units = bucket_wave(
        np.ascontiguousarray(weights),
        starts[inside],
        until or NOWHERE,
        round(STRAIGHT_STEP * beyond / resolution),
    )
    return CostField(units, resolution)


def path_to(field: CostField, goal_cell: tuple[int, int]) -> Cells:
    """Return the cheapest path's cells (N, 2) from the start to the goal, both included.

    Empty (0, 2) if no path leads there.
    """
    if not field.reaches(*goal_cell):
        return np.empty((0, 2), dtype=np.int64)
    return _descend(field.units, goal_cell[0], goal_cell[1])[::-1].copy()


@compiled
def _descend(units: npt.NDArray[np.int32], goal_iy: int, goal_ix: int) -> Cells:
    """Return the cells from the goal down to the start.

    The cell a path came through is the one towards which cost falls most per length of step.
    """
    cells = np.empty((256, 2), dtype=np.int64)
    iy, ix, dy, dx, count = goal_iy, goal_ix, 0, 0, 0
    while True:
        if count == len(cells):
            longer = np.empty((2 * count, 2), dtype=np.int64)
            longer[:count] = cells
            cells = longer
        cells[count, 0], cells[count, 1] = iy, ix
        count += 1
        dy, dx = step_down(units, iy, ix, dy, dx)
        if dy == 0 and dx == 0:
            return cells[:count]
        iy, ix = iy + dy, ix + dx


@compiled
def step_down(units: npt.NDArray[np.int32], iy: int, ix: int, dy: int, dx: int) -> tuple[int, int]:
    """Return the step from a cell towards the start; (0, 0) at the start.

    Args:
        units: (rows, cols) int32, see `CostField`.
        iy: row of the cell.
        ix: column of the cell.
        dy: the step that led here, of equals the one straight on is taken; (0, 0) if none did.
        dx: see `dy`.
    """
    rows, cols = units.shape
    steepest, next_dy, next_dx = 0, 0, 0
    for sy in range(-1, 2):
        for sx in range(-1, 2):
            ny, nx = iy + sy, ix + sx
            if ny < 0 or nx < 0 or ny >= rows or nx >= cols or units[ny, nx] == UNREACHED:
                continue
            cut = sy != 0 and sx != 0
            if cut and (units[iy, nx] == UNREACHED or units[ny, ix] == UNREACHED):
                continue
            fall = int(units[iy, ix]) - int(units[ny, nx])
            slope = fall * (STRAIGHT_STEP if cut else DIAGONAL_STEP)
            if slope > steepest or (slope == steepest > 0 and sy == dy and sx == dx):
                steepest, next_dy, next_dx = slope, sy, sx
    return next_dy, next_dx


def smooth_path(
    cells: npt.ArrayLike, weights: npt.NDArray[np.uint8], geometry: GridGeometry
) -> Floats:
    """Return the corners (M, 2) [m] of a path of straight lines that follows `cells`.

    The lines cross no blocked cell and cut no corner, touch no cell heavier than the part of the
    path they replace, and cost no more than it did: comfortable clearance stays comfortable.

    Args:
        cells: (N, 2), a path as `path_to` returns it; its first cell may be blocked.
        weights: (rows, cols) uint8, those the path was planned with.
        geometry: of `weights`.

    Returns:
        Centres of the first cell, of the cells where the path bends, and of the last cell.
    """
    path = np.asarray(cells, dtype=np.int64).reshape(-1, 2)
    return geometry.centres_of(path[shortcuts(path, np.ascontiguousarray(weights))])


def nearest_reachable(
    field: CostField, cell: tuple[int, int], radius: float
) -> tuple[int, int] | None:
    """Return the reachable cell nearest to a wanted one, or None within `radius` [m].

    Of equally near cells the cheapest, then the first in the grid's order.
    """
    found = reachable_near(field, [cell], radius)[0]
    return None if found[0] < 0 else (int(found[0]), int(found[1]))


def reachable_near(field: CostField, cells: npt.ArrayLike, radius: float) -> Cells:
    """Return the reachable cell nearest to each of `cells` (N, 2); (-1, -1) where none is.

    Wanted places may lie off the grid; `radius` [m] is how far from them to look.
    """
    wanted = np.asarray(cells, dtype=np.int64).reshape(-1, 2)
    return _nearest(field.units, wanted, radius / field.resolution)


@compiled
def _nearest(units: npt.NDArray[np.int32], wanted: Cells, reach: float) -> Cells:
    """Compiled body of `reachable_near`; `reach` in cells."""
    rows, cols = units.shape
    found = np.full(wanted.shape, -1, dtype=np.int64)
    span = math.floor(reach)
    for k in range(len(wanted)):
        cy, cx = wanted[k]
        least, cheapest = math.floor(reach * reach), UNREACHED
        for iy in range(max(cy - span, 0), min(cy + span + 1, rows)):
            for ix in range(max(cx - span, 0), min(cx + span + 1, cols)):
                away = (iy - cy) ** 2 + (ix - cx) ** 2
                nearer = away < least or (away == least and units[iy, ix] < cheapest)
                if nearer and units[iy, ix] != UNREACHED:
                    least, cheapest = away, units[iy, ix]
                    found[k, 0], found[k, 1] = iy, ix
    return found
