"""The world: plays bodies, sensors and links of a simulated team, and keeps the truth to itself.

A core like the others (see `protocol.effects`): commands and radio frames in, body frames and
forwarded frames out, one physics step a tick. Mission time is its own: instants of `step_s`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.geometry import IDENTITY
from protocol.codec import decode
from protocol.effects import (
    Effect,
    Event,
    Note,
    Passing,
    PassOn,
    PeerLeft,
    Received,
    Rejected,
    Send,
    Stop,
    Strike,
)
from protocol.errors import ProtocolError
from protocol.fault_book import FaultBook
from protocol.messages import SERVER, Ended, Hello, MapRequest, Message
from protocol.operator_messages import StopRequest
from protocol.world_messages import Finished, Join, Joined, MotionCommand, Through
from sim_world import kinematics
from sim_world.agreement import Agreement
from sim_world.body_sensing import sense, sense_and_sweep
from sim_world.fault_script import outages, schedule
from sim_world.judge import Judge
from sim_world.radio.relay import build_relay
from sim_world.radio.shadowing import Place
from sim_world.robot_body import RobotSpec, robot_body
from sim_world.scene import Scene
from sim_world.settings import WorldSettings
from sim_world.victims import Victim, places_of
from sim_world.witnesses import Witnesses

_EPSILON = 1e-9
_GRACE_S = 30.0  # how long after the time limit the server may still tidy up


class World:
    """The core of the world process.

    Args:
        scene: what is solid.
        robots: the team's bodies.
        settings: time, starts, links, faults.
        judge: measures the server's map.
        rng: source of all noise.
        lockstep: whether mission time waits for the processes.
        time_limit: mission time at which the mission must be over [s]; None for never.
        leaderless: the team has no server: the world asks the robots for their map.
        agreeing: the robots decide for themselves: the mission is over when all of them, and the
            server that listens if there is one, say so and hold the same.
        victims: who lies in the building.
    """

    def __init__(
        self,
        scene: Scene,
        robots: Sequence[RobotSpec],
        settings: WorldSettings,
        judge: Judge,
        rng: np.random.Generator,
        lockstep: bool = True,
        time_limit: float | None = None,
        leaderless: bool = False,
        agreeing: bool = False,
        victims: Sequence[Victim] = (),
    ) -> None:
        self._witnesses = Witnesses(judge) if leaderless else None
        self._agreement = Agreement(settings.parted_s) if agreeing else None
        self._scene = scene
        self._settings = settings
        self._lockstep = lockstep
        self._time_limit = time_limit
        self._victims_world = places_of(victims)
        self.judge = judge
        streams = rng.spawn(len(robots) + 2)
        radio_rng = streams.pop()
        self._motion_rng = streams[0]
        self.robots = {
            spec.name: robot_body(spec, stream)
            for spec, stream in zip(robots, streams[1:], strict=True)
        }
        self._dropped = FaultBook()
        cuts = outages(settings.faults)
        self.relay = build_relay(self.robots, settings.radio, scene, radio_rng, cuts)
        self._antenna = settings.radio.antenna(robots[0].T_world_start)
        self._faults = schedule(settings.faults)
        self._next_tick = 0.0
        self._next_judging = 0.0
        self._now = 0.0
        self._observing = False
        self._stop_sent = False
        self.finished: Finished | None = None

    def next_deadline(self) -> float | None:
        """Every instant is the world's."""
        return self._next_tick

    def handle(self, event: Event, now: float) -> list[Effect]:
        """Take commands, joins and passing frames."""
        if isinstance(event, Passing):
            return self._pass_on(event, now)
        if isinstance(event, PeerLeft):
            return self._left(event.peer)
        if isinstance(event, Rejected):
            return list(self._dropped.enter("a frame", event.source, event.reason))
        return self._received(event, now)

    def tick(self, now: float) -> list[Effect]:
        """Let time pass up to `now`: move bodies, sweep lasers, strike faults, judge."""
        effects: list[Effect] = []
        if not self._observing and now > 0.0 and self._witnesses is None:
            effects.append(Send("uplink", SERVER, Hello(role="observer")))
        self._move(now)
        self.relay.advance(now, self._places())
        strikes = self._strike(now)
        effects += [*strikes, *self._deliver(now)]
        for strike in strikes:  # whoever starts anew misses this instant, and hears the next one
            if isinstance(strike, Strike) and strike.kind in ("restart", "reboot"):
                self.relay.switch_on(strike.peer)
        effects += self._sense(now)
        effects += self._judge(now)
        effects += self._agree(now)
        self._next_tick = now + 0.5 * self._settings.step_s
        if self._time_limit is not None and now > self._time_limit + self._grace:
            effects += self._end("time_limit", f"{self._time_limit:g} s are over")
        return effects

    @property
    def _grace(self) -> float:
        """How long after the time limit the mission may still go on [s]."""
        return _GRACE_S if self._witnesses is None else -_EPSILON

    def _agree(self, now: float) -> list[Effect]:
        """End the mission when all who are there say that it is over."""
        if self._agreement is None:
            return []
        present = [name for name, robot in self.robots.items() if robot.connected]
        if self._witnesses is None:
            present.append(SERVER)
        reason = self._agreement.over(present, now)
        return self._end("explored", reason) if reason else []

    def _end(self, ended: Ended, reason: str) -> list[Effect]:
        """End the mission."""
        if self.finished is None:
            self.finished = Finished(ended=ended, reason=reason)
        return [Stop(ended)]

    @property
    def now(self) -> float:
        """Mission time up to which the world has moved [s]."""
        return self._now

    # --- messages ---------------------------------------------------------------------------

    def _received(self, event: Received, now: float) -> list[Effect]:
        message, source = event.message, event.header.source
        if isinstance(message, Join):
            self.relay.switch_on(source)
            return [Send(event.channel, source, self._joined(source, now))]
        if isinstance(message, MotionCommand) and source in self.robots:
            robot = self.robots[source]
            robot.command = (message.speed_m_s, message.turn_rate_rad_s)
            robot.command_stamp = now
        elif isinstance(message, Finished) and source == SERVER:
            return self._end(message.ended, message.reason)
        elif isinstance(message, Through) and self._agreement is not None:
            self._agreement.hear(source, message)
        elif self._witnesses is not None and source in self.robots:
            return self._hear_witness(source, message)
        return []

    def _hear_witness(self, name: str, message: Message) -> list[Effect]:
        """Take a robot's word on the map."""
        assert self._witnesses is not None
        truth = {name: robot.motion.T_world_base for name, robot in self.robots.items()}
        try:
            self._witnesses.hear(name, message, truth, self._now)
        except ValueError as error:
            return list(self._dropped.enter("a word to the judge", name, str(error)))
        return []

    def _joined(self, name: str, now: float) -> Joined:
        """Switch a robot's body on, or greet the server."""
        common = {"lockstep": self._lockstep, "now_s": now, "step_s": self._settings.step_s}
        robot = self.robots.get(name)
        if robot is None:
            return Joined(**common)
        robot.connected = True
        robot.T_wheel_base = IDENTITY
        robot.next_sweep = now
        perturbed = self._settings.perturb_starts
        return Joined(
            **common,
            body=robot.spec.body,
            start=robot.spec.T_map_start,
            start_sigma_m=self._settings.start_error_m if perturbed else 0.0,
            start_sigma_deg=self._settings.start_error_deg if perturbed else 0.0,
        )

    def _left(self, peer: str) -> list[Effect]:
        """A process is gone: its body stays where it is; without a server nothing can go on."""
        if peer in self.robots:
            self.relay.switch_off(peer)
            self.robots[peer].connected = False
            self.robots[peer].command = (0.0, 0.0)
            return [Note("warning", f"the process of {peer} is gone; its body stands still")]
        if peer == SERVER and self.finished is None:
            return [Note("error", "the server is gone"), Stop("failed")]
        return []

    def _pass_on(self, event: Passing, now: float) -> list[Effect]:
        """Relay a frame of the radio, or hear one that the server sends to the judge."""
        header = event.header
        if (event.channel == "uplink") != (header.source == SERVER):
            # The host sees to it that each speaks under its own name; here, by its own link.
            reason = f"the {event.channel} is not its own link"
            return list(self._dropped.enter("a frame", header.source, reason))
        if event.channel == "uplink" and header.to == "world":
            return self._hear(event)
        self.relay.carry(header.source, header, event.frame, now)
        return self._deliver(now) if self.relay.at_once else []

    def _deliver(self, now: float) -> list[Effect]:
        """Hand over what arrives by radio."""
        return [
            PassOn("uplink" if receiver == SERVER else "radio", receiver, frame)
            for receiver, frame in self.relay.due(now)
        ]

    def _places(self) -> dict[str, Place]:
        """Return where the antennas of all robots and the server are, (x, y) [m], world frame."""
        poses = ((name, robot.motion.T_world_base) for name, robot in self.robots.items())
        return {SERVER: self._antenna, **{name: (pose.x, pose.y) for name, pose in poses}}

    def _hear(self, event: Passing) -> list[Effect]:
        """The judge hears what the server publishes."""
        self._observing = True
        truth = {name: robot.motion.T_world_base for name, robot in self.robots.items()}
        try:
            _, message = decode(event.frame)
            heard = self.judge.hear(message, truth, self._now)
        except (ProtocolError, ValueError) as error:
            return list(self._dropped.enter("a word to the judge", SERVER, str(error)))
        if heard:
            return []
        return [Send("uplink", SERVER, MapRequest(have=self.judge.number))]

    # --- physics ----------------------------------------------------------------------------

    def _move(self, now: float) -> None:
        """Drive all bodies from the last instant to `now`."""
        dt, self._now = now - self._now, now
        if dt <= 0.0:
            return
        robots = list(self.robots.values())
        for robot in robots:
            if now - robot.command_stamp > self._settings.command_timeout_s:
                robot.command = (0.0, 0.0)
        steps = kinematics.step_bodies(
            [robot.motion for robot in robots],
            [robot.command for robot in robots],
            dt,
            self._scene,
            [robot.limits for robot in robots],
            self._motion_rng,
        )
        for robot, step in zip(robots, steps, strict=True):
            robot.motion = step.motion
            robot.T_wheel_base = robot.T_wheel_base @ step.T_before_after
            robot.bumped = step.bumped
            robot.bumps += step.bumped
            robot.path += step.travelled

    def _sense(self, now: float) -> list[Effect]:
        """Return the body frames of all robots whose software is there."""
        effects: list[Effect] = []
        for name, robot in self.robots.items():
            sweep = now >= robot.next_sweep - _EPSILON
            if sweep:
                robot.next_sweep = now + robot.spec.body.lidar.period_s
                T_world_base = robot.motion.T_world_base
                robot.track.append((now, T_world_base.x, T_world_base.y, T_world_base.theta))
            if robot.connected:
                team, victims = self.robots.values(), self._victims_world
                frame = (
                    sense_and_sweep(robot, now, self._scene, team, victims)
                    if sweep
                    else sense(robot, now)
                )
                effects.append(Send("body", name, frame))
        return effects

    # --- faults and judging -----------------------------------------------------------------

    def _strike(self, now: float) -> list[Effect]:
        """Let the scripted faults that are due strike."""
        effects: list[Effect] = []
        while self._faults and self._faults[0][0] <= now + _EPSILON:
            _, name, kind = self._faults.pop(0)
            effects.append(Note("info", f"scripted fault at {now:.1f} s: {kind} {name}"))
            if kind in ("kill", "restart", "reboot"):
                self.robots[name].connected = False
                if self._agreement is not None:
                    self._agreement.forget(name)
                self.relay.switch_off(name)
            effects.append(Strike(name, kind))
        return effects

    def _judge(self, now: float) -> list[Effect]:
        """Measure the coverage when it is time; end the mission when it is enough."""
        if now < self._next_judging - _EPSILON:
            return []
        self._next_judging = now + self._settings.judge_period_s
        covered = self.judge.measure(now)
        wanted = self._settings.stop_at_coverage
        enough = wanted is not None and covered >= wanted
        if self._witnesses is not None:
            if enough:
                return self._end("coverage", f"coverage {covered:.3f}")
            return self._witnesses.ask([n for n, robot in self.robots.items() if robot.connected])
        if not enough or self._stop_sent:
            return []
        self._stop_sent = True
        return [Send("uplink", SERVER, StopRequest(ended="coverage"))]
