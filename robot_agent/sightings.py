"""Where the teammates are by now, from what they announced."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.compiled import compiled
from mapping.geometry import Floats
from robot_agent.right_of_way import Sighting, Teammate

# A place announced longer ago than this is not carried on along its path any further [s].
_LONGEST_PREDICTION = 1.0
# No teammate is believed to be faster [m/s]; its place in the map may jump.
_FASTEST = 0.8
# Slower than this it stands: estimates of its place waver [m/s].
_STANDS_BELOW = 0.05
# An announced path shorter than this leads nowhere [m].
_SHORTEST_PATH = 0.05
# A robot that stays within this distance stands [m].
STANDS_WITHIN = 0.3


@dataclass(frozen=True, slots=True)
class _Track:
    """A teammate's last announcement, made ready for being carried on.

    Attributes:
        teammate: the announcement.
        path_map: (n, 2) [m], from where it was; one point if it stays.
        lengths: (n,) [m] along that path.
        direction: in which it sets out [rad].
        speed: estimated from its last two announcements [m/s].
        stood_at: where it stands, or stood last [m].
        stands_since: since when it has not left that place [s].
    """

    teammate: Teammate
    path_map: Floats
    lengths: Floats
    direction: float
    speed: float
    stood_at: tuple[float, float]
    stands_since: float


class TeammateTracks:
    """Follows the teammates from announcement to announcement."""

    def __init__(self, silent_after: float) -> None:
        """Start knowing nobody; who is not heard of for `silent_after` [s] counts as silent."""
        self._silent_after = silent_after
        self._tracks: dict[str, _Track] = {}

    def sightings(self, now: float, teammates: Sequence[Teammate]) -> list[Sighting]:
        """Take in what was announced; return where everybody is now, in order of their names."""
        return [self._sighting(now, mate) for mate in sorted(teammates, key=lambda t: t.name)]

    def _sighting(self, now: float, mate: Teammate) -> Sighting:
        """Carry one teammate on to `now`."""
        track = self._tracks.get(mate.name)
        if track is None or track.teammate is not mate:
            track = self._tracks[mate.name] = _tracked(mate, track)
        age = max(now - mate.stamp, 0.0)
        silent = age > self._silent_after
        speed = 0.0 if silent else track.speed
        path, direction = _carried_on(track, speed * min(age, _LONGEST_PREDICTION))
        return Sighting(
            mate,
            float(path[0, 0]),
            float(path[0, 1]),
            speed * math.cos(direction),
            speed * math.sin(direction),
            path[:1] if silent else path,
            track.stands_since,
            silent,
        )


def _tracked(mate: Teammate, before: _Track | None) -> _Track:
    """Return the track after an announcement."""
    x, y = mate.T_map_base.x, mate.T_map_base.y
    speed, stood_at, stands_since = 0.0, (x, y), mate.stamp
    if before is not None:
        speed = before.speed
        passed = mate.stamp - before.teammate.stamp
        if passed > 0.0:
            speed = mate.T_map_base.distance_to(before.teammate.T_map_base) / passed
            speed = min(speed, _FASTEST) if speed > _STANDS_BELOW else 0.0
        if math.hypot(before.stood_at[0] - x, before.stood_at[1] - y) <= STANDS_WITHIN:
            stood_at, stands_since = before.stood_at, before.stands_since
    path, direction = np.array([[x, y]]), mate.T_map_base.theta
    announced = np.asarray(mate.path_map, dtype=np.float64).reshape(-1, 2)
    if len(announced):
        path = np.concatenate((path, announced[_passed(announced, x, y) :]))
    lengths = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
    if lengths[-1] < _SHORTEST_PATH:
        path, lengths = path[:1], lengths[:1]
    else:
        direction = math.atan2(path[1, 1] - y, path[1, 0] - x)
    return _Track(mate, path, lengths, direction, speed, stood_at, stands_since)


def _passed(announced: Floats, x: float, y: float) -> int:
    """Return how many points of an announced path (n, 2) [m] lie behind a robot at (x, y) [m]."""
    k = int(np.argmin(np.hypot(announced[:, 0] - x, announced[:, 1] - y)))
    along = announced[k] - announced[k - 1] if k > 0 else announced[1:2].sum(axis=0) - announced[0]
    here = announced[k] - (x, y)
    behind = len(announced) > 1 and float(here[0] * along[0] + here[1] * along[1]) <= 0.0
    return k + 1 if behind else k


def _carried_on(track: _Track, travelled: float) -> tuple[Floats, float]:
    """Return the path (n, 2) [m] left after `travelled` [m], and its first direction [rad]."""
    if travelled <= 0.0:
        return track.path_map, track.direction
    left: tuple[Floats, float] = _left_of(track.path_map, track.lengths, track.direction, travelled)
    return left


@compiled
def _left_of(
    path: Floats, lengths: Floats, direction: float, travelled: float
) -> tuple[Floats, float]:
    """Compiled body of `_carried_on`: cut off what was travelled, or go straight on."""
    if len(path) == 1:
        ahead = np.empty((1, 2))
        ahead[0, 0] = path[0, 0] + travelled * math.cos(direction)
        ahead[0, 1] = path[0, 1] + travelled * math.sin(direction)
        return ahead, direction
    travelled = min(travelled, lengths[-1])
    k = min(int(np.searchsorted(lengths, travelled, side="right")), len(path) - 1)
    ax, ay, bx, by = path[k - 1, 0], path[k - 1, 1], path[k, 0], path[k, 1]
    part = (travelled - lengths[k - 1]) / max(lengths[k] - lengths[k - 1], 1e-9)
    left = np.empty((len(path) - k + 1, 2))
    left[0, 0], left[0, 1] = ax + part * (bx - ax), ay + part * (by - ay)
    left[1:] = path[k:]
    return left, math.atan2(by - ay, bx - ax)
