"""The robots as the task executive sees them.

A robot is in the exploration pool unless an operator has a use for it (a visit, a drive by hand, a
pause), it is lost, or it is left out for a while because its tasks expire one after the other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from coordination.bid import RobotBid
from coordination.task import Point, Task
from coordination.task_node import Leaf
from coordination.task_tree import Parallel
from protocol.body import Body

Mode = Literal["pool", "visit", "drive", "pause"]


@dataclass(slots=True)
class Member:
    """One robot.

    Attributes:
        name: its name.
        body: what it is made of.
        node: its node in the task tree.
        joined: when [s].
        mode: whose it is: the pool's or the operator's.
        live: whether it is heard of.
        heard: when last [s].
        bid: its newest bid.
        bid_is_new: whether no assignment has taken that bid into account yet.
        place: where it was when last heard of, (x, y) [m], map frame.
        idle_since: since when it has had nothing to explore [s]; None while it has.
        refused_wait: a waiting place it failed to get to, (x, y) [m].
        behind_since: since when the map has been newer than its newest bid [s]; None if it is not.
        benched_until: it gets no tasks before [s].
        expiries: tasks that expired one after the other without a sign of progress.
    """

    name: str
    body: Body
    node: Parallel
    joined: float
    mode: Mode = "pool"
    live: bool = True
    heard: float = field(default=-math.inf)
    bid: RobotBid | None = None
    bid_is_new: bool = False
    place: Point | None = None
    idle_since: float | None = None
    refused_wait: Point | None = None
    behind_since: float | None = None
    benched_until: float = -math.inf
    expiries: int = 0

    @property
    def leaf(self) -> Leaf | None:
        """The task it is at, if any, as a leaf of the tree."""
        return next(self.node.leaves(), None)

    @property
    def task(self) -> Task | None:
        """The task it is at, if any."""
        leaf = self.leaf
        return None if leaf is None else leaf.task

    @property
    def exploring(self) -> Task | None:
        """The exploration task it is at, if any."""
        task = self.task
        return task if task is not None and task.kind == "explore" else None

    def rejoin(self, now: float) -> None:
        """Be with the pool (again), idle; its next bid is waited for from now on."""
        self.idle_since = now
        if self.behind_since is not None:
            self.behind_since = now

    def lag(self, now: float) -> float:
        """Return for how long its newest bid has been behind the map [s]; 0 if it is not."""
        since = self.joined if self.bid is None else self.behind_since
        return 0.0 if since is None else now - since

    def fit(self, now: float) -> bool:
        """Whether it is in the pool, heard of and not left out at `now` [s]."""
        return self.live and self.mode == "pool" and now >= self.benched_until


class Pool:
    """All robots that ever joined, by name."""

    def __init__(self) -> None:
        self._members: dict[str, Member] = {}

    def __iter__(self) -> Iterator[Member]:
        for name in sorted(self._members):
            yield self._members[name]

    def get(self, name: str) -> Member | None:
        """Return the robot of this name, or None."""
        return self._members.get(name)

    def add(self, member: Member) -> None:
        """Take a robot in."""
        self._members[member.name] = member

    def fit(self, now: float) -> list[Member]:
        """Return the robots that explore at `now` [s], by name."""
        return [member for member in self if member.fit(now)]
