"""Where a robot waits while all that is left is left to teammates: out of their way, not far off.

Source: Simmons et al. 2000, section "Conclusions" (idle robots).
"""

from __future__ import annotations

import math

import numpy as np

from coordination.bid import RobotBid
from coordination.task import Point
from coordination.waiting_place import IdleRobot, waiting_places
from mapping.geometry import Floats
from protocol.crew import Crew
from robot_agent.decentral.settings import DecisionSettings
from robot_agent.planning_map import PlanningMap


class StandingBy:
    """Chooses where to wait, now and then, and only if that moves the robot by something.

    Args:
        robot: its name.
        settings: how often, and what is worth moving for.

    Attributes:
        due: when to look again [s]; None while the robot does not stand by.
    """

    def __init__(self, robot: str, settings: DecisionSettings) -> None:
        self.due: float | None = None
        self._robot = robot
        self._settings = settings
        self._place: Point | None = None

    def end(self) -> None:
        """There is something to do again."""
        self.due = self._place = None

    def look_again(self, now: float) -> None:
        """Stay, or drive on, and see in a while whether all is still left to others."""
        self.due = now + self._settings.wait_period_s

    def place(
        self, here: Point, bid: RobotBid, planning_map: PlanningMap, crew: Crew, now: float
    ) -> Point | None:
        """Return where to wait from now on, (x, y) [m], map frame; None to go on as before.

        Args:
            here: where the robot is, (x, y) [m], map frame.
            bid: what is left, all of it to others.
            planning_map: the team's map.
            crew: where the others are.
            now: mission time [s].
        """
        begins = self._place is None
        if not begins and self.due is not None and now < self.due:
            return None
        self.look_again(now)
        waiting, occupied = self._others(crew, now)
        chosen = waiting_places(
            planning_map.weights,
            planning_map.clearance,
            planning_map.geometry,
            [IdleRobot(self._robot, here), *waiting],
            bid.places,
            bid.gains,
            occupied,
        )
        place = chosen.get(self._robot, here if begins else None)
        if place is None:
            return None
        if self._place is not None and math.dist(place, self._place) <= self._settings.wait_move_m:
            return None
        self._place = place
        return place

    def _others(self, crew: Crew, now: float) -> tuple[list[IdleRobot], Floats]:
        """Return the teammates that wait, too, and where the others are and drive, (k, 2) [m]."""
        waiting: list[IdleRobot] = []
        occupied = [np.zeros((0, 2))]
        for name in crew.heard_within(self._settings.here_s, now):
            beacon = crew.beacons[name]
            if name == self._robot:
                continue
            x, y, _ = beacon.T_map_base.as_tuple()
            if beacon.busy or beacon.idle:
                occupied += [np.array([[x, y]]), beacon.path_map.astype(np.float64)]
            else:
                waiting.append(IdleRobot(name, (x, y)))
        return waiting, np.concatenate(occupied)
