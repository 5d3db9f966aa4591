"""A task executive with a clock in the test's hand, and robots that are only names."""

from __future__ import annotations

from typing import Any

import numpy as np

from coordination.bid import RobotBid
from coordination.strategy import load_strategy
from mapping.geometry import Pose2
from protocol.body import Body
from protocol.effects import Send
from protocol.messages import Award, Terminate
from server.executive_settings import ExecutiveSettings
from server.task_executive import TaskExecutive
from server.waiting import ChooseWaitingPlaces

Row = tuple[float, float, float]  # x, gain, cost of a place on the x axis


def bid_of(
    robot: str,
    rows: list[Row],
    number: int,
    map_number: int = 1,
    unreachable: list[tuple[float, float]] | None = None,
    at: tuple[float, float] = (0.0, 0.0),
) -> RobotBid:
    """Return a bid for places on the x axis with regions of 2 m by 2 m."""
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    places = np.column_stack((table[:, 0], np.zeros(len(table))))
    return RobotBid(
        robot,
        number,
        map_number,
        Pose2(*at, 0.0),
        places,
        table[:, 1],
        table[:, 2],
        np.column_stack((places - 1.0, places + 1.0)),
        np.array(unreachable or [], dtype=np.float64).reshape(-1, 2),
        np.zeros(len(table)),
    )


class Rig:
    """An executive and its clock; checks the invariants after every event."""

    def __init__(
        self,
        *robots: str,
        strategy: str = "auction",
        choose: ChooseWaitingPlaces | None = None,
        **settings: Any,
    ) -> None:
        self.settings = ExecutiveSettings(**{"max_tries": 3, **settings})
        self.executive = TaskExecutive(self.settings, load_strategy(strategy), choose, strategy)
        self.now = 0.0
        self.numbers = 0
        self.map_number = 1
        self.sent: list[Send] = []
        self.executive.map_changed(1, 0.0)
        for robot in robots:
            self.take(self.executive.robot_joined(robot, Body(), self.now))

    def take(self, sends: list[Send]) -> list[Send]:
        """Remember what was sent, and check."""
        self.sent += sends
        self.executive.check_invariants()
        assert all(send.channel == "fleet" for send in sends)
        return sends

    def bid(self, robot: str, *rows: Row, **more: Any) -> list[Send]:
        """Let a robot bid on the newest map, if not told otherwise."""
        self.numbers += 1
        more.setdefault("map_number", self.map_number)
        return self.take(
            self.executive.bid(bid_of(robot, list(rows), self.numbers, **more), self.now)
        )

    def new_map(self) -> None:
        """Let the map change."""
        self.map_number += 1
        self.take(self.executive.map_changed(self.map_number, self.now))

    def wait(self, seconds: float, *heard: str, step: float = 0.1) -> list[Send]:
        """Let time pass, hearing some robots all the while; return what was sent."""
        first = len(self.sent)
        for _ in range(round(seconds / step)):
            self.now = round(self.now + step, 6)
            for robot in heard:
                self.take(self.executive.contact(robot, self.now))
            self.take(self.executive.tick(self.now))
        return self.sent[first:]

    def progress(self, robot: str, remaining: float, task: int | None = None) -> list[Send]:
        """Let a robot report on its task (or another)."""
        number = self.task(robot) if task is None else task
        assert number is not None
        return self.take(self.executive.progress(robot, number, remaining, self.now))

    def end(
        self, robot: str, outcome: str = "done", reason: str = "", task: int | None = None
    ) -> list[Send]:
        """Let a robot end its task (or another)."""
        number = self.task(robot) if task is None else task
        assert number is not None
        return self.take(self.executive.task_ended(robot, number, outcome, reason, self.now))

    def task(self, robot: str) -> int | None:
        """Return the number of a robot's task."""
        numbers = [task.id for task in self.executive.tasks() if task.robot == robot]
        return numbers[0] if numbers else None

    def goals(self, kind: str = "explore") -> dict[str, float]:
        """Return where robots are heading on the x axis."""
        return {t.robot: t.goal[0] for t in self.executive.tasks() if t.kind == kind}

    def events(self, *names: str) -> list[tuple[str, str]]:
        """Return what happened to whom, of these kinds."""
        return [
            (str(h["event"]), str(h["robot"]))
            for h in self.executive.happenings
            if h["event"] in names
        ]


def awards(sends: list[Send]) -> list[tuple[str, str, float]]:
    """Return to whom, of which kind and to where awards were sent."""
    return [
        (send.to, send.message.kind, send.message.goal_map[0])
        for send in sends
        if isinstance(send.message, Award)
    ]


def terminations(sends: list[Send]) -> list[tuple[str, int]]:
    """Return to whom terminations were sent, and of which tasks."""
    return [(s.to, s.message.task) for s in sends if isinstance(s.message, Terminate)]
