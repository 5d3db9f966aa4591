"""A master, its clock and its peers, for the tests of the server's parts."""

from __future__ import annotations

from typing import Any

import numpy as np

from coordination.strategies.nearest import Nearest
from mapping.geometry import IDENTITY, Pose2
from protocol import messages as words
from protocol.body import Body
from protocol.effects import Effect, Note
from protocol.messages import Message
from server.master import Master
from server.settings import MergerSettings, ServerSettings
from tests.unit.rooms import heard, room, scan_in, sent

ROOM = room()
ROBOTS = ("robot1", "robot2")
POSES = ServerSettings().map.poses_period_s


class Rig:
    """A master, its clock, and the frame counters of its peers."""

    def __init__(self, time_limit: float | None = None, **settings: Any) -> None:
        given = ServerSettings(merger=MergerSettings(resolution_m=0.1), **settings)
        self.master = Master(given, Nearest.from_settings({}), "nearest", ROBOTS, time_limit)
        self.now = 0.0
        self.sequences: dict[str, int] = {}

    def says(self, name: str, message: Message) -> list[Effect]:
        """A peer says something, in the order of its numbers."""
        self.sequences[name] = self.sequences.get(name, 0) + 1
        return self.master.handle(heard("fleet", name, message, self.sequences[name]), self.now)

    def tick(self, seconds: float = 0.1) -> list[Effect]:
        """Time passes, then the master wakes."""
        self.now = round(self.now + seconds, 6)
        effects = self.master.tick(self.now)
        self.master.executive.check_invariants()
        return effects

    def hello(self, name: str, role: str = "robot", **fields: Any) -> list[Effect]:
        return self.says(name, words.Hello.model_validate({"role": role, **fields}))

    def beat(self, name: str, T_odom_base: Pose2 = IDENTITY, speed: float = 0.0) -> list[Effect]:
        path = np.array([[1.0, 0.0]], dtype=np.float32)
        beat = words.Heartbeat(T_odom_base=T_odom_base, speed_m_s=speed, path_map=path)
        return self.says(name, beat)

    def report(self, name: str, number: int, T_world_base: Pose2 = IDENTITY) -> list[Effect]:
        return self.says(name, report(number, T_world_base, self.now))

    def bid(self, name: str, number: int, x: float = 1.0, gain: float = 20.0) -> list[Effect]:
        return self.says(name, bid(number, self.master.map_number, x, gain))


def report(number: int, T_world_base: Pose2, stamp: float) -> words.ScanReport:
    scan = scan_in(ROOM, T_world_base, stamp)
    return words.ScanReport(
        number=number,
        stamp_s=stamp,
        ranges=scan.ranges,
        bearing_start_rad=scan.bearing_start,
        bearing_step_rad=scan.bearing_step,
        range_max_m=scan.range_max,
        T_base_laser=IDENTITY,
        T_odom_base=T_world_base,
        covariance=np.diag([1e-4, 1e-4, 1e-5]),
        track_odom=np.array([[stamp, T_world_base.x, T_world_base.y, T_world_base.theta]]),
    )


def bid(number: int, map_number: int, x: float, gain: float, places: int = 1) -> words.Bid:
    return words.Bid(
        number=number,
        map_number=map_number,
        T_map_base=IDENTITY,
        places_map=np.full((places, 2), (x, 0.0), dtype=np.float32),
        gains=np.array([gain], dtype=np.float32),
        costs_m=np.array([x], dtype=np.float32),
        rectangles_map=np.array([[x - 1.0, -1.0, x + 1.0, 1.0]], dtype=np.float32),
        unreachable_map=np.zeros((0, 2), dtype=np.float32),
    )


def begun() -> Rig:
    """Return a team of which `robot1` is there, with a map of one scan."""
    made = Rig()
    made.tick(0.0)
    made.hello("robot1", body=Body(radius_m=0.2).model_dump(), start=[0.0, 0.0, 0.0])
    made.beat("robot1")
    made.report("robot1", 1)
    made.tick(0.6)
    return made


def notes(effects: list[Effect]) -> str:
    return " | ".join(effect.text for effect in effects if isinstance(effect, Note))


def of_type(effects: list[Effect], kind: type[Message], to: str | None = None) -> list[Any]:
    return [message for message in sent(effects, to) if isinstance(message, kind)]
