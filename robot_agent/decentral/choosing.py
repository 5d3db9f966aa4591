"""What a robot does next, by its own bid and by where the others are; and when it is through.

A robot is through when nothing is left that is worth a trip and all that it hears say so and hold
the same. It waits at home, listens and shares: when it hears of more, it goes on.
"""

from __future__ import annotations

import math

from coordination.bid import RobotBid
from coordination.strategy import Strategy
from coordination.tried_places import TriedPlaces
from mapping.geometry import Floats, Pose2
from protocol.crew import Crew
from protocol.messages import Award, Bid, TaskEnd, TeamPoses
from robot_agent.agent import Agent
from robot_agent.decentral.decision import Decision
from robot_agent.decentral.settings import DecisionSettings

_EPSILON = 1e-9
_HOME_NEAR = 1.0  # [m]; nearer is at home


class Choosing:
    """Turns bids into tasks, without anybody else.

    Attributes:
        crew: where everybody is, and what they are at.
        through: whether the mission is over as far as this robot knows.
        lost: whether it does not know where it is: what it saw is not shared yet.
        due: when something may have to be decided without news [s], or None.
    """

    def __init__(self, agent: Agent, strategy: Strategy, settings: DecisionSettings) -> None:
        self.crew = Crew()
        self.through = False
        self.lost = False
        self.due: float | None = None
        self._agent = agent
        self._settings = settings
        self._decision = Decision(agent.name, strategy, settings)
        self._agreed_since: float | None = None

    @property
    def busy(self) -> bool:
        """Whether the robot drives for a task."""
        return self._decision.region is not None

    @property
    def idle(self) -> bool:
        """Whether the robot finds nothing that is worth a trip."""
        return self._decision.idle_since is not None and not self.lost

    @property
    def last(self) -> tuple[RobotBid | None, TriedPlaces, float]:
        """The last bid, what was tried in vain, and the least gain [m2] that is worth a trip."""
        return self._decision.last

    def team_poses(self, now: float) -> TeamPoses:
        """Return where all are that are here: who was not heard for long may be anywhere."""
        return self.crew.team_poses(now - self._settings.here_s)

    def bid(self, message: Bid, now: float) -> Award | None:
        """Decide on a new bid of the robot's own."""
        bid = robot_bid_of(self._agent.name, message)
        return self._decision.bid(bid, self._costs(bid.places, now), now)

    def ended(self, end: TaskEnd, now: float) -> Award | None:
        """The task in hand has ended: decide what is next, on the last bid."""
        self._decision.ended(end, now)
        self.due = self._decision.next_awake(now)
        return self._again(now)

    def idle_word(self, now: float, home: tuple[float, float] | None) -> Award | None:
        """Return what a robot does that finds nothing: looks again, or waits at home.

        Args:
            now: mission time [s].
            home: where it began, (x, y) [m], map frame; None if it is not known yet.
        """
        if self.through:
            return None
        if self.due is not None and now >= self.due - _EPSILON:
            self.due = self._decision.next_awake(now)
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
        return self._decision.go_home(home)

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
        resting = self._decision.next_awake(now) is not None
        quiet = since is not None and now - since >= self._settings.quiet_s and not resting
        return quiet and not self.lost

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
        return self._decision.again(self._costs(self._decision.asked, now), now)

    def _costs(self, places_map: Floats, now: float) -> dict[str, Floats]:
        """Return how far each teammate that is here has to each of some places, (n,) [m]."""
        explorer = self._agent.explorer
        if explorer is None or not len(places_map):
            return {}
        return {
            name: explorer.costs_from(self._where(name), places_map)
            for name in self.crew.heard_within(self._settings.here_s, now)
            if name != self._agent.name and not self.crew.beacons[name].through
        }

    def _where(self, name: str) -> Pose2:
        return self.crew.beacons[name].T_map_base


def robot_bid_of(robot: str, message: Bid) -> RobotBid:
    """Return a robot's own bid, as strategies take it."""
    losses = message.losses if len(message.losses) else message.gains * 0.0
    return RobotBid(
        robot,
        message.number,
        message.map_number,
        message.T_map_base,
        message.places_map.astype(float),
        message.gains.astype(float),
        message.costs_m.astype(float),
        message.rectangles_map.astype(float),
        message.unreachable_map.astype(float),
        losses.astype(float),
    )
