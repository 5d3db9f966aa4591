"""Tasks of robots and their lifecycle.

The lifecycle is one table, `TRANSITIONS`: (state, event) -> state. A pair that is not in it is a
`TaskError`: a fault in the program, not in the world. What the world does wrong (a robot that
reports on a task it no longer has) is sorted out before it gets here.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Literal

Kind = Literal["explore", "visit", "wait", "drive", "pause"]
Point = tuple[float, float]
Rectangle = tuple[float, float, float, float]


class TaskError(Exception):
    """An event that a task in this state cannot have."""


class TaskState(enum.StrEnum):
    """Where a task is in its life."""

    ANNOUNCED = "announced"
    AWARDED = "awarded"
    ACTIVE = "active"
    DONE = "done"
    FAILED = "failed"
    TERMINATED = "terminated"
    EXPIRED = "expired"


class TaskEvent(enum.StrEnum):
    """What can happen to a task.

    `AWARD`: a robot is told to do it. `PROGRESS`: the robot shows that it is at it. `FINISH`,
    `FAIL`: the robot ends it. `TERMINATE`: the executive takes it back. `EXPIRE`: its lease ran
    out.
    """

    AWARD = "award"
    PROGRESS = "progress"
    FINISH = "finish"
    FAIL = "fail"
    TERMINATE = "terminate"
    EXPIRE = "expire"


# A robot that stands at its goal already may end a task without ever showing progress, so an
# awarded task can end in every way an active one can. Ended tasks stay ended: the same place is
# offered again as a new task, so a late word about the old one can never be taken for the new.
TRANSITIONS: dict[tuple[TaskState, TaskEvent], TaskState] = {
    (TaskState.ANNOUNCED, TaskEvent.AWARD): TaskState.AWARDED,
    (TaskState.ANNOUNCED, TaskEvent.TERMINATE): TaskState.TERMINATED,
    (TaskState.AWARDED, TaskEvent.PROGRESS): TaskState.ACTIVE,
    (TaskState.AWARDED, TaskEvent.FINISH): TaskState.DONE,
    (TaskState.AWARDED, TaskEvent.FAIL): TaskState.FAILED,
    (TaskState.AWARDED, TaskEvent.TERMINATE): TaskState.TERMINATED,
    (TaskState.AWARDED, TaskEvent.EXPIRE): TaskState.EXPIRED,
    (TaskState.ACTIVE, TaskEvent.PROGRESS): TaskState.ACTIVE,
    (TaskState.ACTIVE, TaskEvent.FINISH): TaskState.DONE,
    (TaskState.ACTIVE, TaskEvent.FAIL): TaskState.FAILED,
    (TaskState.ACTIVE, TaskEvent.TERMINATE): TaskState.TERMINATED,
    (TaskState.ACTIVE, TaskEvent.EXPIRE): TaskState.EXPIRED,
}

LIVE = (TaskState.AWARDED, TaskState.ACTIVE)
ENDED = (TaskState.DONE, TaskState.FAILED, TaskState.TERMINATED, TaskState.EXPIRED)


def next_state(state: TaskState, event: TaskEvent) -> TaskState:
    """Return the state after `event`.

    Raises:
        TaskError: a task in `state` cannot have this event.
    """
    try:
        return TRANSITIONS[state, event]
    except KeyError:
        raise TaskError(f"a task that is {state} cannot {event}") from None


@dataclass(slots=True)
class Task:
    """One thing for one robot to do.

    Attributes:
        id: its number, unique in a mission, counted from 1.
        kind: `explore` a frontier, `visit` a place for an operator, `wait` somewhere, `drive` by
            hand, `pause`.
        robot: who does it.
        goal: (x, y) [m], map frame.
        rectangle: x_min, y_min, x_max, y_max [m], map frame, around the information gain region;
            None where there is nothing to gain.
        gain: expected information [m2] when it was awarded or last bid for.
        cost: path length [m] when it was awarded or last bid for.
        state: where it is in its life; changed by `advance` only.
    """

    id: int
    kind: Kind
    robot: str
    goal: Point
    rectangle: Rectangle | None = None
    gain: float = 0.0
    cost: float = 0.0
    state: TaskState = TaskState.ANNOUNCED

    @property
    def live(self) -> bool:
        """Whether a robot is supposed to be at it."""
        return self.state in LIVE

    def advance(self, event: TaskEvent) -> TaskState:
        """Take an event; return the new state.

        Raises:
            TaskError: the task cannot have this event now.
        """
        self.state = next_state(self.state, event)
        return self.state
