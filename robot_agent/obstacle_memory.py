"""Obstacles that are not in the team's map: what the robot sees, and where it got stuck."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Floats, Pose2
from robot_agent.path_following import DrivenPath
from robot_agent.planning_map import PlanningMap
from robot_agent.right_of_way import Sighting
from robot_agent.route_planning import Discs

# Scan points this near are taken for obstacles if nothing explains them [m].
_NEAR_POINTS = 3.0
# A point this near to a mapped obstacle, or to a teammate's rim, is explained by it [m].
_EXPLAINED = 0.2
# So far along its path the robot remembers what made it leave the path [m].
_REMEMBERED = 3.0


@dataclass(frozen=True, slots=True)
class _Spot:
    """A place to keep out of until a time [s]."""

    discs: Discs
    until: float


class ObstacleMemory:
    """Keeps places that a robot of some radius has to keep out of for a while."""

    def __init__(self, body_radius: float, lasts: float) -> None:
        """Remember each obstacle for `lasts` [s]."""
        self._body_radius = body_radius
        self._lasts = lasts
        self._spots: list[_Spot] = []

    def add(self, now: float, discs: Discs) -> None:
        """Keep out of `discs` from mission time `now` [s] on."""
        self._spots.append(_Spot(discs, now + self._lasts))

    def keep_out(self, now: float, seen_map: Floats, path: DrivenPath | None) -> list[Discs]:
        """Return all places to keep out of.

        Args:
            now: mission time [s].
            seen_map: (n, 2) [m], what is seen now and in no map.
            path: the path driven so far, if there is one.
        """
        self._spots = [spot for spot in self._spots if spot.until > now]
        places = [spot.discs for spot in self._spots]
        if len(seen_map):
            seen = Discs(seen_map, self._body_radius)
            places.append(seen)
            if path is not None and self._hinders(seen_map, path):
                # A detour turns the robot's eyes away from what made it take the detour.
                self.add(now, seen)
        return places

    def _hinders(self, seen_map: Floats, path: DrivenPath) -> bool:
        """Whether any of the points (n, 2) [m] stands in the next metres of a path."""
        ahead = path.ahead(_REMEMBERED)
        apart = ((ahead[:, None, :] - seen_map[None, :, :]) ** 2).sum(axis=2)
        return bool((apart < self._body_radius**2).any())


def unmapped_points(
    planning_map: PlanningMap,
    T_map_base: Pose2,
    points_base: Floats,
    others: Sequence[Sighting],
) -> Floats:
    """Return the near scan points (n, 2) [m], map frame, that neither map nor teammates explain.

    Args:
        planning_map: the robot's map.
        T_map_base: where the robot is.
        points_base: (m, 2) [m], what the lidar sees, base frame.
        others: the teammates.
    """
    near = points_base[(points_base**2).sum(axis=1) < _NEAR_POINTS**2]
    points = T_map_base.apply(near)
    geometry = planning_map.geometry
    points = points[geometry.contains(geometry.cells_at(points))]
    cells = geometry.cells_at(points)
    points = points[planning_map.clearance[cells[:, 0], cells[:, 1]] > _EXPLAINED]
    for other in others:
        away = np.hypot(points[:, 0] - other.x, points[:, 1] - other.y)
        points = points[away > other.teammate.radius + _EXPLAINED]
    return points
