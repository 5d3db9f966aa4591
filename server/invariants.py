"""What must hold of the task executive between any two events."""

from __future__ import annotations

from server.pool import Member, Pool
from server.work import Work


def check(pool: Pool, work: Work) -> None:
    """Check it.

    Raises:
        AssertionError: something does not hold.
    """
    assert work.mission.running, "the mission's node has ended"
    numbers = [h["task"] for h in work.happenings if h["event"] == "awarded"]
    assert len(numbers) == len(set(numbers)), "a task's number was given twice"
    in_tree = [leaf.task.id for member in pool for leaf in member.node.leaves()]
    assert sorted(in_tree) == sorted(task.id for task in work.live_tasks()), "a lease without task"
    for member in pool:
        _check_member(member)


def _check_member(member: Member) -> None:
    name = member.name
    leaves = list(member.node.leaves())
    assert member.node.running, f"{name}'s node has ended"
    assert len(leaves) <= 1, f"{name} has {len(leaves)} tasks"
    assert not leaves or member.live, f"{name} is lost and has a task"
    kind = leaves[0].task.kind if leaves else None
    own = all(leaf.task.robot == name and leaf.task.live for leaf in leaves)
    assert own, f"{name} has another's task, or one that has ended"
    allowed = {
        "pool": ("explore", "wait", None),
        "visit": ("visit",),
        "drive": ("drive", None),
        "pause": ("pause", None),
    }
    assert kind in allowed[member.mode], f"{name} is in mode {member.mode} and at a {kind}"
    if kind == "explore":
        assert member.idle_since is None, f"{name} explores and is idle"
