"""A robot that needs no server, its body in a small room, and what teammates say, for tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from coordination.strategies.minpos import MinPos
from mapping.geometry import IDENTITY, Pose2, wrap_angle
from mapping.observation_coding import Observation, encode_observation
from mapping.scan_coding import ScanCodingSettings
from mapping.shared_map import SharedMap
from mapping.team_map import TeamMap
from protocol.codec import Header
from protocol.effects import Effect, Received
from protocol.log.author_log import Author, Entry
from protocol.log.messages import observations
from protocol.log.observation_log import ObservationLog
from protocol.log.pose_coding import pose_steps
from protocol.log.sync import LogSync
from protocol.messages import Message
from protocol.world_messages import BodyFrame, Joined, MotionCommand
from robot_agent.agent import Agent
from robot_agent.decentral.peer import Peer
from robot_agent.decentral.settings import PeerSettings
from robot_agent.decentral.sharing import Sharing
from robot_agent.settings import RobotSettings
from tests.unit.robot_agent.test_agent import BODY, DT
from tests.unit.rooms import RANGE_MAX, heard, room, scan_in

ROOM = room()
CODING = ScanCodingSettings(error_bound_m=0.01)
TEAM = ("ann", "bob", "me")


def sync_of(name: str = "me", life: int = 0) -> LogSync:
    """One member's copy of the log, told in batches of a second whether anybody hears it or not."""
    settings = PeerSettings().log.model_copy(update={"batch_period_s": 1.0, "unheard_s": 0.0})
    return LogSync(ObservationLog(name, life), settings, np.random.default_rng(0), team=TEAM)


def sharing_of(sync: LogSync, reference: bool = True, **settings: Any) -> Sharing:
    shared = SharedMap(TeamMap[tuple[str, int]](0.1))
    return Sharing(sync, shared, PeerSettings.model_validate(settings), reference)


class Rig:
    """A peer whose body obeys at once, in a room that it sees without noise."""

    def __init__(
        self, life: int = 0, reference: bool = True, look_around: bool = False, **settings: Any
    ) -> None:
        values = {
            "look_around": look_around,
            "mapping": {"resolution_m": 0.1, "report_every": 1},
            "navigation": {"planning_map": {"resolution_m": 0.1}},
        }
        self.sharing = sharing_of(sync_of("me", life), reference, **settings)
        agent = Agent("me", RobotSettings.model_validate(values), life)
        given = PeerSettings.model_validate(settings)
        self.peer = Peer(agent, given, MinPos.from_settings({}), self.sharing, life)
        self.now = 0.0
        self.instant = 0
        self.T_world_base = IDENTITY
        self.command = (0.0, 0.0)
        self._sequence = 0

    def join(self, **fields: Any) -> list[Effect]:
        self.peer.tick(0.0)
        values = {"lockstep": True, "now_s": 0.0, "step_s": DT, "body": BODY, "start": IDENTITY}
        return self.world(Joined(**(values | fields)))

    def world(self, message: Message) -> list[Effect]:
        return self.peer.handle(heard("body", "world", message, to="me"), self.now)

    def radio(self, source: str, message: Message) -> list[Effect]:
        """A teammate's word, sent now."""
        self._sequence += 1
        header = Header(message.type, source, "*", self._sequence, self.now)
        return self.peer.handle(Received("radio", header, message), self.now)

    def live(self, seconds: float = DT) -> list[Effect]:
        """Some control periods, ticks included; a sweep at every other instant."""
        effects: list[Effect] = []
        for _ in range(round(seconds / DT)):
            self.instant += 1
            self.now = round(self.instant * DT, 6)
            speed, rate = self.command
            self.T_world_base = self.T_world_base @ Pose2(speed * DT, 0.0, wrap_angle(rate * DT))
            told = self.world(self.frame(self.instant % 2 == 1))
            deadline = self.peer.next_deadline()
            if deadline is not None and deadline <= self.now:
                told += self.peer.tick(self.now)
            for effect in told:
                message = getattr(effect, "message", None)
                if isinstance(message, MotionCommand):
                    self.command = (message.speed_m_s, message.turn_rate_rad_s)
            effects += told
        return effects

    def frame(self, sweep: bool) -> BodyFrame:
        lidar = BODY.lidar
        bearings = lidar.bearing_start + lidar.bearing_step * np.arange(lidar.beams)
        ranges = ROOM.cast(self.T_world_base, bearings, RANGE_MAX).astype(np.float32)
        return BodyFrame(
            stamp_s=self.now,
            T_wheel_base=self.T_world_base,
            bumped=False,
            ranges=ranges if sweep else np.zeros(0, dtype=np.float32),
        )


def seen_by(name: str, *poses: Pose2, first: int = 1, life: int = 0) -> Message:
    """What a teammate tells that it saw in the room from some places."""
    author = Author(name, life)
    told = []
    for number, pose in enumerate(poses, start=first):
        seen = Observation(scan_in(ROOM, pose, float(number)), np.zeros((0, 2)))
        told.append((number, Entry(encode_observation(seen, CODING), pose_steps(pose), 0)))
    return observations(author, told, name, 0)
