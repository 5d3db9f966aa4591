"""Hears the map from the robots of a team that has no server, one of them at a time.

What they answer goes to the judge by no radio: it is not part of the mission.
"""

from __future__ import annotations

from collections.abc import Sequence

from mapping.geometry import Pose2
from protocol.effects import Effect, Send
from protocol.messages import MapDelta, MapRequest, MapSnapshot, Message, TeamPoses
from sim_world.judge import Judge


class Witnesses:
    """Asks whoever is there first, and another one when that is gone.

    Args:
        judge: is told what they say.
    """

    def __init__(self, judge: Judge) -> None:
        self._judge = judge
        self._asked = ""

    def ask(self, present: Sequence[str]) -> list[Effect]:
        """Return the question to the first of those present."""
        if not present:
            return []
        have = self._judge.number if present[0] == self._asked else 0
        self._asked = present[0]
        return [Send("body", self._asked, MapRequest(have=have))]

    def hear(self, name: str, message: Message, truth: dict[str, Pose2], now: float) -> None:
        """Take what a robot answers; what nobody asked it for does not count.

        Raises:
            ValueError: it is no map, see `Judge.hear`.
        """
        if name == self._asked and isinstance(message, MapSnapshot | MapDelta | TeamPoses):
            self._judge.hear(message, truth, now)
