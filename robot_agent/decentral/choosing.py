"""What a robot does next, by its own bid and by where the others are; and when it is through.

A robot is through when nothing is left that is worth a trip and all that it hears say so and hold
the same. It waits at home, listens and shares: when it hears of more, it goes on.
"""

from __future__ import annotations

import math

import numpy as np

from coordination.bid import RobotBid
from coordination.strategy import Strategy
from coordination.task import Point
from coordination.told_bid import robot_bid
from coordination.tried_places import TriedPlaces
from mapping.geometry import Floats, Pose2
from protocol.crew import Crew
from protocol.messages import Award, Bid, TaskEnd, TaskProgress, TeamPoses
from protocol.peer_messages import Beacon
from robot_agent.agent import Agent
from robot_agent.decentral.beaconing import differs
from robot_agent.decentral.claims import Claim, way_or_flight
from robot_agent.decentral.decision import Decision
from robot_agent.decentral.settings import DecisionSettings
from robot_agent.decentral.standing_by import StandingBy

_EPSILON = 1e-9
_HOME_NEAR = 1.0  # [m]; nearer is at home
_FARTHER_ON = 3.0  # [m]; goals within this of each other are of the same frontier
_BEEN_THERE = 1.0  # [m]; a teammate that leaves its goal from within this has been there


