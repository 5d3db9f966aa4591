"""The ways from the robot to everywhere, on blocks of cells: for choosing, not for driving."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.coarse_weights import refresh_weights
from mapping.frontier_tour import ways_between
from mapping.geometry import Floats, Pose2
from mapping.grid import Cells
from mapping.path_escape import with_escape
from mapping.path_planning import CostField, cost_field, reachable_near
from robot_agent.planning_map import PlanningMap

BLOCK = 2  # ways are measured on blocks of so many cells along an edge: four times faster
_ESCAPE = 0.6  # [m]; a robot that stands too near a wall may leave through this radius
_SIGHT = 10.0  # [m]; places up to this far apart are tried for a straight way


class Ways:
    """What it costs one robot to go anywhere on the map as it is now.

    Attributes:
        field: costs from where the robot stands, by block.
    """

    def __init__(
        self,
        planning_map: PlanningMap,
        T_map_base: Pose2,
        body_radius: float,
        block_weights: npt.NDArray[np.uint8],
    ) -> None:
        """Let the wave run from where the robot is.

        Args:
            planning_map: the robot's map.
            T_map_base: where it is, map frame.
            body_radius: of the robot [m].
            block_weights: (rows, cols) uint8, the map's weights in blocks of `BLOCK` cells; not
                changed.
        """
        geometry = planning_map.geometry
        self._corner = np.array([geometry.origin_x, geometry.origin_y])
        self._edge = geometry.resolution * BLOCK
        start = geometry.cell_at(T_map_base.x, T_map_base.y)
        weights = planning_map.weights
        starts: list[tuple[int, int]] = []
        if geometry.holds(*start):
            starts = [(start[0] // BLOCK, start[1] // BLOCK)]
            weights = with_escape(
                weights,
                planning_map.clear,
                planning_map.clearance,
                start,
                geometry.resolution,
                _ESCAPE,
                body_radius,
            )
        if weights is not planning_map.weights:
            block_weights = block_weights.copy()
            opened = CellBox(*start, start[0] + 1, start[1] + 1)
            around = opened.dilated(math.ceil(_ESCAPE / geometry.resolution), geometry.shape)
            refresh_weights(block_weights, weights, BLOCK, around)
        self._weights = block_weights
        self.field: CostField = cost_field(self._weights, starts, self._edge)

    def stands(self, cells: npt.NDArray[np.int64], reach: float) -> Cells:
        """Return where to stand for each cell (n, 2) of the map, as blocks (n, 2).

        The body may not fit onto the cell itself: then the reachable block nearest to it counts, if
        it is within `reach` [m]; (-1, -1) where none is.
        """
        return reachable_near(self.field, cells // BLOCK, reach)

    def places(self, stands: Cells) -> Floats:
        """Return the middles (n, 2) [m] of blocks, map frame."""
        places: Floats = self._corner + (stands[:, ::-1] + 0.5) * self._edge
        return places

    def between(self, stands: Cells) -> Floats:
        """Return about how long the ways between reachable blocks are, (n, n) [m]."""
        return ways_between(self.field, self._weights, stands, _SIGHT)


def leaders(
    component: npt.NDArray[np.int64], costs: Floats, gains: Floats, least: float, most: int
) -> npt.NDArray[np.int64]:
    """Return the rows of one place for each frontier: the nearest that is worth a trip.

    Args:
        component: (n,) which frontier each place belongs to.
        costs: (n,) [m].
        gains: (n,) [m2].
        least: places with less to gain [m2] do not count.
        most: the frontiers with the most to gain are kept, up to so many.
    """
    rows = np.flatnonzero(gains >= least)
    rows = rows[np.lexsort((rows, costs[rows], component[rows]))]
    first = np.ones(len(rows), dtype=np.bool_)
    first[1:] = component[rows][1:] != component[rows][:-1]
    chosen = rows[first]
    return np.sort(chosen[np.argsort(-gains[chosen], kind="stable")[:most]])
