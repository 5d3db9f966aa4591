"""Before a mission ends: no seam of the map may be loose while a robot could still mend it."""

from __future__ import annotations

import numpy as np

from coordination.task import Point
from mapping.geometry import Floats
from mapping.grid import CLEAR, classify
from mapping.seams import Seam
from protocol.effects import Effect, Note
from server.map_merger import MapMerger
from server.roster import Roster
from server.settings import MapSettings
from server.task_executive import TaskExecutive
from server.waiting_ground import pose_of

# A robot looks at a seam from about here, the first of these distances that are clear [m].
_VIEWS = (2.5, 2.0, 1.5, 1.0)
# A body needs so much more room than its radius [m].
_ROOM = 0.2
# The way from there to the walls must be clear but for this last bit [m], as they may be askew.
_ASKEW = 0.5
# A seam within this of one that was looked at is the same [m].
_SAME = 2.0


class LastLooks:
    """Sends robots to loose seams, a few times at most, and to no seam twice.

    A robot that does not get there in time is called back, and nobody is sent any more: a mission
    must come to its end.
    """

    def __init__(
        self, merger: MapMerger, roster: Roster, executive: TaskExecutive, settings: MapSettings
    ) -> None:
        self._merger = merger
        self._roster = roster
        self._executive = executive
        self._settings = settings
        self._looked_at: list[Floats] = []
        self._looking: tuple[str, float] | None = None  # who, and until when at most [s]
        self._over = False

    def next(self, now: float) -> list[Effect]:
        """Put the map right; where a seam stays loose, send a robot to have a look at it.

        Args:
            now: mission time [s].

        Returns:
            What tells the robot; nothing if there is no need, nobody to go, or no look left.
        """
        self._looking = None
        free = [name for name in self._roster.bodies if self._executive.free(name, now)]
        if self._over or len(self._looked_at) >= self._settings.last_looks or not free:
            return []
        self._merger.settle()
        for seam in self._merger.team.loose_seams(self._settings.loose_m):
            place = self._view(seam, max(self._roster.bodies[name].radius_m for name in free))
            if place is not None:
                self._looked_at.append(seam.ends.mean(axis=0))
                return self._send(min(free, key=lambda name: self._way(name, place)), place, now)
        return []

    def call_back(self, now: float) -> list[Effect]:
        """Return what calls a robot back that does not get to where it should look."""
        if self._looking is None or now < self._looking[1]:
            return []
        robot, self._looking = self._looking[0], None
        if self._executive.mode(robot) != "visit":
            return []
        self._over = True
        return list(self._executive.resume(robot, now).sends)

    def _view(self, seam: Seam, radius: float) -> Point | None:
        """Return from where a body sees both ends of a seam, (x, y) [m], map frame, if it may."""
        middle = seam.ends.mean(axis=0)
        if any(np.hypot(*(middle - other)) < _SAME for other in self._looked_at):
            return None
        for distance in _VIEWS:
            place = middle + distance * seam.outward
            around = radius + _ROOM
            ring = place + around * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
            ways = [_until(place, end, _ASKEW) for end in seam.ends]
            if self._clear(np.concatenate((ring, *ways))):
                return float(place[0]), float(place[1])
        return None

    def _clear(self, points: Floats) -> bool:
        """Whether all of some points (n, 2) [m] lie in clear cells of the map."""
        geometry, settings = self._merger.geometry, self._settings
        cells = geometry.cells_at(points)
        if not geometry.contains(cells).all():
            return False
        odds = self._merger.log_odds[cells[:, 0], cells[:, 1]]
        return bool((classify(odds, settings.p_obstacle, settings.p_clear) == CLEAR).all())

    def _send(self, robot: str, place: Point, now: float) -> list[Effect]:
        self._looking = robot, now + self._settings.look_s
        _, text, sends = self._executive.visit(robot, *place, now)
        return [Note("info", f"{text}, where pieces of the map hang loosely together"), *sends]

    def _way(self, robot: str, place: Point) -> float:
        """Return how far off a robot is [m], as the crow flies."""
        pose = pose_of(self._merger, self._roster, robot)
        assert pose is not None, "a robot that bids has been heard of"
        return float(np.hypot(pose[0] - place[0], pose[1] - place[1]))


def _until(start: Floats, end: Floats, short: float) -> Floats:
    """Return points (n, 2) on the way from `start` to `short` before `end`, 5 cm apart [m]."""
    away = end - start
    length = float(np.hypot(*away))
    steps = np.arange(0.0, max(length - short, 0.0), 0.05) / max(length, 1e-9)
    return start + steps[:, None] * away
