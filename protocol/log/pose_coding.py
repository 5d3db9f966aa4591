"""Poses as they are told with observations: whole millimetres and tenths of a milliradian.

What was rounded once is the same number at every member, so maps drawn from it are the same, too.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from mapping.geometry import Pose2, wrap_angle
from mapping.integer_coding import decode_integers, encode_integers

STEPS_PER_METRE = 1000.0
STEPS_PER_RADIAN = 10_000.0
LARGEST_TURN = 31_416  # pi in steps, rounded up
_CHECKSUM_BYTES = 4

PoseSteps = tuple[int, int, int]
PoseTable = npt.NDArray[np.int32]


def pose_steps(pose: Pose2) -> PoseSteps:
    """Return a pose as (x [mm], y [mm], theta [0.1 mrad]), rounded, in its own frame."""
    theta = round(wrap_angle(pose.theta) * STEPS_PER_RADIAN)
    return round(pose.x * STEPS_PER_METRE), round(pose.y * STEPS_PER_METRE), theta


def pose_of(steps: Sequence[int]) -> Pose2:
    """Return the pose that `steps` (x, y, theta) stand for; theta is wrapped."""
    x, y, theta = (int(step) for step in steps)
    return Pose2(x / STEPS_PER_METRE, y / STEPS_PER_METRE, wrap_angle(theta / STEPS_PER_RADIAN))


def within_reach(table: PoseTable, reach: float) -> bool:
    """Whether all poses (n, 3) are possible: x and y within `reach` [m], theta within +-pi."""
    if not len(table):
        return True
    most = np.abs(table.astype(np.int64)).max(axis=0)
    limit = math.floor(reach * STEPS_PER_METRE)
    return bool(max(most[0], most[1]) <= limit and most[2] <= LARGEST_TURN)


def pack_poses(table: PoseTable, base: PoseTable | None = None) -> npt.NDArray[np.uint8]:
    """Return the wire bytes (k,) uint8 of poses (n, 3) int32 in steps.

    Told is by how much each is off its base, as the difference to the row before: a drive goes on,
    and what moves, moves with its neighbours. A checksum of the poses goes first.

    Args:
        table: the poses.
        base: (n, 3) int32 where the receiver has them now; zeros by default.
    """
    off = table.astype(np.int64) - (0 if base is None else base)
    # Differences wrap around; their sums do, too.
    steps = np.diff(np.concatenate((np.zeros((1, 3), np.int64), off)), axis=0).astype(np.int32)
    return np.concatenate((_checksum(table), encode_integers(steps)))


def unpack_poses(
    packed: npt.NDArray[np.uint8], count: int, most: int, base: PoseTable | None = None
) -> PoseTable:
    """Return the poses (count, 3) int32, read-only, that `packed` holds.

    Args:
        packed: (k,) uint8, from `pack_poses`, possibly damaged or forged on its way.
        count: number of poses that was announced.
        most: no more poses than that are accepted; no more memory is ever allocated.
        base: (count, 3) int32, the same that they were packed with.

    Raises:
        ValueError: the bytes do not hold exactly these poses, or the base is another one.
    """
    if not 0 <= count <= most:
        raise ValueError(f"too many poses: {count} of them, at most {most} are accepted")
    steps = decode_integers(np.ascontiguousarray(packed[_CHECKSUM_BYTES:]), count, 3)
    off = np.cumsum(steps.astype(np.int64), axis=0)
    poses: PoseTable = (off + (0 if base is None else base)).astype(np.int32)
    if not np.array_equal(_checksum(poses), packed[:_CHECKSUM_BYTES]):
        raise ValueError(f"poses cannot be unpacked: not {count} of them, or on another base")
    poses.flags.writeable = False
    return poses


def _checksum(table: PoseTable) -> npt.NDArray[np.uint8]:
    """Return the CRC-32 of poses and their number, (4,) uint8."""
    summed = zlib.crc32(table.astype("<i4").tobytes(), len(table))
    return np.frombuffer(summed.to_bytes(_CHECKSUM_BYTES, "little"), dtype=np.uint8)
