"""What robots saw of each other from where they started, and what that says of where they are.

Each tells the others what it saw. So each that must find out where it is knows what the central
server of other teams knows, and finds its place by the same rules.

Source: Simmons et al. 2000, section "Coordinated Mapping", for robots that begin in view of one
another; `mapping.mutual_sightings` for who is who.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Pose2
from mapping.mutual_sightings import MutualSightings
from mapping.placed_by_sight import Guess, seen_by_others
from protocol.messages import ScanReport
from protocol.peer_messages import Lookout

_EPSILON = 1e-9
# No start is told worse than this, whatever somebody says [m], [rad].
_ERROR_MOST, _TURN_MOST = 5.0, math.pi
# Discs farther away than this are none that a laser saw [m].
_FARTHEST = 1000.0


@dataclass(frozen=True, slots=True)
class Frame:
    """Where a robot's own map lies in the team's.

    Attributes:
        T_map_odom: there, as known or as told.
        told: largest errors of the start it was told [m], [rad].
        aligned: whether its place is known.
    """

    T_map_odom: Pose2
    told: tuple[float, float]
    aligned: bool


class Lookouts:
    """Collects what this robot and the others saw of each other.

    Args:
        me: this robot's name.
        period: what it saw is told no more often than this [s].
    """

    def __init__(self, me: str, period: float) -> None:
        self._me = me
        self._period = period
        self._next = 0.0
        self._seen = MutualSightings()
        self._frames: dict[str, Frame] = {}

    def see(self, report: ScanReport) -> None:
        """Take in what this robot saw itself."""
        sightings = report.sightings_odom.astype(np.float64)
        self._seen.add(self._me, report.T_odom_base, report.covariance, sightings)

    def hear(self, name: str, lookout: Lookout) -> None:
        """Take in what another robot tells that it saw."""
        places = np.vstack((lookout.place_own, lookout.discs_own)).astype(np.float64)
        if name == self._me or np.abs(places).max() > _FARTHEST:
            return
        errors = min(lookout.error_m, _ERROR_MOST), min(lookout.error_rad, _TURN_MOST)
        variance = min(lookout.turn_variance, _TURN_MOST**2)
        self._frames[name] = Frame(lookout.T_map_own, errors, lookout.tied)
        self._seen.put(name, places[0], variance, places[1:])

    def forget(self, name: str) -> None:
        """Forget what was told by one that is not listened to any more."""
        self._frames.pop(name, None)
        self._seen.forget(name)

    def due(self, own: Frame, life: int, now: float) -> Lookout | None:
        """Return what this robot saw, for the others, if it is time and there is something.

        Args:
            own: where its own map lies.
            life: which life of the robot this is.
            now: mission time [s].
        """
        lookout = self._seen.lookout(self._me)
        if lookout is None or now < self._next - _EPSILON:
            return None
        self._next = now + self._period
        return Lookout(
            life=life,
            T_map_own=own.T_map_odom,
            tied=own.aligned,
            error_m=own.told[0],
            error_rad=own.told[1],
            place_own=lookout.place_odom.astype(np.float32).reshape(1, 2),
            turn_variance=lookout.turn_variance,
            discs_own=lookout.discs.astype(np.float32),
        )

    def guess(self, own: Frame) -> Guess | None:
        """Return where this robot's own map lies by what robots saw of each other, or None.

        Args:
            own: where it lies as far as it was told.
        """
        frames = {**self._frames, self._me: own}
        relation = seen_by_others(self._me, frames, self._seen)
        if relation is None:
            return None
        return Guess(relation.T_a_b, relation.covariance, seen=True)
