"""Where everybody is, as the server knows it, and which beams of a scan hit a teammate."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from mapping.geometry import Pose2
from mapping.scan import LaserScan


@dataclass(slots=True)
class Whereabouts:
    """One robot's last known place.

    Attributes:
        radius: of its body [m].
        T_odom_base: where it was in its own local map.
        stamp: when [s].
        speed: along its +x [m/s].
        path_map: (n, 2) [m] what it is about to drive, map frame.
        heard: whether it told its place at all yet.
        map_digest: of the map it holds, told when the mission is over.
    """

    radius: float
    T_odom_base: Pose2
    stamp: float = 0.0
    speed: float = 0.0
    path_map: npt.NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 2), np.float32))
    heard: bool = False
    map_digest: str = ""


@dataclass(frozen=True, slots=True)
class Disc:
    """A place where a robot may be: centre [m], map frame, and radius with all uncertainty [m]."""

    x: float
    y: float
    radius: float


def disc_of(
    whereabouts: Whereabouts, T_map_odom: Pose2, sigma: float, margin: float, stamp: float
) -> Disc:
    """Return where a robot may be at `stamp` [s].

    Args:
        whereabouts: its last word.
        T_map_odom: where its local map lies.
        sigma: uncertainty of its place in the team's map [m].
        margin: added all round [m].
        stamp: time of interest [s].
    """
    T_map_base = T_map_odom @ whereabouts.T_odom_base
    ahead = min(max(stamp - whereabouts.stamp, 0.0), 1.0) * whereabouts.speed
    x = T_map_base.x + ahead * math.cos(T_map_base.theta)
    y = T_map_base.y + ahead * math.sin(T_map_base.theta)
    radius = whereabouts.radius + margin + min(2.0 * sigma, 1.0) + 0.5 * abs(ahead)
    return Disc(x, y, radius)


def without_teammates(scan: LaserScan, T_map_base: Pose2, discs: Iterable[Disc]) -> LaserScan:
    """Return the scan with all beams ignored that end at a teammate.

    A robot is solid to the others' lasers, but it must never become a wall of the map.

    Args:
        scan: as measured.
        T_map_base: where it was taken, map frame, as well as known.
        discs: where teammates may be.
    """
    return scan.without_ends_in(((disc.x, disc.y, disc.radius) for disc in discs), T_map_base)
