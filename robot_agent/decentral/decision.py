"""A robot decides for itself what to explore next, and when there is nothing left.

It ranks the places of its own bid by how many of the others are nearer, as far as it knows where
they are, and leaves to them where they said that they go and come first; nobody tells it what to
do, and nobody need agree.

Source: Pfingsthorn et al. 2007 for a team without a master; Bautin, Simonin & Charpillet 2012,
"MinPos", for the ranks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from coordination.bid import RobotBid, near
from coordination.lease import Lease, LeaseTerms
from coordination.strategy import Choice, ChoosesAlone, Region, Strategy
from coordination.task import Point
from coordination.tried_places import TriedPlaces
from mapping.geometry import Floats
from protocol.messages import Award, TaskEnd
from robot_agent.decentral.claims import Claim, ClaimTerms, claimed
from robot_agent.decentral.settings import DecisionSettings

_AT_GOAL = 0.5  # [m]; what lies nearer to where the robot heads is what it heads for
_LOOKS_STILL = 2.0  # [m]; so near to its goal a robot goes on though nothing is to be gained there


class Decision:
    """What the robot is at, what it tried, and what it decides.

    Args:
        robot: its name.
        strategy: ranks the places.
        settings: when to give up.

    Attributes:
        region: what it is exploring, or None.
        idle_since: since when it finds nothing worth a trip [s], or None while it does.
        stands_by: whether all that is worth a trip is left to teammates.
        settled: whether it had found nothing for a while before that came up.
    """

    def __init__(self, robot: str, strategy: Strategy, settings: DecisionSettings) -> None:
        self.region: Region | None = None
        self.idle_since: float | None = None
        self.stands_by = False
        self.settled = False
        self._gone_since: float | None = None  # what is in hand was worth nothing since then
        self._robot = robot
        self._strategy = strategy
        self._settings = settings
        self._tried = TriedPlaces(settings.tried_radius_m, settings.max_tries)
        self._task = 0
        self._bid: RobotBid | None = None
        self._lease: Lease | None = None
        # A wait is worth no detours: of two ways that are shut in turn there is no end.
        self._terms = {
            "explore": LeaseTerms(settings.patience_s, math.inf),
            "wait": LeaseTerms(settings.patience_s, math.inf, detours=0),
        }
        self._home = False
        self._home_failures = 0
        self._got_somewhere = False  # since it last failed: who is shut in needs no second chance

    @property
    def homing(self) -> bool:
        """Whether the robot was sent home, or has tried in vain often enough."""
        return self._home or self._home_failures >= self._settings.max_tries

    def bid(
        self,
        bid: RobotBid,
        costs: Mapping[str, Floats],
        now: float,
        claims: Sequence[Claim] = (),
    ) -> Award | None:
        """Decide anew, on a bid of the robot's own.

        Args:
            bid: what it expects of each place.
            costs: by teammate, (n,) [m] how far it has to each place of the bid.
            now: mission time [s].
            claims: where teammates said that they are heading.
        """
        self._bid = bid
        award = self._next(bid, costs, now, claims)
        if self.idle_since == now and self._got_somewhere and self._tried.lift_bars():
            self.idle_since, self._got_somewhere = None, False
            award = self._next(bid, costs, now, claims)
        return award

    def _next(
        self, bid: RobotBid, costs: Mapping[str, Floats], now: float, claims: Sequence[Claim]
    ) -> Award | None:
        """Decide on what is not kept from the robot."""
        kept = self._tried.kept_from(self._robot, now)
        left = ~near(bid.places, kept, self._settings.tried_radius_m)
        settings = self._settings
        terms = ClaimTerms(settings.claim_apart_m, settings.claim_overlap, settings.claim_tie_m)
        nearest = np.min([*costs.values(), np.full(len(bid), np.inf)], axis=0)
        free = left & ~claimed(bid, nearest, claims, terms)
        mates = [
            replace(bid, robot=name, costs=costs[name]).only(free & np.isfinite(costs[name]))
            for name in sorted(costs)
        ]
        mine = self._own_choice([bid.only(free), *mates])
        if mine is not None:
            return self._explore(mine, now)
        self._none_left(bid.only(left), now)
        return None

    def again(
        self,
        costs: Mapping[str, Floats],
        now: float,
        claims: Sequence[Claim] = (),
        own: Floats | None = None,
    ) -> Award | None:
        """Decide anew on the last bid: a task has ended, a place has rested, others have news.

        Args:
            costs: as for `bid`.
            now: mission time [s].
            claims: as for `bid`.
            own: (n,) [m] how far the places of the last bid are by now; as they were without it.
        """
        if self._bid is None:
            return None
        if own is not None:
            self._bid = replace(self._bid, costs=np.where(np.isfinite(own), own, self._bid.costs))
        return self.bid(self._bid, costs, now, claims)

    @property
    def last(self) -> tuple[RobotBid | None, TriedPlaces, float]:
        """The last bid, what was tried in vain, and the least gain [m2] that is worth a trip."""
        return self._bid, self._tried, self._strategy.min_gain

    @property
    def asked(self) -> Floats:
        """The places of the last bid, (n, 2) [m], map frame."""
        return np.zeros((0, 2)) if self._bid is None else self._bid.places

    def ended(self, end: TaskEnd, now: float) -> None:
        """The task in hand has ended."""
        if end.task != self._task:
            return
        region, self.region = self.region, None
        self._lease = None
        if self._home and end.outcome != "done":
            self._home, self._home_failures = False, self._home_failures + 1
        if region is None:
            return
        rests_until, reason = now + self._settings.rest_s, end.reason or end.outcome
        if end.outcome == "done":
            self._got_somewhere = True
            self._tried.visited(region.goal, self._robot, rests_until)
        elif end.outcome == "unreachable":  # by a map that has only begun to show the way
            self._tried.rested(region.goal, self._robot, reason, rests_until)
        else:
            self._got_somewhere = False
            self._tried.failed(region.goal, self._robot, reason)

    def mate_visited(self, place: Point, mate: str, now: float) -> None:
        """Note that a teammate was at a place: if the frontier stays, that was a try in vain."""
        self._tried.visited(place, mate, now)

    def go_home(self, home: tuple[float, float], now: float) -> Award:
        """Return the word to wait where the robot began."""
        self._home = True
        return self._award("wait", home, now)

    def wait_at(self, place: tuple[float, float], now: float) -> Award:
        """Return the word to wait somewhere until there is something to do."""
        return self._award("wait", place, now)

    def progress(self, task: int, remaining: float, now: float) -> None:
        """Note that `remaining` [m] of the way to a task are left."""
        if self._lease is not None and task == self._task:
            self._lease.progress(remaining, now)

    @property
    def patient_until(self) -> float | None:
        """When the task in hand has failed [s] if there is no more progress."""
        return None if self._lease is None else self._lease.deadline

    def overdue(self, now: float) -> TaskEnd | None:
        """Return the end of the task in hand if the robot does not get on with it."""
        reason = None if self._lease is None else self._lease.violation(now)
        return TaskEnd(task=self._task, outcome="failed", reason=reason) if reason else None

    def next_awake(self, now: float) -> float | None:
        """Return when a place has rested enough [s], None if none rests."""
        return self._tried.next_awake(now)

    def something_rests(self, now: float) -> bool:
        """Whether something rests that was worth a trip at the last bid."""
        if self._bid is None:
            return False
        worth = self._bid.places[self._worth(self._bid)]
        return bool(near(worth, self._tried.resting(now), self._settings.tried_radius_m).any())

    def _worth(self, bid: RobotBid) -> npt.NDArray[np.bool_]:
        """Return which places of a bid are worth a trip, (n,)."""
        return (bid.gains >= self._strategy.min_gain) & (bid.gains > 0.0)

    def _none_left(self, left: RobotBid, now: float) -> None:
        """Nothing is free: leave what is in hand to a teammate, be idle, or go on if almost there.

        Args:
            left: places of the bid that are left to teammates.
            now: mission time [s].
        """
        worth = left.only(self._worth(left))
        if self.region is not None:
            if self._goes_on(self.region.goal, worth, now):
                return
            self.region = None
        self.stands_by = len(worth) > 0
        if self.stands_by:
            if self.idle_since is not None:
                self.settled |= now - self.idle_since >= self._settings.quiet_s
            self.idle_since = None
        elif self.idle_since is None:
            self.idle_since = now

    def _goes_on(self, goal: Point, worth: RobotBid, now: float) -> bool:
        """Whether the robot drives on to a goal that is not free any more.

        Not if it is left to a teammate, nor, far from it, if it has been worth nothing for a while.
        Close by it looks: the map may lose a frontier just before the robot sees all of it.
        """
        if near(worth.places, goal, _AT_GOAL).any():
            return False
        self._gone_since = now if self._gone_since is None else self._gone_since
        here = worth.T_map_base
        close = math.dist(goal, (here.x, here.y)) <= _LOOKS_STILL
        return close or now - self._gone_since < self._settings.quiet_s

    def _own_choice(self, bids: list[RobotBid]) -> Choice | None:
        """Return what the strategy chooses for this robot, whose bid comes first."""
        own, *others = bids
        if isinstance(self._strategy, ChoosesAlone):
            return self._strategy.choose(own, others, self.region, ())
        current = (self.region,) if self.region else ()
        choices = self._strategy.assign(tuple(sorted(bids, key=lambda b: b.robot)), current, ())
        return next((choice for choice in choices if choice.robot == self._robot), None)

    def _explore(self, choice: Choice, now: float) -> Award | None:
        """Return the award of a place, None if it is the one in hand."""
        self.idle_since, self._gone_since = None, None
        self.stands_by = self.settled = False
        self._home, self._home_failures = False, 0
        same = self.region is not None and math.dist(self.region.goal, choice.goal) < 0.1
        goal = self.region.goal if same and self.region else choice.goal
        self.region = Region(self._robot, goal, choice.rectangle)
        return None if same else self._award("explore", goal, now)

    def _award(self, kind: str, goal: tuple[float, float], now: float) -> Award:
        self._task += 1
        self._lease = Lease(self._terms[kind], now)
        fields = {"task": self._task, "kind": kind, "goal_map": goal}
        return Award.model_validate({**fields, "lease_s": self._settings.lease_s})
