"""From the path to a motion command that touches nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Floats, Pose2
from protocol.body import Body
from robot_agent.avoidance import best_curvature, calmed, free_way
from robot_agent.navigation_settings import DrivingSettings, RightOfWaySettings
from robot_agent.path_following import SHARPEST_CURVE, DrivenPath, Pursuit, pursue
from robot_agent.right_of_way import Sighting

# Arcs tried when the one along the path is not free [1/m].
_CURVES = np.linspace(-SHARPEST_CURVE, SHARPEST_CURVE, 17)
# From the moment something is seen to the moment wheels obey [s].
_REACTION = 0.25
# Slower than this the robot stands [m/s].
_STANDS = 0.04
# Another arc is looked for when the one along the path allows less than this share of the speed.
_HINDERED = 0.8
# It must allow at least this share of what that one does.
_AS_FAST = 0.9
# Another arc must get this much nearer to the target than standing still does [m].
_WORTHWHILE = 0.05
# What stands this near behind a teammate's rim is taken for the teammate [m].
_TELL_APART = 0.25
# Teammates farther away than this do not matter to the next second of driving [m].
_NEAR = 2.5


@dataclass(frozen=True, slots=True)
class Steered:
    """A motion command and why it is what it is.

    Attributes:
        speed: [m/s].
        turn_rate: [rad/s].
        blocked: whether the robot would go on but something is in the way.
        by_teammate: whether a teammate is that.
    """

    speed: float
    turn_rate: float
    blocked: bool
    by_teammate: bool


class Steering:
    """Drives along a path past what the lidar sees."""

    def __init__(
        self, body: Body, settings: DrivingSettings, right_of_way: RightOfWaySettings
    ) -> None:
        """Steer a robot with this body."""
        self._body = body
        self._settings = settings
        self._gap_between = right_of_way.gap_least_m
        self._turning = False

    def halt(self) -> None:
        """Forget the manoeuvre under way."""
        self._turning = False

    def follow(
        self,
        path: DrivenPath,
        T_map_base: Pose2,
        points_base: Floats,
        others: Sequence[Sighting],
    ) -> Steered:
        """Return the command that follows `path`.

        Args:
            path: with `advance` called for this pose.
            T_map_base: where the robot is.
            points_base: (n, 2) [m], what the lidar sees, base frame, in the order of the beams.
            others: the teammates.
        """
        drive = self._body.drive
        wish = pursue(
            path,
            T_map_base,
            self._settings,
            drive.speed_max_m_s,
            drive.turn_rate_max_rad_s,
            self._turning,
        )
        self._turning = wish.on_spot
        if wish.on_spot:
            return Steered(0.0, wish.turn_rate, False, False)
        points = calmed(np.ascontiguousarray(points_base, dtype=np.float64))
        bodies = self._bodies(T_map_base, others)
        curvature = wish.turn_rate / wish.speed
        speed, by_teammate = self._allowed(points, bodies, curvature, wish.speed)
        if speed < _HINDERED * wish.speed:
            speed, curvature, by_teammate = self._evade(
                points, bodies, wish, curvature, speed, by_teammate
            )
        if speed < _STANDS:
            return self._look_at_target(wish, by_teammate or _someone_ahead(bodies))
        return Steered(speed, speed * curvature, False, by_teammate)

    def _bodies(self, T_map_base: Pose2, others: Sequence[Sighting]) -> Floats:
        """Return the near teammates as rows (m, 5), see `avoidance.free_way`."""
        c, s = math.cos(T_map_base.theta), math.sin(T_map_base.theta)
        rows = []
        for other in others:
            dx, dy = other.x - T_map_base.x, other.y - T_map_base.y
            if dx * dx + dy * dy < _NEAR * _NEAR:
                least = self._body.radius_m + other.teammate.radius + self._gap_between
                rows.append(
                    (
                        c * dx + s * dy,
                        c * dy - s * dx,
                        c * other.vx + s * other.vy,
                        c * other.vy - s * other.vx,
                        least,
                    )
                )
        return np.array(rows, dtype=np.float64).reshape(-1, 5)

    def _allowed(
        self, points: Floats, bodies: Floats, curvature: float, speed: float
    ) -> tuple[float, bool]:
        """Return how fast [m/s] an arc may be driven, and whether a teammate limits that."""
        settings = self._settings
        radius = self._body.radius_m
        free, nearest, by_teammate = free_way(
            points,
            radius + settings.gap_least_m,
            bodies,
            curvature,
            speed,
            settings.watch_ahead_m,
            0,
        )
        if free < settings.watch_ahead_m:
            # v * reaction + v^2 / (2 a) = free, solved for v.
            a = settings.braking_m_s2
            speed = min(speed, a * (math.sqrt(_REACTION**2 + 2.0 * free / a) - _REACTION))
        else:
            by_teammate = False
        wide = settings.gap_full_speed_m - settings.gap_least_m
        room = min(max((nearest - radius - settings.gap_least_m) / wide, 0.0), 1.0)
        tight = settings.speed_tight_m_s
        return min(speed, tight + room * (self._body.drive.speed_max_m_s - tight)), by_teammate

    def _evade(
        self,
        points: Floats,
        bodies: Floats,
        wish: Pursuit,
        curvature: float,
        speed: float,
        by_teammate: bool,
    ) -> tuple[float, float, bool]:
        """Return speed, curvature and limit by a teammate of the best arc round an obstacle."""
        settings = self._settings
        reach = self._body.radius_m + settings.gap_least_m
        x, y = wish.target_base
        curves = np.concatenate(((curvature,), _CURVES))
        other, left = best_curvature(
            points, reach, bodies, curves, wish.speed, settings.watch_ahead_m, x, y
        )
        if left > math.hypot(x, y) - _WORTHWHILE:
            return speed, curvature, by_teammate
        limit = self._body.drive.turn_rate_max_rad_s / max(abs(other), 1e-9)
        faster, limited = self._allowed(points, bodies, other, min(wish.speed, limit))
        if faster < _AS_FAST * speed:
            return speed, curvature, by_teammate
        return faster, other, limited

    def _look_at_target(self, wish: Pursuit, by_teammate: bool) -> Steered:
        """Stand, but turn towards where the path goes on: the disc touches nothing by turning."""
        error = math.atan2(wish.target_base[1], wish.target_base[0])
        limit = self._body.drive.turn_rate_max_rad_s
        rate = min(max(2.0 * error, -limit), limit) if abs(error) > 0.1 else 0.0
        return Steered(0.0, rate, True, by_teammate)


def _someone_ahead(bodies: Floats) -> bool:
    """Whether a teammate stands so near ahead that what the lidar sees there must be it."""
    away = np.hypot(bodies[:, 0], bodies[:, 1])
    return bool(((bodies[:, 0] > 0.0) & (away < bodies[:, 4] + _TELL_APART)).any())
