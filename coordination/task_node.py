"""The nodes of a task tree that have no children: tasks of robots, and steps of the program.

A failure first goes to the node's own `on_failure`: it may hand out another node to run in its
place; else it goes up to the parent. `coordination.task_tree` puts nodes together.

Source: Simmons & Apfelbaum 1998 (Task Description Language), as used by Simmons et al. 2000,
section "Assigning Tasks".
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator
from typing import Protocol

from coordination.task import Task, TaskEvent


class NodeState(enum.StrEnum):
    """Where a node is in its life."""

    READY = "ready"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    TERMINATED = "terminated"


class Node:
    """A node of the tree.

    Attributes:
        name: what it is, for people.
        state: where it is in its life.
        reason: why it failed or was terminated.
        parent: the node it belongs to, None at the root.
        on_failure: called with this node and the time after it failed; returns a node to run in its
            place, or None to let the failure go up.
    """

    def __init__(self, name: str, on_failure: Mend | None = None) -> None:
        self.name = name
        self.state = NodeState.READY
        self.reason = ""
        self.parent: Parent | None = None
        self.on_failure = on_failure

    @property
    def running(self) -> bool:
        """Whether it was started and has not ended."""
        return self.state is NodeState.RUNNING

    def start(self, now: float) -> None:
        """Begin; a node begins once."""
        if self.state is NodeState.READY:
            self.state = NodeState.RUNNING
            self._begin(now)

    def succeed(self, now: float) -> None:
        """End well."""
        self._end(NodeState.DONE, "", now)

    def fail(self, reason: str, now: float) -> None:
        """End badly; `on_failure` or the parent sees to it."""
        self._end(NodeState.FAILED, reason, now)

    def terminate(self, reason: str, now: float) -> None:
        """End because somebody wants so, with all that is below."""
        self._end(NodeState.TERMINATED, reason, now)

    def check(self, now: float) -> None:
        """Ask all monitors below."""

    def leaves(self) -> Iterator[Leaf]:
        """Yield the leaves below that have not ended, in order."""
        return iter(())

    def _begin(self, now: float) -> None:
        raise NotImplementedError

    def _cease(self, reason: str, now: float) -> None:
        """Stop whatever is under way; called before the parent hears of the end."""

    def _end(self, state: NodeState, reason: str, now: float) -> None:
        if self.state not in (NodeState.READY, NodeState.RUNNING):
            return
        self.state, self.reason = state, reason
        self._cease(reason, now)
        instead = None
        if state is NodeState.FAILED and self.on_failure is not None:
            instead = self.on_failure(self, now)
        if self.parent is not None:
            self.parent.child_ended(self, instead, now)


class Parent(Protocol):
    """What a node tells of its end."""

    def child_ended(self, child: Node, instead: Node | None, now: float) -> None:
        """Hear of a child's end; `instead` is to run in its place."""
        ...


Mend = Callable[[Node, float], Node | None]
Award = Callable[[Task, float], None]
Ended = Callable[[Task, str, float], None]
Monitor = Callable[[float], str | None]


class Leaf(Node):
    """A task that a robot does.

    Attributes:
        task: the task.
    """

    def __init__(
        self,
        task: Task,
        award: Award,
        ended: Ended,
        monitor: Monitor,
        on_failure: Mend | None = None,
    ) -> None:
        """Make a leaf.

        Args:
            task: announced, not yet awarded.
            award: tells the robot to do it.
            ended: hears, with the reason, that the task has ended in whichever way its state says;
                not called if it never was awarded.
            monitor: returns why the task has to be given up at a time, or None.
            on_failure: see `Node`.
        """
        super().__init__(f"{task.kind} {task.id}", on_failure)
        self.task = task
        self._award = award
        self._ended = ended
        self._monitor = monitor

    def progressed(self) -> None:
        """The robot is at it."""
        self.task.advance(TaskEvent.PROGRESS)

    def finished(self, now: float) -> None:
        """The robot has done it."""
        self.task.advance(TaskEvent.FINISH)
        self.succeed(now)

    def failed(self, reason: str, now: float) -> None:
        """The robot cannot do it."""
        self.task.advance(TaskEvent.FAIL)
        self.fail(reason, now)

    def expire(self, reason: str, now: float) -> None:
        """The lease ran out."""
        self.task.advance(TaskEvent.EXPIRE)
        self.fail(reason, now)

    def check(self, now: float) -> None:
        """Give the task up if its monitor says so."""
        if self.running:
            reason = self._monitor(now)
            if reason is not None:
                self.expire(reason, now)

    def leaves(self) -> Iterator[Leaf]:
        """Yield itself until it has ended."""
        if self.running:
            yield self

    def _begin(self, now: float) -> None:
        self.task.advance(TaskEvent.AWARD)
        self._award(self.task, now)

    def _cease(self, reason: str, now: float) -> None:
        if self.state is NodeState.TERMINATED:
            was_live = self.task.live
            self.task.advance(TaskEvent.TERMINATE)
            if not was_live:
                return
        self._ended(self.task, reason, now)


class Act(Node):
    """A step of the program itself, done at once."""

    def __init__(self, name: str, step: Callable[[float], None]) -> None:
        super().__init__(name)
        self._step = step

    def _begin(self, now: float) -> None:
        self._step(now)
        self.succeed(now)
