"""When and what a robot tells the others of itself."""

from __future__ import annotations

from typing import Protocol

from coordination.task import Point
from mapping.geometry import Pose2
from protocol.messages import Heartbeat
from protocol.peer_messages import Beacon
from robot_agent.decentral.settings import PeerSettings

_EPSILON = 1e-9


class Standing(Protocol):
    """What a robot is at."""

    @property
    def busy(self) -> bool:
        """Whether it drives for a task."""
        ...

    @property
    def goal(self) -> Point | None:
        """Where that leads, (x, y) [m], map frame; None if it does not."""
        ...

    @property
    def idle(self) -> bool:
        """Whether it finds nothing that is worth a trip."""
        ...

    @property
    def through(self) -> bool:
        """Whether the mission is over for it."""
        ...


class Beaconing:
    """Tells where the robot is: often while it drives, seldom at rest, at once when it changes.

    Args:
        settings: how often, and how much of the path.
    """

    def __init__(self, settings: PeerSettings) -> None:
        self._settings = settings
        self._told: Beacon | None = None
        self._next = 0.0

    def due(
        self,
        heartbeat: Heartbeat,
        T_map_base: Pose2,
        standing: Standing,
        body: tuple[int, float, float],
        held: int,
        now: float,
    ) -> Beacon | None:
        """Return a beacon if it is time for one.

        Args:
            heartbeat: what the robot's software says of itself.
            T_map_base: where the robot is, map frame.
            standing: what it is at.
            body: which life of the robot this is, radius [m], one sigma of its place [m].
            held: checksum of what it holds.
            now: mission time [s].
        """
        life, radius, sigma = body
        beacon = Beacon(
            life=life,
            T_map_base=T_map_base,
            sigma_m=sigma,
            radius_m=radius,
            speed_m_s=round(heartbeat.speed_m_s, 2),
            busy=standing.busy,
            idle=standing.idle,
            through=standing.through,
            held=held,
            goal_map=standing.goal,
            path_map=heartbeat.path_map[: self._settings.beacon_points],
        )
        if now < self._next - _EPSILON and not self._news(beacon):
            return None
        moving = heartbeat.moving or beacon.busy
        settings = self._settings
        self._next = now + (settings.beacon_period_s if moving else settings.beacon_rest_s)
        self._told = beacon
        return beacon

    def _news(self, beacon: Beacon) -> bool:
        """Whether something that others wait for has changed."""
        told = self._told
        return told is None or differs(told, beacon)


def differs(told: Beacon, beacon: Beacon) -> bool:
    """Whether something that others decide by is not as it was told before."""
    before = (told.busy, told.idle, told.through, told.goal_map)
    return before != (beacon.busy, beacon.idle, beacon.through, beacon.goal_map)
