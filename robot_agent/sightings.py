"""Where the teammates are by now, from what they announced."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mapping.geometry import Floats
from robot_agent.right_of_way import Sighting, Teammate

# A place announced longer ago than this is not carried on along its path any further [s].
_LONGEST_PREDICTION = 1.0
# No teammate is believed to be faster [m/s]; its place in the map may jump.
_FASTEST = 0.8
# Slower than this it stands: estimates of its place waver [m/s].
_STANDS_BELOW = 0.05
# A robot that stays within this distance stands [m].
STANDS_WITHIN = 0.3


class TeammateTracks:
    """Follows the teammates from announcement to announcement."""

    def __init__(self, silent_after: float) -> None:
        """Start knowing nobody; who is not heard of for `silent_after` [s] counts as silent."""
        self._silent_after = silent_after
        self._last: dict[str, Teammate] = {}
        self._speeds: dict[str, float] = {}
        self._stands: dict[str, tuple[float, float, float]] = {}

    def sightings(self, now: float, teammates: Sequence[Teammate]) -> list[Sighting]:
        """Take in what was announced; return where everybody is now, in order of their names."""
        return [self._sighting(now, mate) for mate in sorted(teammates, key=lambda t: t.name)]

    def _sighting(self, now: float, mate: Teammate) -> Sighting:
        """Carry one teammate on to `now`."""
        before = self._last.get(mate.name)
        if before is not mate:
            self._note(mate, before)
        age = max(now - mate.stamp, 0.0)
        silent = age > self._silent_after
        speed = 0.0 if silent else self._speeds.get(mate.name, 0.0)
        path, direction = _carried_on(mate, speed * min(age, _LONGEST_PREDICTION))
        return Sighting(
            mate,
            float(path[0, 0]),
            float(path[0, 1]),
            speed * math.cos(direction),
            speed * math.sin(direction),
            path[:1] if silent else path,
            self._stands[mate.name][2],
            silent,
        )

    def _note(self, mate: Teammate, before: Teammate | None) -> None:
        """Keep a new announcement: speed, and since when it stands."""
        x, y = mate.T_map_base.x, mate.T_map_base.y
        if before is not None and mate.stamp > before.stamp:
            speed = mate.T_map_base.distance_to(before.T_map_base) / (mate.stamp - before.stamp)
            self._speeds[mate.name] = min(speed, _FASTEST) if speed > _STANDS_BELOW else 0.0
        self._last[mate.name] = mate
        stands = self._stands.get(mate.name)
        if stands is None or math.hypot(stands[0] - x, stands[1] - y) > STANDS_WITHIN:
            self._stands[mate.name] = (x, y, mate.stamp)


def _carried_on(mate: Teammate, travelled: float) -> tuple[Floats, float]:
    """Return the path (n, 2) [m] left after `travelled` [m], and its first direction [rad]."""
    here = np.array([[mate.T_map_base.x, mate.T_map_base.y]])
    announced = np.asarray(mate.path_map, dtype=np.float64).reshape(-1, 2)
    direction = mate.T_map_base.theta
    if len(announced) == 0:
        ahead = np.array([[math.cos(direction), math.sin(direction)]])
        return here + travelled * ahead, direction
    # What it had driven already when it announced its place is no longer ahead of it.
    first = int(np.argmin(((announced - here) ** 2).sum(axis=1)))
    path = np.concatenate((here, announced[first + 1 :]))
    steps = np.hypot(*np.diff(path, axis=0).T)
    lengths = np.concatenate(([0.0], np.cumsum(steps)))
    if lengths[-1] < 0.05:
        return here, direction
    travelled = min(travelled, float(lengths[-1]))
    k = min(int(np.searchsorted(lengths, travelled, side="right")), len(path) - 1)
    part = (travelled - lengths[k - 1]) / max(float(steps[k - 1]), 1e-9)
    start = path[k - 1] + part * (path[k] - path[k - 1])
    direction = math.atan2(path[k, 1] - path[k - 1, 1], path[k, 0] - path[k - 1, 0])
    return np.concatenate((start[None], path[k:])), direction
