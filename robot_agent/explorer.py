"""Builds the robot's bids: which frontier cells there are, what going there costs and brings.

Source: Simmons et al. 2000, section "Constructing Bids".
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox, around_both
from mapping.coarse_gain import coarse_grounds, coarse_information_gains
from mapping.frontier_tour import values_after
from mapping.frontiers import find_frontiers
from mapping.gain_cache import GainCache
from mapping.geometry import Floats, Pose2
from mapping.grid import Cells
from mapping.visible_gain import Sight, visible_gains
from protocol.body import Body
from protocol.messages import Bid
from robot_agent.block_map import BlockMap
from robot_agent.planning_map import PlanningMap
from robot_agent.settings import ExplorerSettings
from robot_agent.ways import BLOCK, Ways, leaders

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
        self._map_number = planning_map.number
        planning_map.take_changes()  # what follows is made of the map as it is
        self._cache = GainCache(self._expected)
        self._changed: list[CellBox] = []
        self._blocks = BlockMap(
            planning_map, settings.coarsening, BLOCK, settings.weigh_by_probability
        )
        self._number = 0
        self._dirty = False
        self._next = 0.0

    def bid(self, T_map_base: Pose2, others: Floats, idle: bool, now: float) -> Bid | None:
        """Return a bid on the map as it is now, or None when there is nothing new to say.

        Args:
            T_map_base: where the robot is, map frame.
            others: (k, 2) [m] where the teammates are, map frame.
            idle: a robot without a task bids without waiting for the period to pass.
            now: mission time [s].
        """
        self._follow_map()
        if not self._dirty or (now < self._next - _EPSILON and not idle):
            return None
        self._dirty = False
        self._next = now + self._settings.bid_period_s
        self._number += 1
        self._blocks.refresh()
        resolution = self._map.geometry.resolution
        spacing = max(1, round(self._settings.spacing_m / resolution))
        frontiers = find_frontiers(self._map.classes, spacing, self._settings.frontier_cells_min)
        ways = Ways(self._map, T_map_base, self._body.radius_m, self._blocks.weights)
        stands = ways.stands(frontiers.cells, self._body.radius_m + self._settings.reach_m)
        reached = stands[:, 0] >= 0
        gains, rectangles = self._gains(frontiers.cells[reached])
        keep = self._best(gains)
        stands = stands[reached][keep]
        losses = self._losses(ways, stands, frontiers.component[reached][keep], gains[keep], others)
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
            losses=losses.astype(np.float32),
        )

    def costs_from(self, T_map_base: Pose2, places_map: Floats) -> Floats:
        """Return how far places of the last bid are for a teammate of this size, (n,) [m].

        Args:
            T_map_base: where the teammate is, map frame.
            places_map: (n, 2) [m], map frame.

        Returns:
            Infinite for places it has no way to.
        """
        self._follow_map()  # it may have changed, and grown, since the last bid
        self._blocks.refresh()
        ways = Ways(self._map, T_map_base, self._body.radius_m, self._blocks.weights)
        stands = ways.stands(self._map.geometry.cells_at(places_map), self._body.radius_m)
        reached = stands[:, 0] >= 0
        costs = np.full(len(places_map), np.inf)
        costs[reached] = ways.field.at(stands[reached])
        return costs

    def _follow_map(self) -> None:
        """Note what changed of the map since the last time."""
        boxes = self._map.take_changes()
        self._dirty |= boxes != [] or self._map.number != self._map_number
        self._map_number = self._map.number
        if boxes is None:
            self._cache.forget()
            self._changed.clear()
        elif boxes:
            # Whether the body fits changes around, too.
            around = self._map.body_cells
            self._changed += [box.dilated(around, self._map.geometry.shape) for box in boxes]
            self._blocks.changed(boxes)

    def _losses(
        self,
        ways: Ways,
        stands: Cells,
        component: npt.NDArray[np.int64],
        gains: Floats,
        others: Floats,
    ) -> Floats:
        """Return how much less the rest of the robot's route is worth by going there first, (n,).

        Of every frontier one place takes part: the nearest of those worth a trip. What a teammate
        has a shorter way to counts less, or nothing.

        Args:
            ways: those of this bid.
            stands: (n, 2) blocks, one for each place.
            component: (n,) which frontier a place belongs to.
            gains: (n,) [m2].
            others: (k, 2) [m] where the teammates are, map frame.

        Returns:
            [m2], 0 for the place from where most can be gained afterwards; (0,) if not wanted.
        """
        settings = self._settings
        if not settings.look_ahead:
            return np.empty(0)
        costs = ways.field.at(stands)
        rows = leaders(component, costs, gains, settings.route_gain_m2, settings.route_places_max)
        if len(rows) == 0:
            return np.zeros(len(stands))
        mates = ways.stands(self._map.geometry.cells_at(others), self._body.radius_m + 0.5)
        between = ways.between(np.concatenate((stands[rows], mates[mates[:, 0] >= 0])))
        n = len(rows)
        theirs = between[:n, n:].min(axis=1, initial=np.inf)
        share = np.clip(0.5 + (theirs - costs[rows]) / settings.route_apart_m, 0.0, 1.0)
        beyond = np.minimum(settings.route_beyond * np.sqrt(gains[rows]), settings.gain_range_m)
        mine = np.flatnonzero(share)
        after = values_after(
            between[:n, :n], share * gains[rows], beyond, mine, settings.route_worth
        )
        row_of = {int(component[row]): k for k, row in enumerate(rows)}
        least = after.min()
        values = np.array([after[row_of[c]] if c in row_of else least for c in component.tolist()])
        losses: Floats = after.max() - values
        return losses

    def _gains(self, cells: npt.NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Return the expected information [m2] at frontier cells and its rectangles [m]."""
        geometry = self._map.geometry
        gains, boxes = self._cache.gains(cells, self._changed)
        self._changed.clear()
        corners = boxes.astype(np.float64)[:, [1, 0, 3, 2]] * geometry.resolution
        corners += np.array([geometry.origin_x, geometry.origin_y] * 2)
        return gains * geometry.resolution**2, corners

    def _expected(self, cells: Cells) -> tuple[Floats, Cells, Cells]:
        """Return what floods find at frontier cells, as far as it may be seen, for `GainCache`."""
        coarse, settings = self._blocks.gains, self._settings
        resolution = self._map.geometry.resolution
        reach = min(self._body.lidar.range_max_m, settings.gain_range_m) / resolution
        gains, boxes = coarse_information_gains(coarse, cells, reach)
        depends = coarse_grounds(cells, boxes, coarse.factor)
        if settings.sight_factor == 0.0:
            return gains, boxes, depends
        sight = Sight(reach, settings.free_path_m / resolution)
        some = np.flatnonzero(gains)
        enough = gains[some] / settings.sight_factor
        seen, around = visible_gains(
            self._map.classes, coarse.fine_weight, cells[some], sight, enough
        )
        gains[some] = np.minimum(gains[some], settings.sight_factor * seen)
        depends[some] = around_both(depends[some], around)
        return gains, boxes, depends

    def _best(self, gains: Floats) -> npt.NDArray[np.int64]:
        """Return the rows of the places worth telling: those with a gain, the richest if many."""
        order = np.argsort(-gains, kind="stable")[: self._settings.places_max]
        rows: npt.NDArray[np.int64] = np.sort(order[gains[order] > 0.0])
        return rows
