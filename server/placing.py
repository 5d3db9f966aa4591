"""What the central mapper keeps of robots and of their scans."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from mapping.geometry import Floats, Pose2
from mapping.motion_model import MotionModel
from mapping.scan import LaserScan
from mapping.way import Report, corrected_track
from protocol.body import Drive


@dataclass(frozen=True, slots=True)
class Node:
    """A scan in the team's map: a vertex of the pose graph.

    Attributes:
        robot: who took it.
        scan: the scan.
        T_map_base: where.
        T_odom_base: where by the robot's own estimate, in its local map.
        life: which life of the robot's process, from 0; each has a local map of its own.
        track_odom: (n, 4) stamp, x, y, theta since the node before, odom frame.
    """

    robot: str
    scan: LaserScan
    T_map_base: Pose2
    T_odom_base: Pose2
    life: int = 0
    track_odom: Floats = field(default_factory=lambda: np.zeros((0, 4)))

    @property
    def T_map_odom(self) -> Pose2:  # noqa: N802
        """Where the robot's local map lay in the team's by this scan."""
        return self.T_map_base @ self.T_odom_base.inverse()


@dataclass(slots=True)
class Member:
    """What the merger knows of one robot.

    Attributes:
        T_map_odom: where its local map lies in the team's.
        covariance: (3, 3) of the robot's pose in the team's map, map frame.
        told: largest errors of the start it was told [m], [rad].
        motion: how wrong its wheels are.
        aligned: whether a scan of it was ever matched (or defined the frame).
        held: reports that wait for the alignment.
        last: the report that was placed last.
        untold: tracks of reports since then, which contradicted the map.
        unmatched: reports in a row that contradicted the map.
        placed: reports placed so far.
        life: which life of the robot's process this is, from 0.
    """

    T_map_odom: Pose2
    covariance: Floats
    told: tuple[float, float] = (0.0, 0.0)
    motion: MotionModel = field(default_factory=MotionModel)
    aligned: bool = False
    held: list[Report] = field(default_factory=list)
    last: Report | None = None
    untold: list[Floats] = field(default_factory=list)
    unmatched: int = 0
    placed: int = 0
    life: int = 0


@dataclass(frozen=True, slots=True)
class Placement:
    """Outcome of placing a report.

    Attributes:
        matched: whether it agrees with the team's map.
        moved: correction of the robot's place by this report [m].
        too_far: whether it was refused because the map would have grown beyond all reason.
        redrawn: whether the whole map was put right on that occasion.
    """

    matched: bool
    moved: float
    too_far: bool = False
    redrawn: bool = False


TOO_FAR = Placement(matched=False, moved=0.0, too_far=True)


def motion_of(drive: Drive) -> MotionModel:
    """Return how wrong the wheels of a robot are, by what it told of its drive."""
    return MotionModel(
        distance_sigma=max(drive.noise_distance, 0.005),
        drift_sigma=max(math.radians(drive.noise_heading_deg_m), 0.002),
        rotation_sigma=max(drive.noise_turn, 0.005),
    )


def node_tracks(nodes: Iterable[Node]) -> list[Floats]:
    """Return the corrected poses up to each node of one robot, as `corrected_track` does."""
    tracks: list[Floats] = []
    before: Node | None = None
    for node in nodes:
        start = node if before is None or before.life != node.life else before
        tracks.append(corrected_track(node.track_odom, start.T_map_odom, node.T_map_odom))
        before = node
    return tracks
