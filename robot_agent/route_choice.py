"""Which route to drive when there are teammates: straight on, around them, or out of their way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Floats
from robot_agent.navigation_settings import RightOfWaySettings
from robot_agent.path_following import evenly_spaced
from robot_agent.planning_map import PlanningMap
from robot_agent.right_of_way import RightOfWay, Rival, Sighting
from robot_agent.route_planning import (
    Destination,
    Discs,
    Route,
    route_out_of_the_way,
    route_to_goal,
)

# So far beyond the place where two robots would meet the other's path is kept out of [m].
_BEYOND_MEETING = 1.5
# What a teammate is going to drive is drawn as discs this far apart [m].
_CLAIM_SPACING = 0.2
# So long a wave from the goal serves for an estimate while the map changes [s].
_AIM_LASTS = 8.0
# A robot that waits on its own path stops so far before the other's way [m].
_STOP_BEFORE = 0.15


@dataclass(frozen=True, slots=True)
class Situation:
    """What a choice is made from.

    Attributes:
        here_map: (x, y) [m] of the robot.
        goal_map: (x, y) [m], None if it has nowhere to go.
        tolerance: how near to the goal it must get [m].
        busy: whether it drives for a task.
        stands_since: since when it has not moved [s].
        spots: places to keep out of that are not in the map.
        others: the teammates.
    """

    here_map: tuple[float, float]
    goal_map: tuple[float, float] | None
    tolerance: float
    busy: bool
    stands_since: float
    spots: Sequence[Discs]
    others: Sequence[Sighting]


@dataclass(frozen=True, slots=True)
class Choice:
    """What to drive.

    Attributes:
        route: None to stay.
        stop_at: how far along the route to go for now [m].
        giving_way: whether the robot makes way for a teammate.
        to_go: length of the direct way to the goal [m].
        reachable: whether the goal can be reached by what is known; true without a goal.
    """

    route: Route | None
    stop_at: float
    giving_way: bool
    to_go: float
    reachable: bool


class RouteChoice:
    """Plans routes of one robot among its teammates."""

    def __init__(self, name: str, body_radius: float, settings: RightOfWaySettings) -> None:
        """Plan for the robot `name` of this radius [m]."""
        self._radius = body_radius
        self._settings = settings
        self._right_of_way = RightOfWay(name, settings)
        self._destination: Destination | None = None

    def rivals(self, now: float, situation: Situation, path_map: Floats) -> list[Rival]:
        """Return the teammates to make way for when driving `path_map` (n, 2) [m]."""
        return self._right_of_way.rivals(
            now, path_map, self._radius, situation.busy, situation.stands_since, situation.others
        )

    def choose(self, now: float, situation: Situation, planning_map: PlanningMap) -> Choice:
        """Return what to drive at mission time `now` [s]."""
        self._aim(now, situation, planning_map)
        direct = self._direct(situation, planning_map)
        here = np.array([situation.here_map])
        reachable = situation.goal_map is None or direct is not None
        to_go = direct.path.length if direct else 0.0
        rivals = self.rivals(now, situation, direct.path.points_map if direct else here)
        if not rivals:
            return Choice(direct, math.inf, False, to_go, reachable)
        if direct is not None and all(rival.joining for rival in rivals):
            stop_at = min(rival.mine for rival in rivals) - _STOP_BEFORE
            return Choice(direct, stop_at, True, to_go, reachable)
        if direct is not None:
            around = self._around(situation, planning_map, rivals)
            if around is not None and not self.rivals(now, situation, around.path.points_map):
                return Choice(around, math.inf, False, around.path.length, True)
        route, stop_at = self._out_of_the_way(situation, planning_map, rivals, direct)
        return Choice(route, stop_at, True, to_go, reachable)

    def _aim(self, now: float, situation: Situation, planning_map: PlanningMap) -> None:
        """Keep what is left to go from anywhere to the goal, by a map that is not too old."""
        aim, goal = self._destination, situation.goal_map
        if goal is None:
            self._destination = None
            return
        fits = (
            aim is not None
            and aim.goal_map == goal
            and aim.tolerance == situation.tolerance
            and aim.to_go.shape == planning_map.geometry.shape
            and (aim.map_number == planning_map.number or now - aim.stamp < _AIM_LASTS)
        )
        if not fits:
            self._destination = Destination.on_map(
                planning_map, goal, situation.tolerance, situation.here_map, now
            )

    def _direct(self, situation: Situation, planning_map: PlanningMap) -> Route | None:
        """Return the way to the goal past everything that stands; else past what will not move."""
        standing = self._standing(situation)
        tries = [[*situation.spots, *standing]]
        if tries[0]:
            tries.append(self._standing(situation, silent_only=True))
        for keep_out in tries:
            route = self._to_goal(situation, planning_map, keep_out)
            if route is not None:
                return route
        return None

    def _to_goal(
        self,
        situation: Situation,
        planning_map: PlanningMap,
        keep_out: Sequence[Discs],
        detour: float = math.inf,
    ) -> Route | None:
        """Return the route to the goal that keeps out of some discs, not much longer [m]."""
        if self._destination is None:
            return None
        return route_to_goal(
            planning_map, situation.here_map, self._destination, self._radius, keep_out, detour
        )

    def _standing(self, situation: Situation, silent_only: bool = False) -> list[Discs]:
        """Return the teammates that stay where they are, as obstacles."""
        return [
            Discs(
                np.array([[other.x, other.y]]),
                self._radius + other.teammate.radius + self._settings.gap_m,
            )
            for other in situation.others
            if (other.silent if silent_only else other.stays)
        ]

    def _around(
        self, situation: Situation, planning_map: PlanningMap, rivals: Sequence[Rival]
    ) -> Route | None:
        """Return the way to the goal that keeps out of where the rivals drive."""
        keep_out = [*situation.spots, *self._standing(situation)]
        for rival in rivals:
            reach = self._radius + rival.sighting.teammate.radius + self._settings.gap_m
            claimed = _first_metres(rival.sighting.path_map, rival.theirs + _BEYOND_MEETING)
            keep_out.append(Discs(claimed, reach + 0.05))
        return self._to_goal(situation, planning_map, keep_out, self._settings.detour_m)

    def _out_of_the_way(
        self,
        situation: Situation,
        planning_map: PlanningMap,
        rivals: Sequence[Rival],
        direct: Route | None,
    ) -> tuple[Route | None, float]:
        """Return where to wait until the rivals have passed, and how far along to go there."""
        leave, keep_out = [], [*situation.spots, *self._standing(situation)]
        for rival in rivals:
            between = self._radius + rival.sighting.teammate.radius
            path = _first_metres(rival.sighting.path_map, self._settings.horizon_m)
            leave.append(Discs(path, between + self._settings.gap_waiting_m))
            keep_out.append(Discs(path[:1], between + self._settings.gap_least_m))
        if not _inside(np.array([situation.here_map]), leave).any():
            if direct is None:
                return None, math.inf
            inside = np.flatnonzero(_inside(direct.path.points_map, leave))
            lengths = direct.path.lengths
            return direct, float(lengths[inside[0]]) - _STOP_BEFORE if len(inside) else math.inf
        return (
            route_out_of_the_way(planning_map, situation.here_map, self._radius, keep_out, leave),
            math.inf,
        )


def _first_metres(path_map: Floats, length: float) -> Floats:
    """Return the first `length` [m] of a path as close points (n, 2) [m], at least one."""
    if len(path_map) < 2:
        return path_map
    points = evenly_spaced(np.ascontiguousarray(path_map), _CLAIM_SPACING)
    return points[: math.ceil(length / _CLAIM_SPACING) + 1]


def _inside(
    points_map: Floats, discs: Sequence[Discs]
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return for each point (n, 2) [m] whether it lies in any of the discs, (n,) bool."""
    inside = np.zeros(len(points_map), dtype=np.bool_)
    for disc in discs:
        apart = points_map[:, None, :] - disc.centres_map[None, :, :]
        inside |= ((apart**2).sum(axis=2) < disc.radius**2).any(axis=1)
    return inside
