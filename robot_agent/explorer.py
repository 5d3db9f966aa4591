"""Builds the robot's bids: which frontier cells there are, what going there costs and brings.

Source: Simmons et al. 2000, section "Constructing Bids".
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.coarse_gain import coarsen_classes
from mapping.frontier_tour import round_lengths
from mapping.frontiers import find_frontiers
from mapping.gain_cache import GainCache
from mapping.geometry import Floats, Pose2
from mapping.grid import CellBox, Cells
from mapping.information_gain import entropy_weight, roomy_classes
from protocol.body import Body
from protocol.map_cells import dequantise
from protocol.messages import Bid
from robot_agent.planning_map import PlanningMap
from robot_agent.settings import ExplorerSettings
from robot_agent.ways import Ways, leaders

_EPSILON = 1e-9


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
        self._margin = math.ceil(body.radius_m / self._geometry.resolution)
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
            # Clearance changes up to a body's radius around.
            self._changed.append(box.dilated(self._margin, self._geometry))

    def bid(self, T_map_base: Pose2, others: Floats, idle: bool, now: float) -> Bid | None:
        """Return a bid on the map as it is now, or None when there is nothing new to say.

        Args:
            T_map_base: where the robot is, map frame.
            others: (k, 2) [m] where the teammates are, map frame.
            idle: a robot without a task bids without waiting for the period to pass.
            now: mission time [s].
        """
        if not self._dirty or (now < self._next - _EPSILON and not idle):
            return None
        self._dirty = False
        self._next = now + self._settings.bid_period_s
        self._number += 1
        resolution = self._map.geometry.resolution
        spacing = max(1, round(self._settings.spacing_m / resolution))
        frontiers = find_frontiers(self._map.classes, spacing, self._settings.frontier_cells_min)
        ways = Ways(self._map, T_map_base, self._body.radius_m)
        stands = ways.stands(frontiers.cells, self._body.radius_m + self._settings.reach_m)
        reached = stands[:, 0] >= 0
        gains, rectangles = self._gains(frontiers.cells[reached])
        keep = self._best(gains)
        stands = stands[reached][keep]
        detours = self._detours(
            ways, stands, frontiers.component[reached][keep], gains[keep], others
        )
        return Bid(
            number=self._number,
            map_number=self._map.number,
            T_map_base=T_map_base,
            places_map=ways.places(stands).astype(np.float32),
            gains=gains[keep].astype(np.float32),
            costs_m=ways.field.at(stands).astype(np.float32),
            rectangles_map=rectangles[keep].astype(np.float32),
            unreachable_map=self._map.geometry.centres_of(frontiers.cells[~reached])[:400].astype(
                np.float32
            ),
            detours_m=detours.astype(np.float32),
        )

    def _detours(
        self,
        ways: Ways,
        stands: Cells,
        component: npt.NDArray[np.int64],
        gains: Floats,
        others: Floats,
    ) -> Floats:
        """Return how much longer the robot's round gets by going to each place first, (n,) [m].

        Of every frontier one place takes part: the nearest of those worth a trip. The round leads
        through the frontiers that no teammate has a shorter way to.

        Args:
            ways: those of this bid.
            stands: (n, 2) blocks, one for each place.
            component: (n,) which frontier a place belongs to.
            gains: (n,) [m2].
            others: (k, 2) [m] where the teammates are, map frame.
        """
        costs = ways.field.at(stands)
        settings = self._settings
        rows = leaders(component, costs, gains, settings.round_gain_m2, settings.round_places_max)
        if len(rows) == 0:
            return np.zeros(len(stands))
        mates = ways.stands(self._map.geometry.cells_at(others), self._body.radius_m + 0.5)
        mates = mates[mates[:, 0] >= 0]
        between = ways.between(np.concatenate((stands[rows], mates)))
        n = len(rows)
        theirs = between[:n, n:].min(axis=1, initial=np.inf)
        mine = np.flatnonzero(costs[rows] <= theirs)
        beyond = np.minimum(settings.round_beyond * np.sqrt(gains[rows]), settings.gain_range_m)
        lengths = round_lengths(between[:n, :n], costs[rows], beyond, mine)
        rest = lengths - costs[rows]
        row_of = {int(component[row]): k for k, row in enumerate(rows)}
        after = np.array(
            [rest[row_of[c]] if c in row_of else rest.max() for c in component.tolist()]
        )
        detours: Floats = np.maximum(costs + after - lengths.min(), 0.0)
        return detours

    def _gains(self, cells: npt.NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Return the expected information [m2] at frontier cells and its rectangles [m]."""
        geometry, factor = self._map.geometry, self._settings.coarsening
        weight = None
        if self._settings.weigh_by_probability:
            weight = self._weight_of_byte[self._map.cells.view(np.uint8)]
        roomy = roomy_classes(self._map.classes, self._map.clearance, self._body.radius_m)
        coarse = coarsen_classes(roomy, factor, weight)
        gains, boxes = self._cache.gains(coarse, cells, self._changed)
        self._changed.clear()
        corners = boxes.astype(np.float64)[:, [1, 0, 3, 2]] * geometry.resolution
        corners += np.array([geometry.origin_x, geometry.origin_y] * 2)
        return gains * geometry.resolution**2, corners

    def _best(self, gains: Floats) -> npt.NDArray[np.int64]:
        """Return the rows of the places worth telling: those with a gain, the richest if many."""
        order = np.argsort(-gains, kind="stable")[: self._settings.places_max]
        rows: npt.NDArray[np.int64] = np.sort(order[gains[order] > 0.0])
        return rows
