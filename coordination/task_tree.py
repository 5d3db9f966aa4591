"""Tasks as a tree: sequencing, execution monitoring, exception handling, termination.

A mission is a tree of nodes. Leaves hold tasks that robots do, `Act` nodes run a step of the
program, `Sequence` and `Parallel` put them together. A leaf has a monitor that tells when its task
has to be given up. A failure first goes to the node's own `on_failure`: it may hand out another
node to run in its place; else it goes up to the parent. Termination runs down to all children.

Source: Simmons & Apfelbaum 1998 (Task Description Language), as used by Simmons et al. 2000,
section "Assigning Tasks".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Sequence as Seq

from coordination.task_node import Leaf, Mend, Node, NodeState


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
