"""A robot that is tied to the team's map sees whether it is where it thinks, and mends it if not.

What it saw at the start ties it to a few centimetres and a degree; a degree is much at the far end
of a building. So what it sees later, where others were before it, is laid onto what these saw, all
of it together: the robot's own map is moved as a whole. If it does not fit at all, the tie was
wrong, and its place is searched for anew.

A robot fits only to those whose names come before its own, so that no two ever follow each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from mapping.geometry import Floats, Pose2
from mapping.match_map import MatchMap
from mapping.placed_by_sight import Guess
from robot_agent.decentral.alignment import Fit, Placed, explained, lay, map_of
from robot_agent.decentral.settings import TyingSettings
from robot_agent.decentral.tying import contradicts, doubts

_EPSILON = 1e-9
# Two scans from within this distance of each other show the same walls [m].
_NEAR = 4.0
# The others' scans from within this distance show all that these can see [m].
_AROUND = 8.0
# So many own scans are compared, evenly drawn from those made where others were.
_OWN_MOST = 16
# So many of the others' scans are drawn.
_OTHERS_MOST = 80
# Two places fit equally well if the shares of end points at walls differ by less than this.
_AS_WELL = 0.02


class Mending:
    """Looks now and then whether all that the robot saw fits what others saw.

    It looks ever more seldom while all is well, as there is ever more to compare.

    Args:
        settings: when a place is sure, and how often to look.
    """

    def __init__(self, settings: TyingSettings) -> None:
        self._settings = settings
        self._next = 0.0
        self._pause = settings.mend_period_s
        self._held = -1  # checksum of what was held at the last look
        self._wrong = 0  # so many looks in a row contradicted the tie

    def due(self, held: int, now: float) -> bool:
        """Whether something is new since the last look, and that is some time ago.

        Args:
            held: checksum of all that the robot holds.
            now: mission time [s].
        """
        if held == self._held or now < self._next - _EPSILON:
            return False
        self._held, self._next = held, now + self._pause
        self._pause = min(2.0 * self._pause, self._settings.mend_period_most_s)
        return True

    def look(
        self,
        own: Sequence[Placed],
        others: Sequence[Placed],
        T_map_own: Pose2,
        guesses: Iterable[Guess],
        resolution: float,
    ) -> Pose2 | None:
        """Return where the robot's own map lies, if it turns out to lie elsewhere than thought.

        Args:
            own: what the robot saw, and where in its own map, in order.
            others: what others saw to whom it fits itself, and where, map frame.
            T_map_own: where its own map is thought to lie.
            guesses: where it may lie if it does not lie there, the surest first.
            resolution: edge of a cell to match with [m].
        """
        met = _met(own, others, T_map_own)
        if len(met) < self._settings.scans:
            return None
        near = _distances(others, [T_map_own @ pose for _, pose in met]) <= _AROUND
        beside = [others[k] for k in np.flatnonzero(near).tolist()]
        around = map_of(beside, resolution, _OTHERS_MOST)
        thought = Fit(T_map_own, *explained(around, met, T_map_own), 0.0)
        if contradicts(thought, self._settings):
            self._wrong += 1
            enough = self._wrong >= self._settings.wrong_looks
            better = self._searched(around, met, guesses) if enough else None
        else:
            self._wrong = 0
            better = self._refined(around, met, thought)
        if self._wrong or better is not None:
            self._pause = self._settings.mend_period_s
        return better

    def _refined(self, around: MatchMap, met: Sequence[Placed], thought: Fit) -> Pose2 | None:
        """Return a place close by where what was seen surely fits better, None if there is none."""
        settings = self._settings
        place, turn = settings.mend_sigma_m, math.radians(settings.mend_sigma_deg)
        guess = Guess(thought.T_map_own, np.diag([place**2, place**2, turn**2]), seen=True)
        fit = lay(around, met, guess)
        least = settings.mend_m, math.radians(settings.mend_deg)
        if fit.share < thought.share - _AS_WELL or not fit.T_map_own.moved(
            thought.T_map_own, *least
        ):
            return None
        return None if doubts(fit, settings) else fit.T_map_own

    def _searched(
        self, around: MatchMap, met: Sequence[Placed], guesses: Iterable[Guess]
    ) -> Pose2 | None:
        """Return where what was seen surely fits after all, None if that is not clear."""
        # What was seen first comes last: guesses are of where the robot began.
        backwards = met[::-1]
        for guess in guesses:
            fit = lay(around, backwards, guess)
            if not doubts(fit, self._settings):
                return fit.T_map_own
        return None


def _met(own: Sequence[Placed], others: Sequence[Placed], T_map_own: Pose2) -> list[Placed]:
    """Return what the robot saw where others were, too; of much evenly some."""
    placed = [(scan, T_map_own @ pose) for scan, pose in own]
    near = np.flatnonzero(_distances(placed, [pose for _, pose in others]) <= _NEAR)
    every = max(1, math.ceil(len(near) / _OWN_MOST))
    return [own[k] for k in near[::every]]


def _distances(placed: Sequence[Placed], places: Sequence[Pose2]) -> Floats:
    """Return how far each placed scan is from the nearest of some places, (n,) [m], or infinite."""
    here = np.array([(pose.x, pose.y) for _, pose in placed]).reshape(-1, 1, 2)
    there = np.array([(pose.x, pose.y) for pose in places]).reshape(1, -1, 2)
    off = here - there
    nearest: Floats = np.hypot(off[..., 0], off[..., 1]).min(axis=1, initial=math.inf)
    return nearest
