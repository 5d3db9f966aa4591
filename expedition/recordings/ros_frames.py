"""Where a laser sits on a robot, by the fixed transforms of ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapping.geometry import IDENTITY, Floats, Pose2


@dataclass(frozen=True, slots=True)
class Mounting:
    """How a laser is mounted, seen from above.

    Attributes:
        T_base_laser: where it sits.
        upside_down: its bearings run clockwise.
    """

    T_base_laser: Pose2 = IDENTITY
    upside_down: bool = False


class StaticFrames:
    """The tree of frames that `/tf_static` tells of: each frame's parent and its pose there."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, Floats]] = {}

    def add(self, stamped: Any) -> None:
        """Take a geometry_msgs/TransformStamped."""
        child, parent = _name(stamped.child_frame_id), _name(stamped.header.frame_id)
        matrix = _matrix(stamped.transform)
        if np.isfinite(matrix).all():
            self._parents[child] = (parent, matrix)

    def mounting(self, laser: str, base: str) -> Mounting:
        """Return how frame `laser` is fixed to frame `base`; as if in its middle if nobody says.

        Where `base` is not among the laser's ancestors, the outermost one named base... is taken:
        odometry often speaks of base_footprint and the laser hangs on base_link.
        """
        frame = _name(laser)
        T_frame_laser = np.eye(4)
        found = None
        for _ in range(len(self._parents)):  # so that a ring of frames ends
            if frame not in self._parents:
                break
            frame, T_parent_frame = self._parents[frame]
            T_frame_laser = T_parent_frame @ T_frame_laser
            if frame == _name(base):
                return _seen_from_above(T_frame_laser)
            if frame.startswith("base"):
                found = T_frame_laser
        return Mounting() if found is None else _seen_from_above(found)


def yaw(quaternion: Any) -> float:
    """Return the turn about z [rad] of a geometry_msgs/Quaternion."""
    x, y, z, w = quaternion.x, quaternion.y, quaternion.z, quaternion.w
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def _name(frame: str) -> str:
    return frame.removeprefix("/")


def _matrix(transform: Any) -> Floats:
    """Return the (4, 4) matrix of a geometry_msgs/Transform; of a zero quaternion, without turn."""
    q, t = transform.rotation, transform.translation
    norm = math.sqrt(q.x**2 + q.y**2 + q.z**2 + q.w**2)
    x, y, z, w = (v / norm for v in (q.x, q.y, q.z, q.w)) if norm else (0.0, 0.0, 0.0, 1.0)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), t.x],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), t.y],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), t.z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _seen_from_above(T_base_laser: Floats) -> Mounting:
    """Return the mounting in the plane for a (4, 4) matrix."""
    theta = math.atan2(T_base_laser[1, 0], T_base_laser[0, 0])
    pose = Pose2(float(T_base_laser[0, 3]), float(T_base_laser[1, 3]), theta)
    upside_down = bool(T_base_laser[2, 2] < 0.0)
    return Mounting(IDENTITY if pose == IDENTITY else pose, upside_down)
