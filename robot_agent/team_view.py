"""What a robot knows of where the others are, and which of its beams hit them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.disc_sighting import find_discs
from mapping.geometry import Floats, Pose2, pose_from
from mapping.scan import LaserScan
from protocol.body import Body
from protocol.messages import TeamPoses
from robot_agent.right_of_way import Teammate

_SPEED_ASSUMED = 0.5  # [m/s]; how fast a teammate may have gone since it was heard of
_AGE_MOST = 1.0  # [s]
_ROUNDING = 0.01  # [m]


@dataclass(slots=True)
class Teammates:
    """The other robots as the server last told.

    Attributes:
        own: this robot's name.
        others: the others, in the order of the server's message.
    """

    own: str
    others: tuple[Teammate, ...] = ()

    def hear(self, message: TeamPoses) -> None:
        """Take over what the server tells."""
        rows = len(message.robots)
        if not (
            rows == len(message.poses_map) == len(message.radii_m) == len(message.uncertainty_m)
            and rows == len(message.path_lengths) == len(message.busy)
            and sum(message.path_lengths) == len(message.paths_map)
        ):
            return
        others, start = [], 0
        for k, name in enumerate(message.robots):
            end = start + message.path_lengths[k]
            if name != self.own:
                stamp = float(message.poses_map[k, 0])
                others.append(
                    Teammate(
                        name=name,
                        T_map_base=pose_from(message.poses_map[k, 1:]),
                        stamp=stamp,
                        radius=float(message.radii_m[k]),
                        path_map=message.paths_map[start:end].astype(np.float64),
                        busy=message.busy[k],
                    )
                )
            start = end
        self.others = tuple(others)

    @property
    def places(self) -> Floats:
        """Where the others are, (k, 2) [m], map frame."""
        rows = [(mate.T_map_base.x, mate.T_map_base.y) for mate in self.others]
        return np.array(rows, dtype=np.float64).reshape(-1, 2)

    def find_in(self, sweep: LaserScan, body: Body) -> Floats:
        """Return where a sweep shows discs of a teammate's size, (k, 2) [m], base frame.

        As long as nobody was heard of, the others are taken to be built like this robot.
        """
        radii = sorted({mate.radius for mate in self.others} or {body.radius_m})
        return np.concatenate([find_discs(sweep, radius) for radius in radii])

    def mask(self, scan: LaserScan, T_map_base: Pose2, margin: float) -> LaserScan:
        """Return the scan with all beams ignored that end at a teammate.

        Args:
            scan: as measured.
            T_map_base: where it was taken, map frame.
            margin: around each teammate [m].
        """
        near = []
        for mate in self.others:
            age = min(max(scan.stamp - mate.stamp, 0.0), _AGE_MOST)
            reach = mate.radius + margin + (_SPEED_ASSUMED * age if mate.busy else 0.0)
            # No beam ends at a teammate that is out of the sensor's range.
            if mate.T_map_base.distance_to(T_map_base) <= _farthest(scan) + reach:
                near.append((mate.T_map_base.x, mate.T_map_base.y, reach))
        return scan.without_ends_in(near, T_map_base) if near else scan

    def nearest(self, T_map_base: Pose2) -> float:
        """Return the distance to the nearest other robot's centre [m], infinite without any."""
        return min(
            (mate.T_map_base.distance_to(T_map_base) for mate in self.others), default=math.inf
        )


def _farthest(scan: LaserScan) -> float:
    """Return the largest distance [m] from the base at which a beam of a scan can end."""
    return scan.range_max + math.hypot(scan.T_base_laser.x, scan.T_base_laser.y) + _ROUNDING
