"""Keeps the robot's copy of the team's map in step with what the server publishes."""

from __future__ import annotations

import math

from protocol.effects import Effect, Send
from protocol.fault_book import FaultBook
from protocol.messages import SERVER, MapDelta, MapRequest, MapSnapshot
from robot_agent.planning_map import PlanningMap


class MapFollower:
    """Applies snapshots and numbered changes, and asks for the whole map when one was missed.

    Args:
        planning_map: the copy.
        period: the whole map is asked for at most once in this time [s].
        faults: where maps that cannot be used are counted.
    """

    def __init__(self, planning_map: PlanningMap, period: float, faults: FaultBook) -> None:
        self._map = planning_map
        self._period = period
        self._faults = faults
        self._asked = -math.inf

    def snapshot(self, message: MapSnapshot) -> list[Effect]:
        """Take over the whole map."""
        try:
            self._map.apply_snapshot(message)
        except ValueError as error:
            return list(self._faults.enter("the map", SERVER, str(error)))
        return []

    def delta(self, message: MapDelta, now: float) -> list[Effect]:
        """Apply a change; ask for the whole map when one before it was missed."""
        try:
            box = self._map.apply_delta(message)
        except ValueError as error:
            return list(self._faults.enter("a map change", SERVER, str(error)))
        if box is not None or now - self._asked < self._period:
            return []
        self._asked = now
        return [Send("radio", SERVER, MapRequest(have=self._map.number))]
