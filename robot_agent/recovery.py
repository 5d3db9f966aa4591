"""Noticing that the robot gets nowhere, and getting it loose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mapping.geometry import Pose2, wrap_angle
from robot_agent.navigation_settings import RecoverySettings
from robot_agent.planning_map import PlanningMap
from robot_agent.right_of_way import Sighting

# A bump that lasts this long is no graze [s].
_BUMP_LASTS = 0.25
# Way gained that counts as progress [m].
_PROGRESS = 0.3
# Way gained since a recovery after which it counts as a success [m].
_SUCCESS = 1.5
# A robot that got stuck within this of where it did before is stuck at the same thing [m].
_SAME_PLACE = 0.6
# The turn of a recovery, alternating sides [rad], and its end at the latest [s].
_TURN = 0.8
_TURN_LASTS = 1.5


class StallWatch:
    """Notices when a robot that wants to drive does not get on."""

    def __init__(self, settings: RecoverySettings) -> None:
        """Watch with nothing seen so far."""
        self._settings = settings
        self._anchor = (math.inf, math.inf, 0.0)
        self._least_remaining = math.inf
        self._progress_at = 0.0
        self._bumped_since: float | None = None
        self.recoveries = 0
        self._recovered_at_remaining = math.inf
        self._stuck_at = (math.inf, math.inf)
        self._stuck_times = 0

    def start(self, now: float) -> None:
        """Begin to watch the drive to a new goal."""
        self.recoveries = 0
        self._recovered_at_remaining = math.inf
        self.excuse(now)
        self._bumped_since = None

    def excuse(self, now: float) -> None:
        """Standing was meant to be: start all clocks anew."""
        self._anchor = (math.inf, math.inf, now)
        self._least_remaining = math.inf
        self._progress_at = now

    def stalled(self, now: float, x: float, y: float, remaining: float, bumped: bool) -> bool:
        """Whether the robot, at (x, y) [m] with `remaining` [m] to go, needs to be got loose."""
        settings = self._settings
        ax, ay, since = self._anchor
        if math.hypot(x - ax, y - ay) > settings.stalled_within_m:
            self._anchor = (x, y, now)
            since = now
        if remaining < self._least_remaining - _PROGRESS:
            self._least_remaining, self._progress_at = remaining, now
        if remaining < self._recovered_at_remaining - _SUCCESS:
            self.recoveries, self._recovered_at_remaining = 0, math.inf
        if not bumped:
            self._bumped_since = None
        elif self._bumped_since is None:
            self._bumped_since = now
        held = self._bumped_since is not None and now - self._bumped_since >= _BUMP_LASTS
        return (
            held
            or now - since > settings.stalled_after_s
            or now - self._progress_at > settings.no_progress_after_s
        )

    def recovering(self, now: float, remaining: float) -> int:
        """Count one more recovery; return how many there were without success."""
        self.recoveries += 1
        self._recovered_at_remaining = min(self._recovered_at_remaining, remaining)
        self._bumped_since = None
        self.excuse(now)
        return self.recoveries

    def stuck_here(self, x: float, y: float) -> int:
        """Count that the robot got stuck at (x, y) [m]; return how often it did here, any goal."""
        if math.hypot(x - self._stuck_at[0], y - self._stuck_at[1]) > _SAME_PLACE:
            self._stuck_at, self._stuck_times = (x, y), 0
        self._stuck_times += 1
        return self._stuck_times


@dataclass(slots=True)
class Recovery:
    """One attempt to get loose: back up, then turn.

    Attributes:
        T_map_base: where it began.
        back_up: how far to back up [m]; 0 if there is no room.
        turn: by how much to turn afterwards [rad].
        until: when the present part ends at the latest [s].
        turning_from: heading where the turn began [rad]; None while backing up.
    """

    T_map_base: Pose2
    back_up: float
    turn: float
    until: float
    turning_from: float | None = None

    @classmethod
    def begin(
        cls, now: float, T_map_base: Pose2, room: float, count: int, settings: RecoverySettings
    ) -> Recovery:
        """Begin attempt number `count` with `room` [m] behind the robot."""
        back_up = min(room, settings.back_up_m)
        lasts = back_up / settings.back_up_speed_m_s + 0.5 if back_up > 0.02 else 0.0
        return cls(T_map_base, back_up, _TURN if count % 2 else -_TURN, now + lasts)

    def step(
        self, now: float, T_map_base: Pose2, settings: RecoverySettings, turn_rate_max: float
    ) -> tuple[float, float] | None:
        """Return the speed [m/s] and turn rate [rad/s] to drive, None when it is through."""
        if self.turning_from is None:
            if now < self.until and self.T_map_base.distance_to(T_map_base) < self.back_up:
                return -settings.back_up_speed_m_s, 0.0
            self.turning_from, self.until = T_map_base.theta, now + _TURN_LASTS
        turned = wrap_angle(T_map_base.theta - self.turning_from)
        if now < self.until and abs(turned) < abs(self.turn):
            return 0.0, math.copysign(0.75 * turn_rate_max, self.turn)
        return None


def room_behind(
    planning_map: PlanningMap,
    T_map_base: Pose2,
    others: Sequence[Sighting],
    body_radius: float,
    length: float,
) -> float:
    """Return how far [m] the robot can back up straight: by the map, for the rear is not seen.

    Args:
        planning_map: the robot's map.
        T_map_base: where the robot is.
        others: the teammates; with one near there is no room.
        body_radius: of the robot [m].
        length: how far it wants to back up [m].
    """
    for other in others:
        away = math.hypot(other.x - T_map_base.x, other.y - T_map_base.y)
        if away < body_radius + other.teammate.radius + 2.0 * length:
            return 0.0
    geometry = planning_map.geometry
    step = 0.5 * geometry.resolution
    c, s = math.cos(T_map_base.theta), math.sin(T_map_base.theta)
    needed, held, room = body_radius + geometry.resolution, 0.0, 0.0
    for k in range(round(length / step) + 1):
        clearance = planning_map.clearance_at(
            T_map_base.x - c * k * step, T_map_base.y - s * k * step
        )
        # Too near to something already, it may go where that gets no worse.
        if clearance < held:
            break
        held, room = min(clearance, needed), k * step
    return room
