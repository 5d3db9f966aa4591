"""Builds the robot's bids: which frontier cells there are, what going there costs and brings.

Source: Simmons et al. 2000, section "Constructing Bids".
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.coarse_gain import coarsen_classes
from mapping.coarse_weights import coarsen_weights
from mapping.frontiers import find_frontiers
from mapping.gain_cache import GainCache
from mapping.geometry import Floats, Pose2
from mapping.grid import CLEAR, CellBox
from mapping.information_gain import entropy_weight
from mapping.path_escape import with_escape
from mapping.path_planning import cost_field, reachable_near
from protocol.body import Body
from protocol.map_cells import dequantise
from protocol.messages import Bid
from robot_agent.planning_map import PlanningMap
from robot_agent.settings import ExplorerSettings

_EPSILON = 1e-9
_COST_BLOCK = 2  # ways are measured on blocks of so many cells along an edge: four times faster
_ESCAPE = 0.6  # [m]; a robot that stands too near a wall may leave through this radius


class Explorer:
    """Makes bids on the frontiers of the team's map.

    Args:
        body: the robot's own radius and sensor range count.
        settings: what is a frontier and how often to bid.
        planning_map: the robot's copy of the team's map.
    """

    def __init__(self, body: Body, settings: ExplorerSettings, planning_map: PlanningMap) -> None:
        self._body = body
        self._settings = settings
        self._map = planning_map
        self._geometry = planning_map.geometry
        self._cache = GainCache(
            min(body.lidar.range_max_m, settings.gain_range_m) / self._geometry.resolution
        )
        self._changed: list[CellBox] = []
        steps = np.arange(256, dtype=np.uint8).view(np.int8)
        self._weight_of_byte = entropy_weight(dequantise(steps))
        self._number = 0
        self._dirty = False
        self._next = 0.0

    def map_changed(self, box: CellBox | None) -> None:
        """Note that the map changed, in `box` or (None) all over."""
        self._dirty = True
        if box is None or self._map.geometry != self._geometry:
            self._geometry = self._map.geometry
            self._cache.forget()
            self._changed.clear()
        else:
            self._changed.append(box)

    def bid(self, T_map_base: Pose2, idle: bool, now: float) -> Bid | None:
        """Return a bid on the map as it is now, or None when there is nothing new to say.

        Args:
            T_map_base: where the robot is, map frame.
            idle: a robot without a task bids without waiting for the period to pass.
            now: mission time [s].
        """
        if not self._dirty or (now < self._next - _EPSILON and not idle):
            return None
        self._dirty = False
        self._next = now + self._settings.bid_period_s
        self._number += 1
        geometry, resolution = self._map.geometry, self._map.geometry.resolution
        spacing = max(1, round(self._settings.spacing_m / resolution))
        frontiers = find_frontiers(self._map.classes, spacing, self._settings.frontier_cells_min)
        places, costs, reached = self._costs(T_map_base, frontiers.cells)
        gains, rectangles = self._gains(frontiers.cells[reached])
        if self._settings.openings_limit_gains:
            gains = self._through_openings(
                gains, frontiers.component_size[reached].astype(np.float64) * resolution
            )
        keep = self._best(gains)
        return Bid(
            number=self._number,
            map_number=self._map.number,
            T_map_base=T_map_base,
            places_map=places[reached][keep].astype(np.float32),
            gains=gains[keep].astype(np.float32),
            costs_m=costs[reached][keep].astype(np.float32),
            rectangles_map=rectangles[keep].astype(np.float32),
            unreachable_map=geometry.centres_of(frontiers.cells[~reached])[:400].astype(np.float32),
        )

    def _costs(
        self, T_map_base: Pose2, cells: npt.NDArray[np.int64]
    ) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
        """Return where to stand for each frontier cell, the way there [m], and which are reachable.

        The body may not fit onto the frontier cell itself: then the reachable cell nearest to it
        counts, if it is near enough to look over the frontier from there.
        """
        geometry = self._map.geometry
        start = geometry.cell_at(T_map_base.x, T_map_base.y)
        if not geometry.holds(*start):
            blocked = np.zeros(len(cells), dtype=np.bool_)
            return geometry.centres_of(cells), np.full(len(cells), np.inf), blocked
        weights = with_escape(
            self._map.weights,
            self._map.classes == CLEAR,
            self._map.clearance,
            start,
            geometry.resolution,
            _ESCAPE,
            self._body.radius_m,
        )
        blocks = coarsen_weights(weights, _COST_BLOCK)
        start_block = (start[0] // _COST_BLOCK, start[1] // _COST_BLOCK)
        field = cost_field(blocks, [start_block], geometry.resolution * _COST_BLOCK)
        reach = self._body.radius_m + self._settings.reach_m
        stands = reachable_near(field, cells // _COST_BLOCK, reach)
        reached = stands[:, 0] >= 0
        corner = np.array([geometry.origin_x, geometry.origin_y])
        places = corner + (stands[:, ::-1] + 0.5) * (geometry.resolution * _COST_BLOCK)
        return places, field.at(stands), reached

    def _gains(self, cells: npt.NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Return the expected information [m2] at frontier cells and its rectangles [m]."""
        geometry, factor = self._map.geometry, self._settings.coarsening
        weight = None
        if self._settings.weigh_by_probability:
            weight = self._weight_of_byte[self._map.cells.view(np.uint8)]
        coarse = coarsen_classes(self._map.classes, factor, weight)
        gains, boxes = self._cache.gains(coarse, cells, self._changed)
        self._changed.clear()
        corners = boxes.astype(np.float64)[:, [1, 0, 3, 2]] * geometry.resolution
        corners += np.array([geometry.origin_x, geometry.origin_y] * 2)
        return gains * geometry.resolution**2, corners

    def _through_openings(self, gains: Floats, widths: Floats) -> Floats:
        """Return the gains (n,) [m2] with less behind openings (n,) [m] too narrow for the body.

        A gap between two wall segments opens on all the unknown outside, but only what is seen
        through it from here can be gained, not what lies behind.
        """
        narrow = widths < 2.0 * self._body.radius_m
        return np.where(narrow, np.minimum(gains, widths * self._settings.peep_m), gains)

    def _best(self, gains: Floats) -> npt.NDArray[np.int64]:
        """Return the rows of the places worth telling: those with a gain, the richest if many."""
        order = np.argsort(-gains, kind="stable")[: self._settings.places_max]
        rows: npt.NDArray[np.int64] = np.sort(order[gains[order] > 0.0])
        return rows
