"""Following a path: where on it the robot is, and the arc that leads along it.

Source: Coulter 1992 (pure pursuit); Macenski et al. 2023 (regulated pure pursuit): the speed is cut
only where the curve, obstacles or the end of the path ask for it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.bucket_wave import BLOCKED
from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2, wrap_angle
from robot_agent.navigation_settings import DrivingSettings

# Points of a path are this far apart [m]: finer than any lookahead.
SPACING = 0.1
# How far along the path the robot is searched for from where it was last [m]. Less than the way
# round a wall's end, so that the search does not jump to the other side.
_SEARCH_AHEAD = 1.5
_SEARCH_BEHIND = 0.3
# Gain from heading error to turn rate when turning on the spot [1/s].
_TURN_GAIN = 2.5
# The curve of an arc must not be sharper than this [1/m], or pure pursuit circles its target.
SHARPEST_CURVE = 4.0


class DrivenPath:
    """A path in the map frame and how far along it the robot is.

    Attributes:
        points_map: (n, 2) [m], evenly spaced, start first; n is at least 2.
        lengths: (n,) [m] along the path.
        gaps: (n,) [m], clearance of the map along it.
        at: how far along the path the robot is [m].
        off: how far off the path it is [m].
    """

    def __init__(self, points_map: Floats, gaps: Floats) -> None:
        """Take a path; the robot is at its start."""
        steps = np.hypot(*np.diff(points_map, axis=0).T)
        self.points_map = np.ascontiguousarray(points_map)
        self.lengths = np.concatenate(([0.0], np.cumsum(steps)))
        self.gaps = np.ascontiguousarray(gaps, dtype=np.float64)
        self.at = 0.0
        self.off = 0.0

    @property
    def length(self) -> float:
        """Length of the whole path [m]."""
        return float(self.lengths[-1])

    @property
    def remaining(self) -> float:
        """What is left of the path [m]."""
        return max(self.length - self.at, 0.0)

    @property
    def end(self) -> tuple[float, float]:
        """The last point (x, y) [m], map frame."""
        return float(self.points_map[-1, 0]), float(self.points_map[-1, 1])

    def advance(self, x: float, y: float) -> None:
        """Find the robot, at (x, y) [m] in the map frame, on the path."""
        self.at, self.off = _nearest_on_path(
            self.points_map, self.lengths, self.at - _SEARCH_BEHIND, self.at + _SEARCH_AHEAD, x, y
        )

    def point_at(self, length: float) -> tuple[float, float]:
        """Return the point (x, y) [m] so far along the path; its end beyond that."""
        found: tuple[float, float] = _point_at(self.points_map, self.lengths, length)
        return found

    def least_gap(self, ahead: float) -> float:
        """Return the least clearance [m] of the map on the next `ahead` [m]."""
        found: float = _least_gap(self.gaps, self.lengths, self.at, self.at + ahead)
        return found

    def ahead(self, length: float, spacing: float = SPACING) -> Floats:
        """Return the next `length` [m] as points (n, 2) [m], `spacing` apart, from the robot on."""
        last = min(self.at + length, self.length)
        return _points_between(self.points_map, self.lengths, self.at, last, spacing)

    def first_blocked(
        self,
        weights: npt.NDArray[np.uint8],
        origin_x: float,
        origin_y: float,
        resolution: float,
        ahead: float,
    ) -> float:
        """Return how far ahead [m] the path enters a blocked cell; inf if not within `ahead`."""
        return _first_blocked(
            self.points_map,
            self.lengths,
            self.at,
            self.at + ahead,
            weights,
            origin_x,
            origin_y,
            resolution,
        )


@compiled
def _point_at(points: Floats, lengths: Floats, length: float) -> tuple[float, float]:
    """Return the point (x, y) so far along a path; its ends beyond them."""
    if length <= lengths[0]:
        return points[0, 0], points[0, 1]
    if length >= lengths[-1]:
        return points[-1, 0], points[-1, 1]
    k = int(np.searchsorted(lengths, length, side="right")) - 1
    beyond, step = length - lengths[k], lengths[k + 1] - lengths[k]
    return (
        (points[k + 1, 0] - points[k, 0]) / step * beyond + points[k, 0],
        (points[k + 1, 1] - points[k, 1]) / step * beyond + points[k, 1],
    )


@compiled
def _points_between(
    points: Floats, lengths: Floats, first: float, last: float, spacing: float
) -> Floats:
    """Return the points (n, 2) of a path from `first` to `last` along it, ends included."""
    count = max(math.ceil((last - first) / spacing), 0)
    between = np.empty((count + 1, 2))
    for k in range(count):
        between[k, 0], between[k, 1] = _point_at(points, lengths, first + k * spacing)
    between[count, 0], between[count, 1] = _point_at(points, lengths, last)
    return between


@compiled
def _least_gap(gaps: Floats, lengths: Floats, first: float, last: float) -> float:
    """Return the least of the gaps at points between two lengths, and at the next one beyond."""
    begin = min(int(np.searchsorted(lengths, first)), len(gaps) - 1)
    end = min(int(np.searchsorted(lengths, last)) + 1, len(gaps))
    least = gaps[begin]
    for k in range(begin + 1, end):
        least = min(least, gaps[k])
    return float(least)


@compiled
def _nearest_on_path(
    points: Floats, lengths: Floats, least: float, most: float, x: float, y: float
) -> tuple[float, float]:
    """Return where between two lengths a path is nearest to a point, and how near, both [m]."""
    found, nearest = lengths[0], 1e18
    for k in range(len(points) - 1):
        if lengths[k + 1] < least or lengths[k] > most:
            continue
        ax, ay = points[k, 0], points[k, 1]
        dx, dy = points[k + 1, 0] - ax, points[k + 1, 1] - ay
        span = dx * dx + dy * dy
        part = 0.0 if span <= 0.0 else ((x - ax) * dx + (y - ay) * dy) / span
        part = min(max(part, 0.0), 1.0)
        away = (ax + part * dx - x) ** 2 + (ay + part * dy - y) ** 2
        if away < nearest:
            nearest = away
            found = lengths[k] + part * (lengths[k + 1] - lengths[k])
    return found, math.sqrt(nearest)


@compiled
def _first_blocked(
    points: Floats,
    lengths: Floats,
    least: float,
    most: float,
    weights: npt.NDArray[np.uint8],
    origin_x: float,
    origin_y: float,
    resolution: float,
) -> float:
    """Compiled body of `DrivenPath.first_blocked`."""
    rows, cols = weights.shape
    for k in range(len(points)):
        if lengths[k] < least or lengths[k] > most:
            continue
        iy = math.floor((points[k, 1] - origin_y) / resolution)
        ix = math.floor((points[k, 0] - origin_x) / resolution)
        if iy < 0 or ix < 0 or iy >= rows or ix >= cols or weights[iy, ix] == BLOCKED:
            return float(lengths[k] - least)
    return np.inf


@compiled
def evenly_spaced(points: Floats, spacing: float) -> Floats:
    """Return a path (n, 2) [m] with points about `spacing` [m] apart, ends kept, n at least 2."""
    total = 0.0
    for k in range(len(points) - 1):
        total += math.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
    count = max(math.ceil(total / spacing), 1)
    result = np.empty((count + 1, 2))
    passed, k = 0.0, 0
    for i in range(count + 1):
        wanted = total * i / count
        while k < len(points) - 2:
            step = math.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
            if passed + step >= wanted:
                break
            passed += step
            k += 1
        if len(points) == 1:
            result[i] = points[0]
            continue
        step = math.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
        part = 0.0 if step <= 0.0 else min((wanted - passed) / step, 1.0)
        result[i, 0] = points[k, 0] + part * (points[k + 1, 0] - points[k, 0])
        result[i, 1] = points[k, 1] + part * (points[k + 1, 1] - points[k, 1])
    return result


@dataclass(frozen=True, slots=True)
class Pursuit:
    """What following the path asks for.

    Attributes:
        speed: [m/s]; 0 while turning on the spot.
        turn_rate: [rad/s].
        target_base: (x, y) [m] of the point aimed at, base frame.
        on_spot: whether the robot is to turn on the spot first.
    """

    speed: float
    turn_rate: float
    target_base: tuple[float, float]
    on_spot: bool


def pursue(
    path: DrivenPath,
    T_map_base: Pose2,
    settings: DrivingSettings,
    speed_max: float,
    turn_rate_max: float,
    turning: bool,
) -> Pursuit:
    """Return how to drive to follow `path`, obstacles aside.

    Args:
        path: with `advance` called for this pose.
        T_map_base: where the robot is.
        settings: lookahead and turning.
        speed_max: [m/s].
        turn_rate_max: [rad/s].
        turning: whether it is turning on the spot already: it then goes on until aligned.
    """
    tight = path.least_gap(settings.lookahead_m) < 2.0 * settings.lookahead_tight_m
    lookahead = settings.lookahead_tight_m if tight else settings.lookahead_m
    x, y = path.point_at(path.at + max(lookahead, path.off))
    dx, dy = x - T_map_base.x, y - T_map_base.y
    error = wrap_angle(math.atan2(dy, dx) - T_map_base.theta)
    distance = math.hypot(dx, dy)
    target = (distance * math.cos(error), distance * math.sin(error))
    limit = settings.aligned_deg if turning else settings.turn_on_spot_deg
    if abs(error) > math.radians(limit) and distance > 0.05:
        return Pursuit(0.0, _turn(error, turn_rate_max), target, True)
    curvature = 2.0 * math.sin(error) / max(distance, 0.1)
    curvature = min(max(curvature, -SHARPEST_CURVE), SHARPEST_CURVE)
    speed = min(speed_max, turn_rate_max / max(abs(curvature), 1e-9))
    return Pursuit(speed, speed * curvature, target, False)


def _turn(error: float, turn_rate_max: float) -> float:
    """Return the turn rate [rad/s] that takes away a heading error [rad]."""
    return min(max(_TURN_GAIN * error, -turn_rate_max), turn_rate_max)