class Choosing:
    """Turns bids into tasks, without anybody else.

    Attributes:
        crew: where everybody is, and what they are at.
        through: whether the mission is over as far as this robot knows.
        lost: whether it does not know where it is: what it saw is not shared yet.
    """

    def __init__(self, agent: Agent, strategy: Strategy, settings: DecisionSettings) -> None:
        self.crew = Crew()
        self.through = False
        self._awake_at: float | None = None
        self.lost = False
        self._agent = agent
        self._settings = settings
        self._decision = Decision(agent.name, strategy, settings)
        self._standing_by = StandingBy(agent.name, settings)
        self._agreed_since: float | None = None

    @property
    def busy(self) -> bool:
        """Whether the robot drives for a task."""
        return self._decision.region is not None

    @property
    def goal(self) -> Point | None:
        """Where that leads, (x, y) [m], map frame; None if it does not."""
        return None if self._decision.region is None else self._decision.region.goal

    @property
    def idle(self) -> bool:
        """Whether the robot finds nothing that is worth a trip."""
        return self._decision.idle_since is not None and not self.lost

    @property
    def due(self) -> float | None:
        """When something may have to be decided without news [s], or None."""
        times = (self._awake_at, self._standing_by.due, self._decision.patient_until)
        return min((at for at in times if at is not None), default=None)

    @property
    def last(self) -> tuple[RobotBid | None, TriedPlaces, float]:
        """The last bid, what was tried in vain, and the least gain [m2] that is worth a trip."""
        return self._decision.last

    def team_poses(self, now: float) -> TeamPoses:
        """Return where all are that are here: who was not heard for long may be anywhere."""
        return self.crew.team_poses(now - self._settings.here_s)

    def bid(self, message: Bid, now: float) -> Award | None:
        """Decide on a new bid of the robot's own."""
        bid = robot_bid(self._agent.name, message)
        costs, claims = self._others(bid.places, now)
        return self._or_stand_by(self._decision.bid(bid, costs, now, claims), now)

    def hear(
        self, name: str, beacon: Beacon, stamp: float, now: float
    ) -> tuple[bool, Award | None]:
        """Take a teammate's beacon; decide anew if it is at something else than it was.

        Returns:
            Whether it is newer than what was heard before, and what to do now, if that changes.
        """
        before = self.crew.beacons.get(name)
        if not self.crew.hear(name, beacon, stamp, now):
            return False, None
        if before is not None and (visited := _visited(before, beacon)) is not None:
            self._decision.mate_visited(visited, name, now)
        if self.through or (before is not None and not differs(before, beacon)):
            return True, None
        return True, self._again(now)

    def progress(self, message: TaskProgress, now: float) -> None:
        """Note how the task in hand gets on."""
        self._decision.progress(message.task, message.remaining_m, now)

    def overdue(self, now: float) -> TaskEnd | None:
        """Return the end of the task in hand if the robot does not get on with it."""
        return self._decision.overdue(now)

    def ended(self, end: TaskEnd, now: float) -> Award | None:
        """The task in hand has ended: decide what is next, on the last bid."""
        self._decision.ended(end, now)
        self._awake_at = self._decision.next_awake(now)
        return self._again(now)

    def idle_word(self, now: float, home: tuple[float, float] | None) -> Award | None:
        """Return what a robot does that finds nothing: looks again, or waits at home.

        Args:
            now: mission time [s].
            home: where it began, (x, y) [m], map frame; None if it is not known yet.
        """
        if self.through:
            return None
        times = (self._awake_at, self._standing_by.due)
        if any(at is not None and now >= at - _EPSILON for at in times):
            self._awake_at = self._decision.next_awake(now)
            # One that is at something decides anew when that ends.
            award = None if self.busy else self._again(now)
            if award is not None:
                return award
        since = self._decision.idle_since
        if since is None or home is None or self._decision.homing:
            return None
        where = self._agent.pose_map()
        if now - since < self._settings.quiet_s or math.dist((where.x, where.y), home) < _HOME_NEAR:
            return None
        return self._decision.go_home(home, now)

    def agree(self, held: int, now: float) -> None:
        """See whether all are idle and hold the same, and have for a while: then it is through.

        Who was not heard for long is not waited for. If it comes back, this robot is not through
        any more until both hold the same.
        """
        if not (self._quiet(now) and self._all_say_so(held, now)):
            self._agreed_since = None
        elif self._agreed_since is None:
            self._agreed_since = now
        since = self._agreed_since
        self.through = since is not None and now - since >= self._settings.agreed_s

    def _quiet(self, now: float) -> bool:
        since = self._decision.idle_since
        quiet = since is not None and now - since >= self._settings.quiet_s
        return quiet and not self.lost and not self._decision.something_rests(now)

    def _all_say_so(self, held: int, now: float) -> bool:
        """Whether all that are waited for were just heard, are idle, and hold what is held here."""
        here = self.crew.heard_within(self._settings.here_s, now)
        for name in self.crew.heard_within(self._settings.lost_s, now):
            beacon = self.crew.beacons[name]
            if name == self._agent.name:
                continue
            if name not in here or not beacon.idle or beacon.held != held:
                return False
        return True

    def _again(self, now: float) -> Award | None:
        places, explorer = self._decision.asked, self._agent.explorer
        own = None
        if explorer is not None and len(places):
            own = explorer.costs_from(self._agent.pose_map(), places)
        costs, claims = self._others(places, now)
        return self._or_stand_by(self._decision.again(costs, now, claims, own), now)

    def _or_stand_by(self, award: Award | None, now: float) -> Award | None:
        """Return a decision's award, or the word where to wait if all is left to others."""
        bid = self._decision.last[0]
        planning_map = self._agent.planning_map
        if not self._decision.stands_by or bid is None or planning_map is None:
            self._standing_by.end()
            return award
        if self._decision.homing or self._decision.settled:
            self._standing_by.look_again(now)  # it was through with all: what came up is but little
            return None
        where = self._agent.pose_map()
        place = self._standing_by.place((where.x, where.y), bid, planning_map, self.crew, now)
        return None if place is None else self._decision.wait_at(place, now)

    def _others(self, places_map: Floats, now: float) -> tuple[dict[str, Floats], list[Claim]]:
        """Return how far each teammate has to each of some places, (n,) [m], and where they head.

        Who is heading somewhere comes to other places after that. Who is not here does not count,
        nor who finds nothing worth a trip: it leaves to others what this robot sees.
        """
        explorer = self._agent.explorer
        costs: dict[str, Floats] = {}
        claims: list[Claim] = []
        if explorer is None or not len(places_map):
            return costs, claims
        for name in self.crew.heard_within(self._settings.here_s, now):
            beacon = self.crew.beacons[name]
            if name == self._agent.name or beacon.idle or beacon.through:
                continue
            where, goal = beacon.T_map_base, beacon.goal_map
            if goal is None:
                costs[name] = explorer.costs_from(where, places_map)
                continue
            first = float(explorer.costs_from(where, np.array([goal]))[0])
            first = way_or_flight(first, (where.x, where.y), goal)
            costs[name] = first + explorer.costs_from(Pose2(*goal, 0.0), places_map)
            claims.append(Claim(name, goal, first))
        return costs, claims


def _visited(before: Beacon, now: Beacon) -> Point | None:
    """Return where a teammate was heading that got there and goes elsewhere now, else None.

    A frontier recedes before a robot: one that heads a little farther has not seen all of it yet.
    """
    goal, where = before.goal_map, now.T_map_base
    if goal is None or before.life != now.life:
        return None
    if now.goal_map is not None and math.dist(goal, now.goal_map) <= _FARTHER_ON:
        return None
    return goal if math.dist(goal, (where.x, where.y)) <= _BEEN_THERE else None
