"""Poses in the plane and angles.

`T_a_b` is the pose of frame b in frame a; it maps b-coordinates into a, so neighbours cancel:
`T_map_base = T_map_odom @ T_odom_base`. Metres and radians, counter-clockwise positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def wrap_angle(angle: float) -> float:
    """Return `angle` [rad] wrapped to (-pi, pi]."""
    wrapped = math.remainder(angle, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped


def rotation(theta: float) -> Floats:
    """Return the (2, 2) matrix that turns points counter-clockwise by `theta` [rad]."""
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s], [s, c]])


@dataclass(frozen=True, slots=True)
class Pose2:
    """A rigid transform in the plane: translation (x, y) [m] and rotation theta [rad]."""

    x: float
    y: float
    theta: float

    def __matmul__(self, other: Pose2) -> Pose2:
        """Compose: `T_a_c = T_a_b @ T_b_c`."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return Pose2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            wrap_angle(self.theta + other.theta),
        )

    def inverse(self) -> Pose2:
        """Return `T_b_a` for `T_a_b`."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return Pose2(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.theta))

    def apply(self, points_b: npt.ArrayLike) -> Floats:
        """Map points (N, 2) or (2,) [m] from frame b into frame a."""
        points = np.asarray(points_b, dtype=np.float64)
        c, s = math.cos(self.theta), math.sin(self.theta)
        mapped = np.empty_like(points)
        mapped[..., 0] = self.x + c * points[..., 0] - s * points[..., 1]
        mapped[..., 1] = self.y + s * points[..., 0] + c * points[..., 1]
        return mapped

    def distance_to(self, other: Pose2) -> float:
        """Return the distance [m] between the two origins."""
        return math.hypot(self.x - other.x, self.y - other.y)

    def moved(self, other: Pose2, distance: float, turn: float) -> bool:
        """Whether `other` is at least a distance [m], or a turn [rad], away from this pose."""
        turned = abs(wrap_angle(other.theta - self.theta))
        return self.distance_to(other) >= distance or turned >= turn

    def as_tuple(self) -> tuple[float, float, float]:
        """Return (x, y, theta) [m, m, rad]."""
        return self.x, self.y, self.theta

    def as_array(self) -> Floats:
        """Return (x, y, theta) as a (3,) array."""
        return np.array(self.as_tuple())


IDENTITY = Pose2(0.0, 0.0, 0.0)


def pose_from(array: npt.ArrayLike) -> Pose2:
    """Return the pose for (x, y, theta) in a sequence or array of three numbers [m, m, rad]."""
    x, y, theta = (float(v) for v in np.asarray(array, dtype=np.float64).reshape(3))
    return Pose2(x, y, wrap_angle(theta))


def interpolate(T_a_b: Pose2, T_a_c: Pose2, fraction: float) -> Pose2:
    """Return the pose `fraction` of the way from `T_a_b` (0) to `T_a_c` (1), the short way."""
    return Pose2(
        T_a_b.x + fraction * (T_a_c.x - T_a_b.x),
        T_a_b.y + fraction * (T_a_c.y - T_a_b.y),
        wrap_angle(T_a_b.theta + fraction * wrap_angle(T_a_c.theta - T_a_b.theta)),
    )


def fit_rigid(points_a: npt.ArrayLike, points_b: npt.ArrayLike) -> Pose2:
    """Return the `T_a_b` that maps `points_b` onto `points_a` with least squared distance.

    Args:
        points_a: (N, 2) [m], in frame a.
        points_b: (N, 2) [m], in frame b, row by row the same places.

    Source: Umeyama 1991, restricted to the plane, without scale (closed form).
    """
    a = np.asarray(points_a, dtype=np.float64).reshape(-1, 2)
    b = np.asarray(points_b, dtype=np.float64).reshape(-1, 2)
    if len(a) == 0:
        return IDENTITY
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    da, db = a - mean_a, b - mean_b
    cosine = float((da * db).sum())
    sine = float((db[:, 0] * da[:, 1] - db[:, 1] * da[:, 0]).sum())
    theta = math.atan2(sine, cosine)
    offset = mean_a - rotation(theta) @ mean_b
    return Pose2(float(offset[0]), float(offset[1]), theta)
