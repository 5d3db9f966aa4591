"""Commands to the body; one holds for a while, so the same is not said again at once."""

from __future__ import annotations

from protocol.world_messages import MotionCommand

_EPSILON = 1e-9
_PERIOD = 0.3  # [s]; shorter than the time after which a body halts by itself


class MotionCommands:
    """Remembers what was commanded, and when it must be said again."""

    def __init__(self) -> None:
        self._commanded: tuple[float, float] | None = None
        self._again = 0.0

    def say(self, speed: float, turn_rate: float, now: float) -> MotionCommand | None:
        """Return the command for a speed [m/s] and turn rate [rad/s], None if it holds still."""
        if (speed, turn_rate) == self._commanded and now < self._again - _EPSILON:
            return None
        self._commanded = (speed, turn_rate)
        self._again = now + _PERIOD
        return MotionCommand(speed_m_s=speed, turn_rate_rad_s=turn_rate)
