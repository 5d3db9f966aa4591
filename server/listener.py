"""The server of a team whose robots decide for themselves: it listens, and draws the same map.

It holds what every robot holds, by the same messages, tells observers the map and where everybody
is, and says when the robots that it hears are through. It gives no tasks.

Source: Pfingsthorn et al. 2007, section 2: every member's map is equivalent to the global map.
"""

from __future__ import annotations

from collections.abc import Sequence

from mapping.shared_map import SharedMap
from protocol import messages as words
from protocol import operator_messages as asks
from protocol.codec import Header
from protocol.crew import Crew
from protocol.effects import Effect, Event, Note, Received, Rejected, Send, Stop
from protocol.log.held_log import HeldLog, draw_changes
from protocol.log.messages import LogHave, LogWant, Observations, PoseSet
from protocol.log.sync import LogSync, sends
from protocol.map_feed import MapFeed
from protocol.messages import EVERYONE, WORLD, Ended, Message
from protocol.peer_messages import Beacon, Presence
from protocol.world_messages import Finished, Join, Through
from server.settings import ServerSettings

_EPSILON = 1e-9
_LOG = (Observations, PoseSet, LogHave, LogWant)


class Listener:
    """The core of a server that only listens.

    Args:
        settings: how often it publishes, and when a robot counts as lost.
        sync: keeps its copy of the observations the same as the robots'.
        shared: draws them.
        robots: names of the team.
        time_limit: mission time at which the mission ends [s]; None for never.
    """

    def __init__(
        self,
        settings: ServerSettings,
        sync: LogSync,
        shared: SharedMap,
        robots: Sequence[str],
        time_limit: float | None = None,
    ) -> None:
        self.settings = settings
        self.sync = sync
        self.shared = shared
        self.held = HeldLog(sync.log)
        self.crew = Crew()
        self.robots = tuple(robots)
        self.now = 0.0
        self.ended: Ended | None = None
        self.reason = ""
        self._said = Through(through=False, held=0)
        self.feed = MapFeed(shared.view(), settings.map.delta_period_s)
        self._time_limit = time_limit
        self._observers: dict[str, None] = {}
        self._joined = False
        self._next_poses = 0.0
        self._next_presence = 0.0

    # --- the core's three methods -----------------------------------------------------------

    def next_deadline(self) -> float | None:
        """Return when something is due next [s]."""
        return min(self.feed.due, self._next_poses, self._next_presence, self.sync.next_deadline())

    def handle(self, event: Event, now: float) -> list[Effect]:
        """Take a robot's word to all, or an observer's question."""
        if isinstance(event, Rejected):
            self.sync.fault(event.source, event.reason, now)
            return list(self.sync.take_notes())
        if not isinstance(event, Received) or event.channel != "fleet":
            return []
        source, message = event.header.source, event.message
        if source in self.robots:
            return self._hear(event.header, message, now)
        return self._answer(source, message)

    def tick(self, now: float) -> list[Effect]:
        """Keep the copy, publish, and notice the end."""
        self.now = now
        effects: list[Effect] = []
        if not self._joined:
            self._joined = True
            effects.append(Send("clock", WORLD, Join(role="server")))
        if self.sync.next_deadline() <= now:
            effects += self._say(now)
        if now >= self._next_presence - _EPSILON:
            self._next_presence = now + self.settings.presence_period_s
            if self.sync.peers.heard_within(self.settings.silence_s, now):
                effects.append(Send("fleet", EVERYONE, Presence()))
        if now >= self.feed.due - _EPSILON:
            self.follow(now)
            delta = self.feed.delta_due(now)
            effects += self._publish(delta) if delta else []
        if now >= self._next_poses - _EPSILON:
            self._next_poses = now + self.settings.map.poses_period_s
            effects += self._publish(self.crew.team_poses()) if self.crew.beacons else []
        return [*effects, *self.sync.take_notes(), *self._notice_end(now)]

    # --- steps ----------------------------------------------------------------------------------

    def follow(self, now: float) -> None:
        """Let the map follow the log; whoever told what is no observation is to blame."""
        draw_changes(self.sync, self.held, self.shared, now)

    def _hear(self, header: Header, message: Message, now: float) -> list[Effect]:
        """Take a robot's word."""
        source = header.source
        if source in self.sync.standing.isolated:
            return []
        self.sync.hear(source, now)
        if isinstance(message, _LOG):
            self.sync.handle(source, message, now)
            return list(self.sync.take_notes())
        if isinstance(message, Beacon):
            self.crew.hear(source, message, header.stamp, now)
        return []

    def _say(self, now: float) -> list[Effect]:
        return sends("fleet", self.sync.tick(now))

    def _answer(self, name: str, message: Message) -> list[Effect]:
        """Answer an observer or an operator: nobody can tell these robots what to do."""
        if isinstance(message, words.Hello):
            self._observers[name] = None
            welcome = words.Welcome(now_s=self.now, strategy="robots decide for themselves")
            effects: list[Effect] = [Send("fleet", name, welcome)]
            return [*effects, *self._snapshot(name)]
        if isinstance(message, words.MapRequest):
            return self._snapshot(name)
        if isinstance(message, asks.StopRequest):
            answer = asks.Answer(accepted=True, text="the mission ends")
            return [Send("fleet", name, answer), *self._end(message.ended, f"asked for by {name}")]
        if isinstance(
            message, asks.VisitRequest | asks.PauseRequest | asks.ResumeRequest | asks.DriveRequest
        ):
            text = "the robots of this team decide for themselves: no server tells them what to do"
            return [Send("fleet", name, asks.Answer(accepted=False, text=text))]
        return []

    def _snapshot(self, name: str) -> list[Effect]:
        return [Send("fleet", name, self.feed.snapshot())] if self.feed.number else []

    def _publish(self, message: Message) -> list[Effect]:
        return [Send("fleet", name, message) for name in self._observers]

    def _notice_end(self, now: float) -> list[Effect]:
        """End the mission by time; say when all robots that are waited for are through."""
        if self.ended is not None:
            return []
        if self._time_limit is not None and now >= self._time_limit - _EPSILON:
            return self._end("time_limit", f"{self._time_limit:g} s are over")
        waited_for = self.crew.heard_within(self.settings.abandon_s, now)
        beacons = [self.crew.beacons[name] for name in waited_for]
        held = self.held.checksum()
        through = bool(beacons) and all(b.through and b.held == held for b in beacons)
        if not (through or self._said.through):
            return []
        word = Through(
            through=through, held=held, shut_out=tuple(sorted(self.sync.standing.isolated))
        )
        if word == self._said:
            return []
        self._said = word
        return [Send("clock", WORLD, word)]

    @property
    def through(self) -> bool:
        """Whether all robots that are waited for say that nothing is left, and hold the same."""
        return self._said.through

    def _end(self, ended: Ended, reason: str) -> list[Effect]:
        """Tell the world that the mission is over; it tells the robots."""
        if self.ended is not None:
            return []
        self.follow(self.now)
        self.ended, self.reason = ended, reason
        note = Note("info", f"mission over at {self.now:.1f} s: {ended}, {reason}")
        return [note, Send("clock", WORLD, Finished(ended=ended, reason=reason)), Stop(ended)]
