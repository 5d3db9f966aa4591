"""A robot decides for itself what to explore next, and when there is nothing left.

It ranks the places of its own bid by how many of the others are nearer, as far as it knows where
they are; nobody tells it what to do, and nobody need agree.

Source: Pfingsthorn et al. 2007 for a team without a master; Bautin, Simonin & Charpillet 2012,
"MinPos", for the ranks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from coordination.bid import RobotBid
from coordination.strategy import Choice, ChoosesAlone, Region, Strategy
from coordination.tried_places import TriedPlaces
from mapping.geometry import Floats
from protocol.messages import Award, TaskEnd
from robot_agent.decentral.settings import DecisionSettings


class Decision:
    """What the robot is at, what it tried, and what it decides.

    Args:
        robot: its name.
        strategy: ranks the places.
        settings: when to give up.

    Attributes:
        region: what it is exploring, or None.
        idle_since: since when it finds nothing worth a trip [s], or None while it does.
    """

    def __init__(self, robot: str, strategy: Strategy, settings: DecisionSettings) -> None:
        self.region: Region | None = None
        self.idle_since: float | None = None
        self._robot = robot
        self._strategy = strategy
        self._settings = settings
        self._tried = TriedPlaces(settings.tried_radius_m, settings.max_tries)
        self._task = 0
        self._bid: RobotBid | None = None
        self._home = False

    @property
    def homing(self) -> bool:
        """Whether the robot was sent home."""
        return self._home

    def bid(self, bid: RobotBid, costs: Mapping[str, Floats], now: float) -> Award | None:
        """Decide anew, on a bid of the robot's own.

        Args:
            bid: what it expects of each place.
            costs: by teammate, (n,) [m] how far it has to each place of the bid.
            now: mission time [s].
        """
        self._bid = bid
        bids = [bid, *(_of_mate(bid, name, costs[name]) for name in sorted(costs))]
        kept = self._tried.kept_from(self._robot, now)
        return self._decide(
            [each.without(kept, self._settings.tried_radius_m) for each in bids], now
        )

    def again(self, costs: Mapping[str, Floats], now: float) -> Award | None:
        """Decide anew on the last bid: the task in hand has ended, or a place has rested enough."""
        return None if self._bid is None else self.bid(self._bid, costs, now)

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
        self._home = self._home and end.outcome == "done"
        if region is None:
            return
        if end.outcome == "done":
            self._tried.visited(region.goal, self._robot, now + self._settings.rest_s)
        else:
            self._tried.failed(region.goal, self._robot, end.reason or end.outcome)

    def go_home(self, home: tuple[float, float]) -> Award:
        """Return the word to wait where the robot began."""
        self._home = True
        return self._award("wait", home)

    def next_awake(self, now: float) -> float | None:
        """Return when a place has rested enough [s], None if none rests."""
        return self._tried.next_awake(now)

    def _decide(self, bids: list[RobotBid], now: float) -> Award | None:
        """Choose among the places that are left; None to go on as before."""
        mine = self._own_choice(bids)
        if mine is None:
            if self.region is None and self.idle_since is None:
                self.idle_since = now
            return None
        self.idle_since, self._home = None, False
        return self._explore(mine)

    def _own_choice(self, bids: list[RobotBid]) -> Choice | None:
        """Return what the strategy chooses for this robot, whose bid comes first."""
        own, *others = bids
        if isinstance(self._strategy, ChoosesAlone):
            return self._strategy.choose(own, others, self.region, ())
        current = (self.region,) if self.region else ()
        choices = self._strategy.assign(tuple(sorted(bids, key=lambda b: b.robot)), current, ())
        return next((choice for choice in choices if choice.robot == self._robot), None)

    def _explore(self, choice: Choice) -> Award | None:
        """Return the award of a place, None if it is the one in hand."""
        same = self.region is not None and math.dist(self.region.goal, choice.goal) < 0.1
        goal = self.region.goal if same and self.region else choice.goal
        self.region = Region(self._robot, goal, choice.rectangle)
        return None if same else self._award("explore", goal)

    def _award(self, kind: str, goal: tuple[float, float]) -> Award:
        self._task += 1
        fields = {"task": self._task, "kind": kind, "goal_map": goal}
        return Award.model_validate({**fields, "lease_s": self._settings.lease_s})


def _of_mate(bid: RobotBid, name: str, costs: Floats) -> RobotBid:
    """Return what a teammate would bid for the places of one's own bid that it has a way to."""
    mate = replace(bid, robot=name, costs=costs)
    return mate.only(np.isfinite(costs))
