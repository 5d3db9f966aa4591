"""The master: one core that merges maps, gives out tasks and answers operators.

It owns a `MapMerger` and a `TaskExecutive` and carries words between them and the team. All its
state changes through `handle` and `tick`; it has no clock, no socket and no file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from coordination.strategy import Strategy
from coordination.task import Point
from coordination.waiting_place import IdleRobot, waiting_places
from mapping.distance_field import truncated_distance
from mapping.geometry import IDENTITY, Floats, pose_from
from mapping.grid import CLEAR, OBSTACLE, classify
from mapping.path_planning import traversal_weights
from mapping.scan import LaserScan
from protocol import messages as words
from protocol.body import Body
from protocol.effects import Effect, Event, Note, Received, Rejected, Send, Stop
from protocol.map_cells import pack_cells
from protocol.messages import Message
from protocol.session import Session
from protocol.world_messages import Finished, Join
from server.bids import BidError, robot_bid
from server.map_merger import MapMerger, Report
from server.placing import motion_of
from server.settings import ServerSettings
from server.task_executive import TaskExecutive
from server.teammates import Disc, Whereabouts, disc_of, without_teammates

Ended = Literal["explored", "time_limit", "coverage", "operator", "failed"]
_EPSILON = 1e-9
_REJECTED_KINDS = 100  # a hostile peer invents a new fault with every frame; books stay small
_CLEARANCE_LIMIT = 1.0  # [m]; more room than this to wait in makes no difference


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
        self.merger = MapMerger(settings.merger)
        self.executive = TaskExecutive(settings.executive, strategy, self._waiting_places)
        self.strategy_name = strategy_name
        self.robots = tuple(robots)
        self.map_number = 0
        self.ended: Ended | None = None
        self.reason = ""
        self.ended_at = 0.0
        self.now = 0.0
        self.states: dict[str, str] = dict.fromkeys(robots, "never seen")
        self.rejected: dict[tuple[str, str], int] = {}
        self._time_limit = time_limit
        self._sessions: dict[str, Session] = {}
        self._bodies: dict[str, Body] = {}
        self._where: dict[str, Whereabouts] = {}
        self._received: dict[str, int] = {}
        self._observers: list[str] = []
        self._next_delta = 0.0
        self._next_poses = 0.0
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
            words.VisitRequest: self._operator,
            words.PauseRequest: self._operator,
            words.ResumeRequest: self._operator,
            words.DriveRequest: self._operator,
            words.StopRequest: self._stop_request,
        }

    # --- the core's three methods -----------------------------------------------------------

    def next_deadline(self) -> float | None:
        """Return when something is due next [s]."""
        due = [self._next_delta, self._next_poses]
        for deadline in (self.executive.next_deadline(), *self._silences()):
            if deadline is not None:
                due.append(deadline)
        return min(due)

    def handle(self, event: Event, now: float) -> list[Effect]:
        """Take a message or the news that a peer is gone."""
        if isinstance(event, Rejected):
            return self._reject(event)
        if not isinstance(event, Received) or event.channel != "fleet":
            return []
        answer = self._answers.get(type(event.message))
        name = event.header.source
        if answer is None:
            return []
        if not isinstance(event.message, words.Hello):
            session = self._sessions.get(name)
            if session is None or not session.accept(event.header, now):
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
            effects += self._notice_end(now)
        elif now >= self.ended_at + self.settings.farewell_s - _EPSILON:
            return [*effects, *self._farewell()]
        if now >= self._next_delta - _EPSILON:
            self._next_delta = now + self.settings.map.delta_period_s
            effects += self._publish_changes(now)
        if now >= self._next_poses - _EPSILON:
            self._next_poses = now + self.settings.map.poses_period_s
            effects += self._publish_poses()
        return effects

    # --- joining and leaving ------------------------------------------------------------------

    def _hello(self, name: str, message: Message, now: float) -> list[Effect]:
        """Take a peer in; a robot with a new incarnation starts with an empty local map."""
        assert isinstance(message, words.Hello)
        if message.role == "robot" and name not in self.robots:
            known = ", ".join(self.robots)
            reason = f"no robot named {name!r} in this team; its robots are {known}"
            return [Send("fleet", name, words.Refused(reason=reason))]
        if message.role != "robot" and name in self.robots:
            return [Send("fleet", name, words.Refused(reason=f"{name!r} is a robot's name"))]
        silence = self.settings.silence_s if message.role == "robot" else math.inf
        session = self._sessions.setdefault(name, Session(name, silence))
        fresh = session.hello(message.incarnation, now)
        effects: list[Effect] = [
            Send("fleet", name, words.Welcome(now_s=now, strategy=self.strategy_name))
        ]
        if message.role == "robot":
            effects += self._robot_hello(name, message, fresh, now)
        elif message.role == "observer" and name not in self._observers:
            self._observers.append(name)
        if self.map_number > 0 and message.role != "operator":
            effects.append(Send("fleet", name, self._snapshot()))
        return effects

    def _robot_hello(self, name: str, hello: words.Hello, fresh: bool, now: float) -> list[Effect]:
        """Enter a robot in the map merger and the pool."""
        if not fresh:
            return []
        body = hello.body or Body()
        again = name in self._bodies
        self._bodies[name] = body
        sigma, turn = hello.start_sigma_m, math.radians(hello.start_sigma_deg)
        self.merger.add(name, hello.start or IDENTITY, sigma, turn, motion_of(body.drive))
        self._where[name] = Whereabouts(body.radius_m, IDENTITY, now)
        self._received[name] = 0
        self.states[name] = "at work"
        note = Note("info", f"{name} is {'back' if again else 'here'}")
        return [note, *self.executive.robot_joined(name, body, now)]

    def _silences(self) -> list[float | None]:
        return [self._sessions[n].deadline for n in self.robots if n in self._sessions]

    def _find_silent(self, now: float) -> list[Effect]:
        """Take robots out of the pool that were not heard of for too long."""
        effects: list[Effect] = []
        for name in self.robots:
            session = self._sessions.get(name)
            if session is not None and session.check(now):
                self.states[name] = f"lost at {now:.1f} s"
                effects.append(Note("warning", f"{name} is silent; its task is free for others"))
                effects += self.executive.robot_lost(name, now)
                effects += self._tell(self._observers, words.RobotLost(robot=name, state="lost"))
        return effects

    def _recovered(self, name: str, now: float) -> list[Effect]:
        """Take a robot back in that was silent and speaks again."""
        if not self.states.get(name, "").startswith("lost"):
            return []
        self.states[name] = "at work"
        back = words.RobotLost(robot=name, state="back")
        return [
            Note("info", f"{name} speaks again"),
            *self.executive.robot_back(name, now),
            *self._tell(self._observers, back),
        ]

    def _reject(self, event: Rejected) -> list[Effect]:
        """Count what was no valid message; name a peer's fault once."""
        key = (event.source, event.reason.split(":")[0])
        if key not in self.rejected and len(self.rejected) >= _REJECTED_KINDS:
            key = ("others", "more kinds of faults than are told apart")
        self.rejected[key] = self.rejected.get(key, 0) + 1
        if self.rejected[key] > 1:
            return []
        return [Note("warning", f"dropped a frame of {event.source}: {event.reason}")]

    # --- mapping ------------------------------------------------------------------------------

    def _heartbeat(self, name: str, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.Heartbeat)
        where = self._where.get(name)
        if where is None:
            return []
        where.T_odom_base, where.speed = message.T_odom_base, message.speed_m_s
        where.stamp, where.path_map, where.heard = now, message.path_map, True
        return list(self.executive.contact(name, now))

    def _report(self, name: str, message: Message, now: float) -> list[Effect]:
        """Place a scan in the team's map, in the order of the robot's numbers."""
        assert isinstance(message, words.ScanReport)
        if name not in self._received or self.ended_and_gone(now):
            return []
        if message.number != self._received[name] + 1:
            have = words.ReportsReceived(number=self._received[name])
            return [Send("fleet", name, have)]
        self._received[name] = message.number
        member = self.merger.members[name]
        scan = LaserScan(
            message.ranges,
            message.bearing_start_rad,
            message.bearing_step_rad,
            message.range_max_m,
            message.stamp_s,
            message.T_base_laser,
        )
        guess = member.T_map_odom @ message.T_odom_base
        scan = without_teammates(scan, guess, self._discs(name, message.stamp_s))
        report = Report(
            scan,
            message.T_odom_base,
            message.covariance,
            message.track_odom,
            message.T_wheel_base,
            message.sightings_odom.astype(np.float64),
        )
        placement = self.merger.place(name, report)
        update = words.PoseUpdate(
            number=message.number,
            T_map_odom=member.T_map_odom,
            uncertainty_m=self.merger.uncertainty(name),
            matched=placement.matched,
        )
        received = words.ReportsReceived(number=message.number)
        effects: list[Effect] = [Send("fleet", name, received), Send("fleet", name, update)]
        return effects + (self._tell_moved(name) if placement.redrawn else [])

    def _tell_moved(self, reporter: str) -> list[Effect]:
        """Tell all other robots where their local maps lie now that the map was put right."""
        return [
            Send(
                "fleet",
                name,
                words.PoseUpdate(
                    number=self._received[name],
                    T_map_odom=self.merger.members[name].T_map_odom,
                    uncertainty_m=self.merger.uncertainty(name),
                    matched=True,
                ),
            )
            for name in self._present()
            if name != reporter and self.merger.members[name].aligned
        ]

    def _discs(self, observer: str, stamp: float) -> list[Disc]:
        """Return where all robots but one may be."""
        return [
            disc_of(
                where,
                self.merger.members[name].T_map_odom,
                self.merger.uncertainty(name),
                self.settings.map.teammate_margin_m,
                stamp,
            )
            for name, where in self._where.items()
            if name != observer
        ]

    def _map_request(self, name: str, message: Message, now: float) -> list[Effect]:
        return [Send("fleet", name, self._snapshot())] if self.map_number else []

    def _snapshot(self) -> words.MapSnapshot:
        """Return the whole map as published so far and the changes since."""
        geometry = self.merger.geometry
        return words.MapSnapshot(
            number=self.map_number,
            resolution_m=geometry.resolution,
            origin_x_m=geometry.origin_x,
            origin_y_m=geometry.origin_y,
            rows=geometry.rows,
            cols=geometry.cols,
            cells=pack_cells(self.merger.log_odds),
        )

    def _publish_changes(self, now: float) -> list[Effect]:
        """Send everybody the rectangle of the map that changed."""
        if self.merger.dirty.empty:
            return []
        box, log_odds = self.merger.take_changes()
        self.map_number += 1
        delta = words.MapDelta(
            number=self.map_number,
            resolution_m=self.merger.geometry.resolution,
            lattice_x=box.ix0,
            lattice_y=box.iy0,
            rows=box.iy1 - box.iy0,
            cols=box.ix1 - box.ix0,
            cells=pack_cells(log_odds),
        )
        self.executive.map_changed(self.map_number, now)
        return self._tell([*self._present(), *self._observers], delta)

    def _publish_poses(self) -> list[Effect]:
        """Tell the team and observers where everybody is."""
        names = [name for name in self._where if self._where[name].heard]
        if not names:
            return []
        rows, paths = [], []
        for name in names:
            where = self._where[name]
            T_map_base = self.merger.members[name].T_map_odom @ where.T_odom_base
            rows.append([where.stamp, T_map_base.x, T_map_base.y, T_map_base.theta])
            paths.append(where.path_map)
        poses = words.TeamPoses(
            robots=tuple(names),
            poses_map=np.array(rows, dtype=np.float64).reshape(-1, 4),
            radii_m=np.array([self._where[n].radius for n in names], dtype=np.float32),
            uncertainty_m=np.array([self.merger.uncertainty(n) for n in names], dtype=np.float32),
            paths_map=np.concatenate(paths).astype(np.float32).reshape(-1, 2),
            path_lengths=tuple(len(path) for path in paths),
            busy=tuple(self.executive.busy(name) for name in names),
        )
        return self._tell([*self._present(), *self._observers], poses)

    # --- tasks --------------------------------------------------------------------------------

    def _bid(self, name: str, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.Bid)
        if name not in self._bodies:
            return []
        try:
            weight = self.settings.cost_weights.get(name, 1.0)
            bid = robot_bid(name, message, self._bodies[name], weight)
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

    def _operator(self, name: str, message: Message, now: float) -> list[Effect]:
        """Carry out an operator's word and answer it."""
        if isinstance(message, words.VisitRequest):
            outcome = self.executive.visit(message.robot, message.x_m, message.y_m, now)
        elif isinstance(message, words.PauseRequest):
            outcome = self.executive.pause(message.robot, now)
        elif isinstance(message, words.ResumeRequest):
            outcome = self.executive.resume(message.robot, now)
        else:
            assert isinstance(message, words.DriveRequest)
            outcome = self.executive.drive(
                message.robot, message.speed_m_s, message.turn_rate_rad_s, now
            )
        accepted, text, effects = outcome
        return [Send("fleet", name, words.Answer(accepted=accepted, text=text)), *effects]

    def _waiting_places(
        self, idle: tuple[IdleRobot, ...], places: Floats, gains: Floats
    ) -> dict[str, Point]:
        """Return where idle robots wait best on the map as it is, out of everybody's way."""
        if not self.merger.nodes or not len(places):
            return {}
        settings = self.settings.map
        classes = classify(self.merger.log_odds, settings.p_obstacle, settings.p_clear)
        geometry = self.merger.geometry
        radius = max(self._bodies[robot.robot].radius_m for robot in idle)
        clearance = truncated_distance(classes == OBSTACLE, geometry.resolution, _CLEARANCE_LIMIT)
        weights = traversal_weights(classes == CLEAR, clearance, radius, radius + 0.3)
        waiting = {robot.robot for robot in idle}
        taken = [where.path_map for name, where in self._where.items() if name not in waiting]
        taken += [
            np.array([pose[:2]])
            for name in self._where
            if name not in waiting and (pose := self.pose_of(name)) is not None
        ]
        occupied = np.concatenate([np.zeros((0, 2)), *taken])
        return waiting_places(weights, clearance, geometry, idle, places, gains, occupied)

    # --- the end ------------------------------------------------------------------------------

    def _stop_request(self, name: str, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.StopRequest)
        answer = Send("fleet", name, words.Answer(accepted=True, text="the mission ends"))
        return [answer, *self._end(message.ended, f"asked for by {name}", now)]

    def _notice_end(self, now: float) -> list[Effect]:
        """End the mission when it is done, out of time, or out of robots."""
        if self._time_limit is not None and now >= self._time_limit - _EPSILON:
            return self._end("time_limit", f"{self._time_limit:g} s are over", now)
        if self.executive.exhausted(now):
            return self._end("explored", "nothing useful is left", now)
        if self._present() or not self._bodies:
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
        return [note, *self._tell([*self._present(), *self._observers], end)]

    def _farewell(self) -> list[Effect]:
        """Leave, after the last words of the robots were heard."""
        assert self.ended is not None
        for name, state in self.states.items():
            if state == "at work":
                self.states[name] = "finished"
        finished = Finished(ended=self.ended, reason=self.reason)
        return [Send("clock", "world", finished), Stop(self.ended)]

    def ended_and_gone(self, now: float) -> bool:
        """Whether the time for last words after the end is over."""
        return self.ended is not None and now > self.ended_at + self.settings.farewell_s

    # --- small things -------------------------------------------------------------------------

    def _present(self) -> list[str]:
        """Return the robots in contact, in the team's order."""
        return [
            name
            for name in self.robots
            if name in self._sessions and self._sessions[name].state == "open"
        ]

    def _tell(self, names: Sequence[str], message: Message) -> list[Effect]:
        return [Send("fleet", name, message) for name in names]

    def pose_of(self, name: str) -> tuple[float, float, float] | None:
        """Return a robot's last known pose in the map frame, or None."""
        where = self._where.get(name)
        if where is None:
            return None
        T_map_base = self.merger.members[name].T_map_odom @ where.T_odom_base
        return T_map_base.x, T_map_base.y, pose_from(T_map_base.as_array()).theta
