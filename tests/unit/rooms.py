"""A small room to test cores in: its solid cells, and the scans a robot takes in it."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry import Pose2
from mapping.grid import GridGeometry
from mapping.scan import LaserScan
from protocol.codec import Header
from protocol.effects import Effect, Received, Send
from protocol.messages import Message
from sim_world.scene import GridScene

BEAMS = 60
START, STEP = -math.pi, 2.0 * math.pi / BEAMS
RANGE_MAX = 6.0


def room(resolution: float = 0.1) -> GridScene:
    """A room of 4 m by 3 m with a pillar that makes it lopsided; corner at (-1, -1)."""
    solid = np.zeros((round(3.0 / resolution), round(4.0 / resolution)), dtype=np.bool_)
    solid[[0, -1], :] = True
    solid[:, [0, -1]] = True
    a, b, c, d = (round(v / resolution) for v in (2.0, 2.6, 2.8, 3.4))
    solid[a:b, c:d] = True
    return GridScene(solid, GridGeometry(resolution, -1.0, -1.0, *solid.shape))


def scan_in(scene: GridScene, T_world_base: Pose2, stamp: float = 0.0) -> LaserScan:
    """What a robot sees all around, without noise."""
    bearings = START + STEP * np.arange(BEAMS)
    ranges = scene.cast(T_world_base, bearings, RANGE_MAX).astype(np.float32)
    return LaserScan(ranges, START, STEP, RANGE_MAX, stamp)


def heard(
    channel: str, source: str, message: Message, sequence: int = 1, to: str = "server"
) -> Received:
    """The event that a message arrived."""
    return Received(channel, Header(message.type, source, to, sequence, 0.0), message)


def sent(effects: list[Effect], to: str | None = None) -> list[Message]:
    """The messages among effects, those to one receiver if one is named."""
    return [
        effect.message
        for effect in effects
        if isinstance(effect, Send) and (to is None or effect.to == to)
    ]
