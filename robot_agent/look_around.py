"""A robot first turns once on the spot, to see all that is around its start."""

from __future__ import annotations

import math

from mapping.geometry import Pose2, wrap_angle

_FULL_TURN = math.radians(340.0)  # a half-turn lidar has then seen every direction twice


class LookAround:
    """Counts how far the robot turned since it began.

    Args:
        wanted: whether to look around at all.
    """

    def __init__(self, wanted: bool) -> None:
        self._wanted = wanted
        self._turned = 0.0
        self._before: Pose2 | None = None

    @property
    def done(self) -> bool:
        """Whether the robot has seen all that is around its start."""
        return not (self.first and self._wanted)

    @property
    def first(self) -> bool:
        """Whether others still stand where they began, as far as it knows.

        Who has looked around once may drive, and is seen by the others in many places.
        """
        return self._turned < _FULL_TURN

    def follow(self, T_wheel_base: Pose2) -> None:
        """Take in where the wheels say the robot is now."""
        if self._before is not None:
            self._turned += abs(wrap_angle(T_wheel_base.theta - self._before.theta))
        self._before = T_wheel_base
