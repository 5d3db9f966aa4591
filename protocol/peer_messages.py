"""What members of a team without a master tell each other besides their logs."""

from __future__ import annotations

from typing import Literal

from protocol.fields import Count, Finite, NotNegative, Points, PoseField, Positive
from protocol.messages import Message


class Beacon(Message):
    """Here I am: broadcast all the time, so that others keep clear and know what is left to do.

    `path_map` (n, 2) [m] is what the robot is about to drive, nearest first. `busy`: it drives for
    a task; `through`: it finds nothing more that is worth a trip, and all that it knows of hold
    what it holds. `held` is a checksum of all observations and poses that it holds.
    """

    type: Literal["beacon"] = "beacon"
    life: Count
    T_map_base: PoseField
    sigma_m: NotNegative
    radius_m: Positive
    speed_m_s: Finite = 0.0
    busy: bool = False
    idle: bool = False
    through: bool = False
    held: Count = 0
    path_map: Points
