"""Sends robots that have been idle for a while to places where they wait better."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from coordination.bid import near
from coordination.task import Point
from coordination.task_node import Act, Leaf, Mend, Node
from coordination.tried_places import TriedPlaces
from coordination.waiting_place import IdleRobot
from mapping.geometry import Floats
from server.executive_settings import ExecutiveSettings
from server.pool import Member, Pool
from server.remaining import frontiers
from server.work import Work

# Called with the idle robots, all places left to explore (n, 2) [m] and the gains there (n,) [m2];
# returns places (x, y) [m] by robot, not necessarily for all of them.
ChooseWaitingPlaces = Callable[[tuple[IdleRobot, ...], Floats, Floats], Mapping[str, Point]]


class Waiting:
    """Gives idle robots places to wait at, now and then, and only if it moves them by something."""

    def __init__(
        self,
        settings: ExecutiveSettings,
        pool: Pool,
        work: Work,
        tried: TriedPlaces,
        min_gain: float,
        choose: ChooseWaitingPlaces | None,
    ) -> None:
        self._settings = settings
        self._pool = pool
        self._work = work
        self._tried = tried
        self._min_gain = min_gain
        self._choose = choose
        self._next = -math.inf

    def due(self) -> float | None:
        """Return when `tick` has something to do [s], or None."""
        idle = self._idle() if self._choose is not None else []
        times = [member.idle_since for member in idle if member.idle_since is not None]
        return max(min(times) + self._settings.wait_after_s, self._next) if times else None

    def tick(self, now: float) -> None:
        """Send the idle robots to wait, if it is time."""
        due = self.due()
        if self._choose is None or due is None or now < due:
            return
        self._next = now + self._settings.wait_period_s
        places, gains, _ = frontiers(self._pool)
        wanted = gains >= self._min_gain
        wanted &= ~near(places, self._tried.given_up(), self._settings.give_up_radius_m)
        if not wanted.any():
            return
        idle = {member.name: member for member in self._idle() if member.fit(now)}
        robots = tuple(IdleRobot(m.name, m.place) for m in idle.values() if m.place is not None)
        chosen = self._choose(robots, places[wanted], gains[wanted]) if robots else {}
        for name, place in sorted(chosen.items()):
            if name in idle and self._worth_moving(idle[name], place):
                self._send(idle[name], place, now)

    def _idle(self) -> list[Member]:
        """Return the robots of the pool that have nothing to explore, by name."""
        return [
            member
            for member in self._pool
            if member.live
            and member.mode == "pool"
            and member.idle_since is not None
            and member.place is not None
        ]

    def _send(self, member: Member, place: Point, now: float) -> None:
        self._work.take_back(member, "waits elsewhere", now)
        leaf = self._work.leaf(member.name, "wait", place, self._refused(member))
        member.node.add(leaf, now)

    def _worth_moving(self, member: Member, place: Point) -> bool:
        """Whether a place is far enough from where the robot is, is going, and could not go."""
        task = member.task
        known = (member.place if task is None else task.goal, member.refused_wait)
        return all(
            point is None or math.dist(point, place) > self._settings.wait_move_m for point in known
        )

    def _refused(self, member: Member) -> Mend:
        """Return what happens when a robot cannot get to its waiting place: it stays."""

        def mend(node: Node, now: float) -> Node | None:
            assert isinstance(node, Leaf)
            goal = node.task.goal

            def remember(now: float) -> None:
                member.refused_wait = goal

            return Act("stay instead", remember)

        return mend
