"""Tasks as a tree: sequencing, execution monitoring, exception handling, termination.

A mission is a tree of nodes. Leaves hold tasks that robots do, `Act` nodes run a step of the
program, `Sequence` and `Parallel` put them together. A leaf has a monitor that tells when its task
has to be given up. A failure first goes to the node's own `on_failure`: it may hand out another
node to run in its place; else it goes up to the parent. Termination runs down to all children.

Source: Simmons & Apfelbaum 1998 (Task Description Language), as used by Simmons et al. 2000,
section "Assigning Tasks".
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator
from collections.abc import Sequence as Seq

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
        self.parent: Composite | None = None
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


class Composite(Node):
    """A node with children."""

    def __init__(self, name: str, children: Seq[Node] = (), on_failure: Mend | None = None) -> None:
        super().__init__(name, on_failure)
        self.children: list[Node] = []
        for child in children:
            self._adopt(child)

    def check(self, now: float) -> None:
        """Ask all monitors below."""
        for child in tuple(self.children):
            child.check(now)

    def leaves(self) -> Iterator[Leaf]:
        """Yield the leaves below that have not ended, in order."""
        for child in self.children:
            yield from child.leaves()

    def child_ended(self, child: Node, instead: Node | None, now: float) -> None:
        """Hear of a child's end; `instead` is to run in its place."""
        raise NotImplementedError

    def _adopt(self, child: Node) -> None:
        child.parent = self
        self.children.append(child)

    def _swap(self, child: Node, instead: Node, now: float) -> None:
        instead.parent = self
        self.children[self.children.index(child)] = instead
        instead.start(now)

    def _cease(self, reason: str, now: float) -> None:
        for child in tuple(self.children):
            if child.state in (NodeState.READY, NodeState.RUNNING):
                child.terminate(reason, now)


class Sequence(Composite):
    """Children one after the other; ends well after the last, badly with the first that fails."""

    def append(self, child: Node) -> None:
        """Add a step before the sequence begins."""
        self._adopt(child)

    def child_ended(self, child: Node, instead: Node | None, now: float) -> None:
        """Go on with the next child, with `instead`, or end as the child did."""
        if not self.running:
            return
        if instead is not None:
            self._swap(child, instead, now)
        elif child.state is NodeState.DONE:
            self._begin(now)
        elif child.state is NodeState.FAILED:
            self.fail(child.reason, now)
        else:
            self.terminate(child.reason, now)

    def _begin(self, now: float) -> None:
        for child in self.children:
            if child.state is NodeState.READY:
                child.start(now)
                return
        self.succeed(now)


class Parallel(Composite):
    """Children side by side.

    A closed one ends well when all children have, and badly (ending the others) with the first that
    fails. An open one never ends by itself: children come and go, and a child's failure stays its
    own: one robot's trouble does not end the mission.
    """

    def __init__(
        self,
        name: str,
        children: Seq[Node] = (),
        on_failure: Mend | None = None,
        *,
        is_open: bool = False,
    ) -> None:
        super().__init__(name, children, on_failure)
        self.is_open = is_open

    def add(self, child: Node, now: float) -> None:
        """Add a child, and start it if this node runs."""
        self._adopt(child)
        if self.running:
            child.start(now)

    def child_ended(self, child: Node, instead: Node | None, now: float) -> None:
        """Forget the child, run `instead`, or end."""
        if not self.running:
            return
        if instead is not None:
            self._swap(child, instead, now)
        elif self.is_open:
            self.children.remove(child)
        elif child.state is NodeState.DONE:
            self._end_if_through(now)
        else:
            self.fail(child.reason, now)

    def _begin(self, now: float) -> None:
        for child in tuple(self.children):
            child.start(now)
        if not self.is_open:
            self._end_if_through(now)

    def _end_if_through(self, now: float) -> None:
        if self.running and all(child.state is NodeState.DONE for child in self.children):
            self.succeed(now)


TryAgain = Callable[[Node, Mend], Node | None]


class Retry:
    """An `on_failure` that tries again, some times in all, then lets the failure up."""

    def __init__(self, tries: int, again: TryAgain) -> None:
        """Make it.

        Args:
            tries: how often in all, the first one included.
            again: makes the next try, given the node that failed and the `on_failure` the next one
                is to carry on with; returns None if there is no sense in another.
        """
        self.left = tries - 1
        self._again = again

    def __call__(self, node: Node, now: float) -> Node | None:
        """Return the next try, or None."""
        if self.left <= 0:
            return None
        self.left -= 1
        return self._again(node, self)
