"""Poses as they are told with observations: whole millimetres and tenths of a milliradian.

What was rounded once is the same number at every member, so maps drawn from it are the same, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import zstandard

from mapping.geometry import Pose2, wrap_angle

STEPS_PER_METRE = 1000.0
STEPS_PER_RADIAN = 10_000.0
LARGEST_TURN = 31_416  # pi in steps, rounded up
# Level 3 is 2 % smaller than 1 on poses of a drive; higher levels gain nothing.
COMPRESSION_LEVEL = 3

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


def pack_poses(table: PoseTable) -> npt.NDArray[np.uint8]:
    """Return the wire bytes (k,) uint8 of poses (n, 3) int32 in steps.

    Neighbours are close, so differences are told; their low bytes first, then the next, which are
    nearly all the same and compress to nothing.
    """
    before = np.zeros((1, 3), dtype=np.int32)
    steps: PoseTable = np.diff(np.concatenate((before, table)), axis=0).astype(np.int32)
    zigzag = ((steps << 1) ^ (steps >> 31)).astype("<i4")
    planes = np.ascontiguousarray(zigzag.T).view(np.uint8).reshape(-1, 4).T
    raw = np.ascontiguousarray(planes).tobytes()
    compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
    return np.frombuffer(compressor.compress(raw), dtype=np.uint8)


def unpack_poses(packed: npt.NDArray[np.uint8], count: int, most: int) -> PoseTable:
    """Return the poses (count, 3) int32, read-only, that `packed` holds.

    Args:
        packed: (k,) uint8, from `pack_poses`, possibly damaged or forged on its way.
        count: number of poses that was announced.
        most: no more poses than that are accepted; no more memory is ever allocated.

    Raises:
        ValueError: the bytes do not hold exactly that many poses.
    """
    if not 0 <= count <= most:
        raise ValueError(f"too many poses: {count} of them, at most {most} are accepted")
    data = np.ascontiguousarray(packed).tobytes()
    try:
        if zstandard.frame_content_size(data) != 12 * count:
            raise ValueError(f"poses cannot be unpacked: not {count} of them")
        raw = zstandard.ZstdDecompressor().decompress(
            data, max_output_size=12 * count, allow_extra_data=False
        )
    except zstandard.ZstdError as error:
        raise ValueError(f"poses cannot be unpacked: {error}") from None
    if len(raw) != 12 * count:
        raise ValueError(f"poses cannot be unpacked: {len(raw)} bytes, want {12 * count}")
    planes = np.frombuffer(raw, dtype=np.uint8).reshape(4, -1)
    zigzag = np.ascontiguousarray(planes.T).view("<u4").reshape(3, count).T.astype(np.int64)
    # Sums wrap around as the differences did.
    poses: PoseTable = np.cumsum((zigzag >> 1) ^ -(zigzag & 1), axis=0).astype(np.int32)
    poses.flags.writeable = False
    return poses
