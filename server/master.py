"""The master: one core that merges maps, gives out tasks and answers operators.

It carries words between the team and its parts: the roster, the merger with intake and publisher,
the executive. All state changes through `handle` and `tick`; no clock, no socket and no file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from coordination.strategy import Strategy
from coordination.told_bid import BidError, robot_bid
from mapping.geometry import IDENTITY
from protocol import messages as words
from protocol import operator_messages as asks
from protocol.body import Body
from protocol.effects import Effect, Event, Note, Received, Rejected, Send, Stop
from protocol.fault_book import FaultBook
from protocol.messages import Message
from protocol.world_messages import Finished, Join
from server.bids import way_weight
from server.last_looks import LastLooks
from server.map_merger import MapMerger
from server.map_publisher import MapPublisher
from server.placing import motion_of
from server.report_intake import ReportIntake
from server.roster import Roster
from server.settings import ServerSettings
from server.task_executive import TaskExecutive
from server.waiting_ground import WaitingGround, pose_of

Ended = words.Ended
_EPSILON = 1e-9


class Master:
    """The core of the server process.

    Args:
        settings: of all its parts.
        strategy: decides who explores what.
        strategy_name: what it is called, for the welcome.
        robots: names that belong to the team; others are refused.
        time_limit: mission time at which the mission ends [s]; None for never.
    """

    def __init__(
        self,
        settings: ServerSettings,
        strategy: Strategy,
        strategy_name: str,
        robots: Sequence[str],
        time_limit: float | None = None,
    ) -> None:
        self.settings = settings
        self.roster = Roster(robots, settings.silence_s)
        self.merger = MapMerger(settings.merger)
        ground = WaitingGround(self.merger, self.roster, settings.map)
        self.executive = TaskExecutive(settings.executive, strategy, ground.choose)
        self._looks = LastLooks(self.merger, self.roster, self.executive, settings.map)
        self.strategy_name = strategy_name
        self.ended: Ended | None = None
        self.reason = ""
        self.ended_at = 0.0
        self.now = 0.0
        self.faults = FaultBook()
        self._time_limit = time_limit
        self._publisher = MapPublisher(self.merger, settings.map)
        margin = settings.map.teammate_margin_m
        self._intake = ReportIntake(self.merger, self.roster, margin, self.faults)
        self._joined = False
        self._alone_since: float | None = None
        self._answers: dict[type[Message], Callable[[str, Message, float], list[Effect]]] = {
            words.Hello: self._hello,
            words.Heartbeat: self._heartbeat,
            words.ScanReport: self._report,
            words.MapRequest: self._map_request,
            words.Bid: self._bid,
            words.TaskProgress: self._progress,
            words.TaskEnd: self._task_end,
            words.TightPlace: self._tight_place,
            asks.VisitRequest: self._operator,
            asks.PauseRequest: self._operator,
            asks.ResumeRequest: self._operator,
            asks.DriveRequest: self._operator,
            asks.StopRequest: self._stop_request,
        }

    # --- the core's three methods -----------------------------------------------------------

    def next_deadline(self) -> float | None:
        """Return when something is due next [s]."""
        due = [self._publisher.next_deadline(), *self.roster.deadlines()]
        deadline = self.executive.next_deadline()
        return min(due if deadline is None else [*due, deadline])

    def handle(self, event: Event, now: float) -> list[Effect]:
        """Take a message or the news that a peer is gone."""
        if isinstance(event, Rejected):
            return list(self.faults.enter("a frame", event.source, event.reason))
        if not isinstance(event, Received) or event.channel != "fleet":
            return []
        answer = self._answers.get(type(event.message))
        name = event.header.source
        if answer is None:
            return []
        if not isinstance(event.message, words.Hello) and not self.roster.accept(event.header, now):
            return []
        return [*answer(name, event.message, now), *self._recovered(name, now)]

    def tick(self, now: float) -> list[Effect]:
        """Publish what is due, let the executive work, and notice the end."""
        self.now = now
        effects: list[Effect] = []
        if not self._joined:
            self._joined = True
            effects.append(Send("clock", "world", Join(role="server")))
        effects += self._find_silent(now)
        if self.ended is None:
            effects += self.executive.tick(now)
            effects += self._looks.call_back(now)
            effects += self._notice_end(now)
        elif now >= self.ended_at + self.settings.farewell_s - _EPSILON:
            return [*effects, *self._farewell()]
        return [*effects, *self._publish(now)]

    # --- joining and leaving ------------------------------------------------------------------

    def _hello(self, name: str, message: Message, now: float) -> list[Effect]:
        """Take a peer in; a robot with a new incarnation starts with an empty local map."""
        assert isinstance(message, words.Hello)
        refusal = self.roster.refusal(name, message)
        if refusal is not None:
            return [Send("fleet", name, words.Refused(reason=refusal))]
        fresh = self.roster.admit(name, message, now)
        effects: list[Effect] = [
            Send("fleet", name, words.Welcome(now_s=now, strategy=self.strategy_name))
        ]
        if message.role == "robot" and fresh:
            effects += self._robot_hello(name, message, now)
        if self.map_number > 0 and message.role != "operator":
            effects.append(Send("fleet", name, self._publisher.map.snapshot()))
        return effects

    def _robot_hello(self, name: str, hello: words.Hello, now: float) -> list[Effect]:
        """Enter a robot in the map merger and the pool."""
        body = hello.body or Body()
        again = self.roster.enter(name, body, now)
        sigma, turn = hello.start_sigma_m, math.radians(hello.start_sigma_deg)
        self.merger.add(name, hello.start or IDENTITY, sigma, turn, motion_of(body.drive))
        self._intake.begin(name)
        note = Note("info", f"{name} is {'back' if again else 'here'}")
        return [note, *self.executive.robot_joined(name, body, now)]

    def _find_silent(self, now: float) -> list[Effect]:
        """Take robots out of the pool that were not heard of for too long."""
        effects: list[Effect] = []
        for name in self.roster.find_silent(now):
            effects.append(Note("warning", f"{name} is silent; its task is free for others"))
            effects += self.executive.robot_lost(name, now)
            lost = asks.RobotLost(robot=name, state="lost")
            effects += self._tell(self.roster.observers, lost)
        return effects

    def _recovered(self, name: str, now: float) -> list[Effect]:
        """Take a robot back in that was silent and speaks again."""
        if not self.roster.find_back(name):
            return []
        back = asks.RobotLost(robot=name, state="back")
        return [
            Note("info", f"{name} speaks again"),
            *self.executive.robot_back(name, now),
            *self._tell(self.roster.observers, back),
        ]

    # --- mapping ------------------------------------------------------------------------------

    def _heartbeat(self, name: str, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.Heartbeat)
        where = self.roster.where.get(name)
        if where is None:
            return []
        where.T_odom_base, where.speed = message.T_odom_base, message.speed_m_s
        where.stamp, where.path_map, where.heard = now, message.path_map, True
        where.map_digest = message.map_digest
        return list(self.executive.contact(name, now))

    def _report(self, name: str, message: Message, now: float) -> list[Effect]:
        """Place a scan in the team's map; not any more when the time for last words is over."""
        assert isinstance(message, words.ScanReport)
        if self.ended_and_gone(now):
            return []
        return self._intake.take(name, message)

    def _map_request(self, name: str, message: Message, now: float) -> list[Effect]:
        return [Send("fleet", name, self._publisher.map.snapshot())] if self.map_number else []

    def _publish(self, now: float) -> list[Effect]:
        """Tell the team and observers what changed in the map and where everybody is."""
        effects: list[Effect] = []
        delta = self._publisher.map.delta_due(now)
        if delta is not None:
            self.executive.map_changed(delta.number, now)
            effects += self._tell(self.roster.audience(), delta)
        poses = self._publisher.poses_due(self.roster, self.executive, now)
        if poses is not None:
            effects += self._tell(self.roster.audience(), poses)
        return effects

    # --- tasks --------------------------------------------------------------------------------

    def _bid(self, name: str, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.Bid)
        if name not in self.roster.bodies:
            return []
        try:
            dear = self.settings.cost_weights.get(name, 1.0)
            bid = robot_bid(name, message, way_weight(self.roster.bodies[name], dear))
        except BidError as error:
            return [Note("warning", f"dropped a bid of {name}: {error}")]
        return list(self.executive.bid(bid, now))

    def _progress(self, name: str, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.TaskProgress)
        return list(self.executive.progress(name, message.task, message.remaining_m, now))

    def _task_end(self, name: str, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.TaskEnd)
        return list(
            self.executive.task_ended(name, message.task, message.outcome, message.reason, now)
        )

    def _tight_place(self, name: str, message: Message, now: float) -> list[Effect]:
        """Pass on where a robot does not fit through: nor do others of its size or more."""
        bodies = self.roster.bodies
        if name not in bodies:
            return []
        others = [
            other
            for other in self.roster.present()
            if other != name and other in bodies and bodies[other].radius_m >= bodies[name].radius_m
        ]
        return self._tell(others, message)

    def _operator(self, name: str, message: Message, now: float) -> list[Effect]:
        """Carry out an operator's word and answer it."""
        if isinstance(message, asks.VisitRequest):
            outcome = self.executive.visit(message.robot, message.x_m, message.y_m, now)
        elif isinstance(message, asks.PauseRequest):
            outcome = self.executive.pause(message.robot, now)
        elif isinstance(message, asks.ResumeRequest):
            outcome = self.executive.resume(message.robot, now)
        else:
            assert isinstance(message, asks.DriveRequest)
            outcome = self.executive.drive(
                message.robot, message.speed_m_s, message.turn_rate_rad_s, now
            )
        accepted, text, effects = outcome
        return [Send("fleet", name, asks.Answer(accepted=accepted, text=text)), *effects]

    # --- the end ------------------------------------------------------------------------------

    def _stop_request(self, name: str, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, asks.StopRequest)
        answer = Send("fleet", name, asks.Answer(accepted=True, text="the mission ends"))
        return [answer, *self._end(message.ended, f"asked for by {name}", now)]

    def _notice_end(self, now: float) -> list[Effect]:
        """End the mission when it is done, out of time, or out of robots."""
        if self._time_limit is not None and now >= self._time_limit - _EPSILON:
            return self._end("time_limit", f"{self._time_limit:g} s are over", now)
        if self.executive.exhausted(now):
            return self._looks.next(now) or self._end("explored", "nothing useful is left", now)
        if self.roster.present() or not self.roster.bodies:
            self._alone_since = None
        elif self._alone_since is None:
            self._alone_since = now
        elif now - self._alone_since >= self.settings.abandon_s:
            return self._end("failed", "all robots are lost", now)
        return []

    def _end(self, ended: Ended, reason: str, now: float) -> list[Effect]:
        """Tell the team that the mission is over; robots still send what they hold."""
        if self.ended is not None:
            return []
        self.ended, self.reason, self.ended_at = ended, reason, now
        self.merger.settle()
        end = words.MissionEnd(ended=ended, reason=reason)
        note = Note("info", f"mission over at {now:.1f} s: {ended}, {reason}")
        return [note, *self._tell(self.roster.audience(), end)]

    def _farewell(self) -> list[Effect]:
        """Leave, after the last words of the robots were heard."""
        assert self.ended is not None
        self.merger.reject_wrong()
        self.roster.finish()
        finished = Finished(ended=self.ended, reason=self.reason)
        return [Send("clock", "world", finished), Stop(self.ended)]

    def ended_and_gone(self, now: float) -> bool:
        """Whether the time for last words after the end is over."""
        return self.ended is not None and now > self.ended_at + self.settings.farewell_s

    # --- small things -------------------------------------------------------------------------

    @property
    def map_number(self) -> int:
        """Number of the map as published last."""
        return self._publisher.map.number

    def _tell(self, names: Sequence[str], message: Message) -> list[Effect]:
        return [Send("fleet", name, message) for name in names]

    def pose_of(self, name: str) -> tuple[float, float, float] | None:
        """Return a robot's last known pose in the map frame, or None."""
        return pose_of(self.merger, self.roster, name)
