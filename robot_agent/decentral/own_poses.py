"""Where a robot's own observations were made, in the team's map, as it believes now."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry import Floats, Pose2, pose_from
from protocol.log.pose_coding import (
    STEPS_PER_METRE,
    STEPS_PER_RADIAN,
    PoseTable,
    pose_of,
    pose_steps,
)
from protocol.log.sync import LogSync


class OwnPoses:
    """The poses of a robot's own entries.

    Entries of a life before this one's memory of its way keep the poses they had.

    Args:
        kept: (m, 3) int32, poses of entries written before the robot was started, in steps.

    Attributes:
        T_map_own: where the frame of the robot's own map lies in the team's.
    """

    def __init__(self, kept: PoseTable, T_map_own: Pose2) -> None:
        self.T_map_own = T_map_own
        self._kept = kept

    def table(self, poses_own: Floats) -> PoseTable:
        """Return the poses of all entries, (m + n, 3) int32 in steps, map frame.

        Args:
            poses_own: (n, 3) of the entries of this start, in the robot's own map.
        """
        steps = [pose_steps(self.T_map_own @ pose_from(pose)) for pose in poses_own]
        new: PoseTable = np.array(steps, dtype=np.int32).reshape(-1, 3)
        return np.concatenate((self._kept, new))

    def T_map_odom(self, last_own: Floats, T_odom_told: Pose2) -> Pose2:  # noqa: N802
        """Return where the frame that the robot drives in lies in the team's map.

        Args:
            last_own: (3,) its last entry's pose as known now, own map.
            T_odom_told: the same as the robot had it when it told it.
        """
        return self.T_map_own @ pose_from(last_own) @ T_odom_told.inverse()


def moved(before: PoseTable, after: PoseTable, distance: float, turn: float) -> bool:
    """Whether a pose moved by at least a distance [m] or a turn [rad]; both (n, 3) in steps."""
    if not len(before):
        return False
    off = after.astype(np.int64) - before
    turned = np.abs(off[:, 2])
    turned = np.minimum(turned, round(2.0 * math.pi * STEPS_PER_RADIAN) - turned)
    far = np.hypot(off[:, 0], off[:, 1]).max() >= distance * STEPS_PER_METRE
    return bool(far or turned.max() >= turn * STEPS_PER_RADIAN)


def own_table(sync: LogSync) -> PoseTable:
    """Return the poses of a robot's own entries as they were told, (n, 3) int32 in steps."""
    own = sync.log.own
    rows = [own.pose(number) for number in range(1, own.count + 1)]
    return np.array(rows, dtype=np.int32).reshape(-1, 3)


def first_pose(sync: LogSync) -> Pose2 | None:
    """Return where a robot was when it wrote its very first entry, map frame, or None."""
    for author in sync.log.authors():
        log = sync.log.of(author)
        if author.robot == sync.log.me.robot and 1 in log.entries:
            return pose_of(log.pose(1))
    return None
