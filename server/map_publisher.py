"""Publishes the team's map, whole or in numbered changes, and where everybody is in it."""

from __future__ import annotations

import numpy as np

from protocol.map_cells import pack_cells
from protocol.messages import MapDelta, MapSnapshot, TeamPoses
from server.map_merger import MapMerger
from server.roster import Roster
from server.settings import MapSettings
from server.task_executive import TaskExecutive

_EPSILON = 1e-9


class MapPublisher:
    """Says when the next change or the next poses are due, and makes the messages.

    Attributes:
        number: of the map as published last; 0 is the empty map every mission begins with.
    """

    def __init__(self, merger: MapMerger, settings: MapSettings) -> None:
        self.number = 0
        self._merger = merger
        self._settings = settings
        self._next_delta = 0.0
        self._next_poses = 0.0

    def next_deadline(self) -> float:
        """Return when something is due next [s]."""
        return min(self._next_delta, self._next_poses)

    def delta_due(self, now: float) -> MapDelta | None:
        """Return the rectangle of the map that changed, if it is time and there is one."""
        if now < self._next_delta - _EPSILON:
            return None
        self._next_delta = now + self._settings.delta_period_s
        return self.delta()

    def poses_due(self, roster: Roster, executive: TaskExecutive, now: float) -> TeamPoses | None:
        """Return where everybody is, if it is time and anybody told."""
        if now < self._next_poses - _EPSILON:
            return None
        self._next_poses = now + self._settings.poses_period_s
        return self._poses(roster, executive)

    def snapshot(self) -> MapSnapshot:
        """Return the whole map as published so far and the changes since."""
        geometry = self._merger.geometry
        return MapSnapshot(
            number=self.number,
            resolution_m=geometry.resolution,
            origin_x_m=geometry.origin_x,
            origin_y_m=geometry.origin_y,
            rows=geometry.rows,
            cols=geometry.cols,
            cells=pack_cells(self._merger.log_odds),
        )

    def delta(self) -> MapDelta | None:
        """Return the rectangle of the map that changed since the last one, None if nothing did."""
        if self._merger.dirty.empty:
            return None
        box, log_odds = self._merger.take_changes()
        self.number += 1
        return MapDelta(
            number=self.number,
            resolution_m=self._merger.geometry.resolution,
            lattice_x=box.ix0,
            lattice_y=box.iy0,
            rows=box.iy1 - box.iy0,
            cols=box.ix1 - box.ix0,
            cells=pack_cells(log_odds),
        )

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
