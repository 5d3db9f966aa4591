"""Where on the team's map idle robots wait best, out of everybody's way."""

from __future__ import annotations

import numpy as np

from coordination.task import Point
from coordination.waiting_place import IdleRobot, waiting_places
from mapping.distance_field import truncated_distance
from mapping.geometry import Floats, pose_from
from mapping.grid import CLEAR, OBSTACLE, classify
from mapping.path_planning import traversal_weights
from server.map_merger import MapMerger
from server.roster import Roster
from server.settings import MapSettings

_CLEARANCE_LIMIT = 1.0  # [m]; more room than this to wait in makes no difference
_COMFORT = 0.3  # [m]; room around the body that is worth a detour


def pose_of(merger: MapMerger, roster: Roster, name: str) -> tuple[float, float, float] | None:
    """Return a robot's last known pose (x, y, theta) in the map frame, or None."""
    where = roster.where.get(name)
    if where is None:
        return None
    T_map_base = merger.members[name].T_map_odom @ where.T_odom_base
    return T_map_base.x, T_map_base.y, pose_from(T_map_base.as_array()).theta


class WaitingGround:
    """Chooses waiting places on the map as it is."""

    def __init__(self, merger: MapMerger, roster: Roster, settings: MapSettings) -> None:
        self._merger = merger
        self._roster = roster
        self._settings = settings

    def choose(
        self, idle: tuple[IdleRobot, ...], places: Floats, gains: Floats
    ) -> dict[str, Point]:
        """Return where idle robots wait best, (x, y) [m] by name, map frame; not for all of them.

        Args:
            idle: the robots.
            places: (n, 2) [m] left to explore, map frame.
            gains: (n,) [m2] expected there.
        """
        merger, roster, settings = self._merger, self._roster, self._settings
        if not merger.nodes or not len(places):
            return {}
        classes = classify(merger.log_odds, settings.p_obstacle, settings.p_clear)
        geometry = merger.geometry
        radius = max(roster.bodies[robot.robot].radius_m for robot in idle)
        clearance = truncated_distance(classes == OBSTACLE, geometry.resolution, _CLEARANCE_LIMIT)
        weights = traversal_weights(classes == CLEAR, clearance, radius, radius + _COMFORT)
        waiting = {robot.robot for robot in idle}
        others = [name for name in roster.where if name not in waiting]
        taken: list[Floats] = [roster.where[name].path_map.astype(np.float64) for name in others]
        for name in others:
            pose = pose_of(merger, roster, name)
            if pose is not None:
                taken.append(np.array([pose[:2]]))
        occupied = np.concatenate([np.zeros((0, 2)), *taken])
        return waiting_places(weights, clearance, geometry, idle, places, gains, occupied)
