"""Routes over the planning map: to a goal, or out of somebody's way.

Obstacles that are not in the team's map (teammates, things just seen, spots where the robot got
stuck) are drawn over the map's weights for one search.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.bucket_wave import BLOCKED, STRAIGHT_STEP
from mapping.cell_box import CellBox
from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import Cells
from mapping.path_escape import ESCAPE_WEIGHT, with_escape
from mapping.path_planning import cost_field, smooth_path
from robot_agent.path_following import SPACING, DrivenPath, evenly_spaced
from robot_agent.planning_map import PlanningMap
from robot_agent.route_search import (
    NO_ESTIMATE,
    NO_LIMIT,
    Units,
    Weights,
    search_way,
    stamp_discs,
    standing_places,
)

# A robot that stands where the map says it cannot may leave through cells this near [m].
_ESCAPE_RADIUS = 0.8
# Detours so much dearer than the way to a goal [m] are foreseen by the wave that comes from there.
_BEYOND = 8.0
# How often a path is drawn smooth; with 0.1 m between points corners get radii of about 0.5 m.
_RELAXATIONS = 60


@dataclass(frozen=True, slots=True)
class Discs:
    """Places that a search keeps out of, or avoids.

    Attributes:
        centres_map: (n, 2) [m].
        radius: how near the robot's centre may not come [m].
        hard: whether it must not; else it goes there only for want of a better way.
    """

    centres_map: Floats
    radius: float
    hard: bool = True


@dataclass(frozen=True, slots=True)
class Route:
    """A path to drive.

    Attributes:
        path: the path in the map frame.
        cost: its cost, as metres of way in the open.
    """

    path: DrivenPath
    cost: float


@dataclass(frozen=True, slots=True)
class Destination:
    """A goal and what is left to go to it from anywhere, by the map of some moment.

    Attributes:
        goal_map: (x, y) [m]; if it cannot be entered, routes end near it, on the same side of all
            walls.
        tolerance: how far from the goal a route may end then [m].
        to_go: (rows, cols) int32, see `CostField.units`.
        map_number: number of the map it was made from.
        stamp: when that was [s].
    """

    goal_map: tuple[float, float]
    tolerance: float
    to_go: Units
    map_number: int
    stamp: float

    @classmethod
    def on_map(
        cls,
        planning_map: PlanningMap,
        goal_map: tuple[float, float],
        tolerance: float,
        here_map: tuple[float, float],
        now: float,
    ) -> Destination:
        """Send a wave over the map from the goal to the robot's (x, y) [m] and some way beyond.

        `now` is the mission time [s].
        """
        geometry = planning_map.geometry
        places = _places(planning_map, planning_map.weights, goal_map, tolerance)
        iy, ix = geometry.cell_at(*goal_map)
        around = CellBox(iy, ix, iy + 1, ix + 1).dilated(
            _reach(planning_map, tolerance), geometry.shape
        )
        ends = np.argwhere(places[around.slices]) + np.array((around.iy0, around.ix0))
        here = geometry.cell_at(*here_map)
        field = cost_field(planning_map.weights, ends, geometry.resolution, here, _BEYOND)
        return cls(goal_map, tolerance, field.units, planning_map.number, now)


def _places(
    planning_map: PlanningMap, weights: Weights, goal_map: tuple[float, float], tolerance: float
) -> Weights:
    """Return where a route to a goal may end, see `standing_places`."""
    geometry = planning_map.geometry
    reach = _reach(planning_map, tolerance)
    return standing_places(weights, planning_map.clear, geometry.cell_at(*goal_map), reach)


def _reach(planning_map: PlanningMap, tolerance: float) -> int:
    """Return how far from a goal a route may end [cells], for a tolerance [m]."""
    return max(math.floor(tolerance / planning_map.geometry.resolution), 1)


def route_to_goal(
    planning_map: PlanningMap,
    here_map: tuple[float, float],
    destination: Destination,
    body_radius: float,
    keep_out: Sequence[Discs],
    detour: float = math.inf,
) -> Route | None:
    """Return the best route to a goal, None if there is none.

    Args:
        planning_map: the robot's map.
        here_map: (x, y) [m] of the robot.
        destination: where to, made for a map of the same extent.
        body_radius: of the robot [m].
        keep_out: what to avoid besides the map's obstacles.
        detour: how much longer than without `keep_out` it may be, as metres in the open.
    """
    start = planning_map.geometry.cell_at(*here_map)
    weights = _weights_with(planning_map, start, body_radius, keep_out)
    target = _places(planning_map, weights, destination.goal_map, destination.tolerance)
    units = NO_LIMIT
    if detour < math.inf:
        units = math.ceil(detour * STRAIGHT_STEP / planning_map.geometry.resolution)
    return _route(planning_map, weights, here_map, start, target, destination.to_go, units)


def route_out_of_the_way(
    planning_map: PlanningMap,
    here_map: tuple[float, float],
    body_radius: float,
    keep_out: Sequence[Discs],
    leave: Sequence[Discs],
) -> Route | None:
    """Return the cheapest route to a place outside all discs of `leave`, None if there is none.

    Args:
        planning_map: the robot's map.
        here_map: (x, y) [m] of the robot.
        body_radius: of the robot [m].
        keep_out: what the route itself has to keep out of.
        leave: what the robot must not be in at the end.
    """
    start = planning_map.geometry.cell_at(*here_map)
    weights = _weights_with(planning_map, start, body_radius, keep_out)
    target = (planning_map.weights != BLOCKED).view(np.uint8)
    for discs in leave:
        stamp_discs(target, planning_map.geometry, discs.centres_map, discs.radius, 0)
    return _route(planning_map, weights, here_map, start, target, NO_ESTIMATE)


def _weights_with(
    planning_map: PlanningMap,
    start: tuple[int, int],
    body_radius: float,
    keep_out: Sequence[Discs],
) -> Weights:
    """Return the map's weights with `keep_out` drawn in and a way out opened for the robot."""
    geometry = planning_map.geometry
    weights = planning_map.weights.copy()
    for discs in keep_out:
        value = BLOCKED if discs.hard else ESCAPE_WEIGHT
        stamp_discs(weights, geometry, discs.centres_map, discs.radius, value)
    return with_escape(
        weights,
        planning_map.clear,
        planning_map.clearance,
        start,
        geometry.resolution,
        _ESCAPE_RADIUS,
        body_radius,
    )


