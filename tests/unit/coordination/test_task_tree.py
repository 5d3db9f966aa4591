from __future__ import annotations

from typing import Any

import pytest

from coordination.task import Task, TaskState
from coordination.task_node import Act, Leaf, Mend, Node, NodeState
from coordination.task_tree import Composite, Parallel, Retry, Sequence


class Field:
    """Makes leaves and writes down what they say."""

    def __init__(self) -> None:
        self.awarded: list[int] = []
        self.ended: list[tuple[int, str, str]] = []
        self.count = 0
        self.complaint: str | None = None

    def leaf(self, on_failure: Mend | None = None) -> Leaf:
        self.count += 1
        task = Task(self.count, "explore", "robin", (0.0, 0.0))
        return Leaf(
            task,
            lambda task, now: self.awarded.append(task.id),
            lambda task, reason, now: self.ended.append((task.id, str(task.state), reason)),
            lambda now: self.complaint,
            on_failure,
        )


@pytest.fixture
def field() -> Field:
    return Field()


def test_a_sequence_goes_on_step_by_step(field: Field) -> None:
    steps: list[str] = []
    first, second = field.leaf(), field.leaf()
    sequence = Sequence("s", [Act("a", lambda now: steps.append("a")), first, second])
    sequence.append(Act("z", lambda now: steps.append("z")))
    sequence.start(0.0)
    assert (steps, field.awarded) == (["a"], [1])
    assert list(sequence.leaves()) == [first]
    first.progressed()
    first.finished(1.0)
    assert field.awarded == [1, 2]
    second.finished(2.0)
    assert steps == ["a", "z"] and sequence.state is NodeState.DONE
    assert field.ended == [(1, "done", ""), (2, "done", "")]


def test_a_failure_ends_a_sequence(field: Field) -> None:
    first, second = field.leaf(), field.leaf()
    sequence = Sequence("s", [first, second])
    sequence.start(0.0)
    first.failed("stuck", 1.0)
    assert (sequence.state, sequence.reason) == (NodeState.FAILED, "stuck")
    assert second.task.state is TaskState.TERMINATED  # announced only, so nobody is told
    assert field.ended == [(1, "failed", "stuck")]


def test_a_step_taken_back_ends_a_sequence(field: Field) -> None:
    first = field.leaf()
    sequence = Sequence("s", [first, field.leaf()])
    sequence.start(0.0)
    first.terminate("operator", 1.0)
    assert sequence.state is NodeState.TERMINATED
    assert field.awarded == [1]


def test_termination_runs_down(field: Field) -> None:
    leaves = [field.leaf() for _ in range(3)]
    root = Parallel("p", [leaves[0], Sequence("s", [leaves[1], leaves[2]])])
    root.start(0.0)
    assert field.awarded == [1, 2]
    root.terminate("over", 1.0)
    assert [leaf.task.state for leaf in leaves] == [TaskState.TERMINATED] * 3
    assert [number for number, _, _ in field.ended] == [1, 2]
    assert list(root.leaves()) == []
    root.terminate("again", 2.0)
    assert root.reason == "over"


def test_a_closed_parallel_ends_with_its_last_child_or_its_first_failure(field: Field) -> None:
    a, b = field.leaf(), field.leaf()
    both = Parallel("p", [a, b])
    both.start(0.0)
    a.finished(1.0)
    assert both.running
    b.finished(2.0)
    assert both.state is NodeState.DONE
    a, b = field.leaf(), field.leaf()
    both = Parallel("p", [a, b])
    both.start(0.0)
    a.failed("stuck", 1.0)
    assert both.state is NodeState.FAILED and b.state is NodeState.TERMINATED


def test_an_empty_parallel_is_through_at_once() -> None:
    node = Parallel("p")
    node.start(0.0)
    assert node.state is NodeState.DONE


def test_an_open_parallel_contains_failures(field: Field) -> None:
    root = Parallel("mission", is_open=True)
    early = field.leaf()
    root.add(early, 0.0)
    assert field.awarded == []
    root.start(0.0)
    assert field.awarded == [1]
    late = field.leaf()
    root.add(late, 1.0)
    early.failed("stuck", 2.0)
    assert root.running and root.children == [late]
    late.finished(3.0)
    assert root.running and root.children == []


def test_on_failure_may_put_something_in_place(field: Field) -> None:
    steps: list[str] = []

    def mend(node: Node, now: float) -> Node:
        return Act("mend", lambda now: steps.append(node.reason))

    last = field.leaf()
    first = field.leaf(mend)
    sequence = Sequence("s", [first, last])
    sequence.start(0.0)
    first.failed("stuck", 1.0)
    assert steps == ["stuck"] and last.running
    root = Parallel("p", is_open=True)
    root.start(0.0)
    contained = field.leaf(mend)
    root.add(contained, 0.0)
    contained.failed("again", 1.0)
    assert steps == ["stuck", "again"] and root.children == []


def test_retry_gives_up_in_the_end(field: Field) -> None:
    retry = Retry(3, lambda node, mend: field.leaf(mend))
    sequence = Sequence("s", [field.leaf(retry)])
    sequence.start(0.0)
    for _ in range(3):
        next(sequence.leaves()).failed("stuck", 1.0)
    assert field.awarded == [1, 2, 3] and sequence.state is NodeState.FAILED


def test_retry_may_see_no_sense_in_another_try(field: Field) -> None:
    sequence = Sequence("s", [field.leaf(Retry(3, lambda node, mend: None))])
    sequence.start(0.0)
    next(sequence.leaves()).failed("no way", 1.0)
    assert sequence.state is NodeState.FAILED


def test_monitors(field: Field) -> None:
    a, b = field.leaf(), field.leaf()
    root = Parallel("p", [a, Sequence("s", [b])], is_open=True)
    root.check(0.0)  # nothing has begun
    root.start(0.0)
    root.check(1.0)
    assert len(list(root.leaves())) == 2
    field.complaint = "silent"
    root.check(2.0)
    assert field.ended == [(1, "expired", "silent"), (2, "expired", "silent")]
    assert root.children == []


def test_ending_twice_changes_nothing(field: Field) -> None:
    act = Act("a", lambda now: None)
    act.start(0.0)
    act.fail("late", 1.0)
    act.start(2.0)
    act.check(3.0)
    assert act.state is NodeState.DONE and list(act.leaves()) == []


@pytest.mark.parametrize("kind", [Node, Composite])
def test_the_bases_do_nothing_themselves(kind: Any) -> None:
    with pytest.raises(NotImplementedError):
        kind("x").start(0.0)


def test_a_bare_composite_hears_nothing(field: Field) -> None:
    leaf = field.leaf()
    Composite("x", [leaf])
    leaf.start(0.0)
    with pytest.raises(NotImplementedError):
        leaf.finished(1.0)
