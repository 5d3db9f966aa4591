from __future__ import annotations

import math

import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mapping.geometry import Pose2
from protocol.log.pose_coding import pack_poses, pose_of, pose_steps, unpack_poses, within_reach

TABLES = hnp.arrays(np.int32, st.tuples(st.integers(0, 30), st.just(3)))


def drive(count: int) -> np.ndarray:
    """Poses of a robot that drives about: a metre and some turn between two."""
    rng = np.random.default_rng(3)
    turns = np.cumsum(rng.normal(0.0, 0.3, count))
    xy = np.cumsum(np.stack((np.cos(turns), np.sin(turns)), axis=1), axis=0)
    poses = [pose_steps(Pose2(x, y, t)) for (x, y), t in zip(xy, turns, strict=True)]
    return np.array(poses, dtype=np.int32)


def test_a_pose_is_rounded_to_a_millimetre_and_a_tenth_of_a_milliradian() -> None:
    assert pose_steps(Pose2(1.23449, -2.0006, 0.50004)) == (1234, -2001, 5000)
    back = pose_of((1234, -2001, 5000))
    assert (back.x, back.y, back.theta) == (1.234, -2.001, 0.5)
    assert pose_steps(Pose2(0.0, 0.0, 3 * math.pi))[2] in (31416, -31416)


@given(TABLES)
@settings(deadline=None)
def test_poses_come_back_exactly(table: np.ndarray) -> None:
    back = unpack_poses(pack_poses(table), len(table), 30)
    assert back.dtype == np.int32 and not back.flags.writeable
    assert np.array_equal(back, table)


def test_poses_of_a_drive_pack_well() -> None:
    assert len(pack_poses(drive(1000))) < 6.5 * 1000


def test_reach() -> None:
    assert within_reach(np.zeros((0, 3), dtype=np.int32), 1.0)
    assert within_reach(np.array([[1000, -1000, 31416]], dtype=np.int32), 1.0)
    for pose in ([1001, 0, 0], [0, -1001, 0], [0, 0, 31417], [-(2**31), 0, 0]):
        assert not within_reach(np.array([pose], dtype=np.int32), 1.0)


@given(st.binary(max_size=100))
@settings(deadline=None)
def test_any_bytes_are_refused_politely(data: bytes) -> None:
    with pytest.raises(ValueError, match="poses"):
        unpack_poses(np.frombuffer(data, dtype=np.uint8), 7, 100)


def test_wrong_counts_and_bombs_are_refused() -> None:
    packed = pack_poses(drive(5))
    for count in (-1, 4, 6, 101):
        with pytest.raises(ValueError, match="poses"):
            unpack_poses(packed, count, 100)
    bomb = np.frombuffer(zstandard.ZstdCompressor().compress(bytes(10_000_000)), dtype=np.uint8)
    with pytest.raises(ValueError, match="poses"):
        unpack_poses(bomb, 50, 100)