def _route(
    planning_map: PlanningMap,
    weights: Weights,
    here_map: tuple[float, float],
    start: tuple[int, int],
    target: Weights,
    to_go: Units,
    detour: int = NO_LIMIT,
) -> Route | None:
    """Search, and make a smooth path of the cells found."""
    cells, units = search_way(weights, start, target, to_go, detour)
    if len(cells) == 0:
        return None
    geometry = planning_map.geometry
    corners = smooth_path(cells, weights, geometry)
    corners[0] = here_map
    points = evenly_spaced(corners, SPACING)
    _relax(
        points,
        weights,
        geometry.origin_x,
        geometry.origin_y,
        geometry.resolution,
        _RELAXATIONS,
    )
    gaps = _looked_up(planning_map.clearance, geometry.cells_at(points))
    cost = units * geometry.resolution / STRAIGHT_STEP
    return Route(DrivenPath(points, gaps), cost)


@compiled
def _weight_at(
    weights: Weights, origin_x: float, origin_y: float, resolution: float, x: float, y: float
) -> int:
    """Return the weight of the cell at (x, y) [m], blocked off the grid."""
    iy, ix = math.floor((y - origin_y) / resolution), math.floor((x - origin_x) / resolution)
    if iy < 0 or ix < 0 or iy >= weights.shape[0] or ix >= weights.shape[1]:
        return BLOCKED
    return int(weights[iy, ix])


@compiled
def _relax(
    points: Floats,
    weights: Weights,
    origin_x: float,
    origin_y: float,
    resolution: float,
    times: int,
) -> None:
    """Round the corners of a path, in place, without entering dearer cells; the ends stay."""
    for _ in range(times):
        for k in range(1, len(points) - 1):
            x = 0.5 * points[k, 0] + 0.25 * (points[k - 1, 0] + points[k + 1, 0])
            y = 0.5 * points[k, 1] + 0.25 * (points[k - 1, 1] + points[k + 1, 1])
            new = _weight_at(weights, origin_x, origin_y, resolution, x, y)
            old = _weight_at(weights, origin_x, origin_y, resolution, points[k, 0], points[k, 1])
            if new != BLOCKED and new <= max(old, 2):
                points[k, 0], points[k, 1] = x, y


def _looked_up(grid: npt.NDArray[np.float32], cells: Cells) -> Floats:
    """Return the values (n,) of a grid at cells (n, 2); the path lies within the grid."""
    return grid[cells[:, 0], cells[:, 1]].astype(np.float64)
