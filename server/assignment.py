"""Rounds of assignment: who of the free robots, and of those with new bids, explores what.

And the end of it: when no robot has anything left to explore.
"""

from __future__ import annotations

import math

from coordination.strategy import Choice, Region, Strategy
from coordination.task import Task, TaskState
from coordination.task_node import Act, Leaf, Mend, Node
from coordination.tried_places import TriedPlaces
from server.executive_settings import ExecutiveSettings
from server.pool import Member, Pool
from server.work import Work


class Assignment:
    """Holds rounds of assignment.

    Attributes:
        nothing_since: since when no robot has had anything to explore [s]; None while one has.
        wake_at: when the next round is due without any news [s]: a place has rested long enough,
            or a robot that was left out is given work again.
    """

    def __init__(
        self,
        settings: ExecutiveSettings,
        strategy: Strategy,
        pool: Pool,
        work: Work,
        tried: TriedPlaces,
    ) -> None:
        self.nothing_since: float | None = None
        self.wake_at: float | None = None
        self._settings = settings
        self._strategy = strategy
        self._pool = pool
        self._work = work
        self._tried = tried

    def hold(self, now: float, idle_only: bool = False) -> None:
        """Hold a round: assign to robots that are idle or, unless `idle_only`, have new bids."""
        up = [
            member
            for member in self._able(now)
            if member.exploring is None or (member.bid_is_new and not idle_only)
        ]
        choices = {choice.robot: choice for choice in self._choose(up, now)}
        for member in up:
            member.bid_is_new = False
            self._settle(member, choices.get(member.name), now)
        self._review(now)
        times = [self._tried.next_awake(now), *(member.benched_until for member in self._pool)]
        self.wake_at = min((t for t in times if t is not None and t > now), default=None)

    def _able(self, now: float) -> list[Member]:
        """Return the robots that can be given something, by name."""
        return [
            member
            for member in self._pool.fit(now)
            if member.bid is not None and member.lag(now) <= self._settings.bid_patience_s
        ]

    def _choose(self, up: list[Member], now: float, bars: bool = True) -> tuple[Choice, ...]:
        """Ask the strategy; `now` and `bars` as in `TriedPlaces.kept_from`."""
        radius = self._settings.give_up_radius_m
        bids = tuple(
            member.bid.without(self._tried.kept_from(member.name, now, bars), radius)
            for member in up
            if member.bid is not None
        )
        names = [member.name for member in up]
        current = tuple(_region(m.exploring) for m in up if m.exploring is not None)
        running = tuple(
            _region(member.exploring)
            for member in self._pool
            if member.exploring is not None and member.name not in names
        )
        return self._strategy.assign(bids, current, running)

    def _settle(self, member: Member, choice: Choice | None, now: float) -> None:
        """Give a robot its choice, unless it is what the robot is at already."""
        task = member.exploring
        if choice is None:
            if task is not None:
                self._work.take_back(member, "nothing to gain there any more", now)
            if member.idle_since is None:
                member.idle_since = now
            return
        member.idle_since = None
        keep = self._settings.keep_radius_m
        if task is not None and math.dist(task.goal, choice.goal) <= keep:
            task.rectangle, task.gain, task.cost = choice.rectangle, choice.gain, choice.cost
            return
        self._work.take_back(member, "sent elsewhere", now)
        leaf = self._work.leaf(
            member.name,
            "explore",
            choice.goal,
            self._hand_back(member),
            rectangle=choice.rectangle,
            gain=choice.gain,
            cost=choice.cost,
        )
        member.node.add(leaf, now)

    def done(self, member: Member, leaf: Leaf, now: float) -> None:
        """End a task well; an explored place rests until the map shows what was seen there."""
        task = leaf.task
        leaf.finished(now)
        if task.kind == "explore":
            rests_until = now + self._settings.settle_s
            if self._tried.visited(task.goal, member.name, rests_until):
                self._work.note(now, "given up", member.name, task, "its frontier stays")

    def _hand_back(self, member: Member) -> Mend:
        """Return what happens when an exploration fails: the place is offered again, or given up.

        A lost robot says nothing about the place it was going to. A robot at which one task after
        the other expires is left out for a while.
        """

        def mend(node: Node, now: float) -> Node | None:
            assert isinstance(node, Leaf)
            task, reason = node.task, node.reason
            return Act(
                "hand the place back", lambda at: self._offer_again(member, task, reason, at)
            )

        return mend

    def _offer_again(self, member: Member, task: Task, reason: str, now: float) -> None:
        last = member.live and self._tried.failed(task.goal, member.name, reason)
        self._work.note(now, "given up" if last else "announced", member.name, task, reason)
        if member.live and task.state is TaskState.EXPIRED:
            member.expiries += 1
            if member.expiries >= self._settings.expiries_max:
                member.expiries = 0
                member.benched_until = now + self._settings.bench_s
                self._work.note(now, "left out", member.name, reason="its tasks expire")

    def _review(self, now: float) -> None:
        """Find out whether anything is left to do, for anyone; second chances come last."""
        if any(task.kind in ("explore", "visit", "drive") for task in self._work.live_tasks()):
            self.nothing_since = None
            return
        able = self._able(now)
        if not able or self._choose(able, math.inf):
            self.nothing_since = None  # nobody can tell, or a place rests
        elif self._choose(able, math.inf, bars=False):
            self.nothing_since = None
            self._tried.lift_bars()
            self._work.note(now, "second chances", "", reason="nothing else is left")
            self.hold(now, idle_only=True)
        elif self.nothing_since is None:
            self.nothing_since = now


def _region(task: Task) -> Region:
    x, y = task.goal
    return Region(task.robot, task.goal, task.rectangle or (x, y, x, y))
