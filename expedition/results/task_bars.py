"""What each robot was at, when, and how it came out: the bars of the report's time line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from expedition.results.exports import event_time
from expedition.results.record import Event

# Both the event and the state it leads to may be in the log; see `coordination.task`.
STARTS = ("award", "awarded")
OUTCOMES = {
    "finish": "done",
    "done": "done",
    "terminate": "terminated",
    "terminated": "terminated",
    "fail": "failed",
    "failed": "failed",
    "unreachable": "unreachable",
    "expire": "expired",
    "expired": "expired",
    "lost": "lost",
}
FAILURES = ("failed", "unreachable", "expired", "lost")


@dataclass(frozen=True)
class TaskBar:
    """One task of one robot from award to end.

    Attributes:
        start: when it was awarded.
        end: when it ended, or the end of the run.
        outcome: `done`, `terminated`, one of `FAILURES`, or empty if it never ended.
        goal: (x, y) [m], map frame, if it has one.
    """

    robot: str
    task: str
    kind: str
    start: float
    end: float
    outcome: str = ""
    reason: str = ""
    goal: tuple[float, float] | None = None

    @property
    def failed(self) -> bool:
        """Whether it came to a bad end."""
        return self.outcome in FAILURES


def task_bars(tasks: Sequence[Event], end: float) -> list[TaskBar]:
    """Return the bars for task events, in order of start; `end` closes those without an end.

    An end without an award, and events that are neither, are left out. When a task is awarded
    again, its first bar ends there.
    """
    running: dict[tuple[str, str], TaskBar] = {}
    bars: list[TaskBar] = []
    for event in sorted(tasks, key=event_time):
        name, t = str(event.get("event", "")), event_time(event)
        key = (str(event.get("robot", "")), str(event.get("task", "")))
        if name not in STARTS and name not in OUTCOMES:
            continue
        if key in running:
            bar = running.pop(key)
            outcome = OUTCOMES.get(name, "terminated")
            bars.append(replace(bar, end=t, outcome=outcome, reason=_text(event.get("reason"))))
        if name in STARTS:
            running[key] = TaskBar(*key, _kind(event), t, t, goal=_goal(event.get("goal")))
    bars.extend(replace(bar, end=max(end, bar.start)) for bar in running.values())
    return sorted(bars, key=lambda bar: (bar.start, bar.robot, bar.task))


def _kind(event: Event) -> str:
    return str(event.get("kind") or "explore")


def _text(value: Any) -> str:
    return "" if value is None else str(value)


def _goal(value: Any) -> tuple[float, float] | None:
    """Return a goal written as [x, y], or None."""
    if isinstance(value, list | tuple) and len(value) == 2:
        return float(value[0]), float(value[1])
    return None
