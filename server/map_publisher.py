"""Publishes the team's map, whole or in numbered changes, and where everybody is in it."""

from __future__ import annotations

import numpy as np

from protocol.map_feed import MapFeed
from protocol.messages import TeamPoses
from server.map_merger import MapMerger
from server.roster import Roster
from server.settings import MapSettings
from server.task_executive import TaskExecutive

_EPSILON = 1e-9


class MapPublisher:
    """Says when the next change or the next poses are due, and makes the messages.

    Attributes:
        map: tells the map and its changes.
    """

    def __init__(self, merger: MapMerger, settings: MapSettings) -> None:
        self.map = MapFeed(merger, settings.delta_period_s)
        self._merger = merger
        self._settings = settings
        self._next_poses = 0.0

    def next_deadline(self) -> float:
        """Return when something is due next [s]."""
        return min(self.map.due, self._next_poses)

    def poses_due(self, roster: Roster, executive: TaskExecutive, now: float) -> TeamPoses | None:
        """Return where everybody is, if it is time and anybody told."""
        if now < self._next_poses - _EPSILON:
            return None
        self._next_poses = now + self._settings.poses_period_s
        return self._poses(roster, executive)

    def _poses(self, roster: Roster, executive: TaskExecutive) -> TeamPoses | None:
        """Return where everybody is and is about to go."""
        where, merger = roster.where, self._merger
        names = [name for name in where if where[name].heard]
        if not names:
            return None
        rows, paths = [], []
        for name in names:
            T_map_base = merger.members[name].T_map_odom @ where[name].T_odom_base
            rows.append([where[name].stamp, T_map_base.x, T_map_base.y, T_map_base.theta])
            paths.append(where[name].path_map)
        return TeamPoses(
            robots=tuple(names),
            poses_map=np.array(rows, dtype=np.float64).reshape(-1, 4),
            radii_m=np.array([where[n].radius for n in names], dtype=np.float32),
            uncertainty_m=np.array([merger.uncertainty(n) for n in names], dtype=np.float32),
            paths_map=np.concatenate(paths).astype(np.float32).reshape(-1, 2),
            path_lengths=tuple(len(path) for path in paths),
            busy=tuple(executive.busy(name) for name in names),
        )
