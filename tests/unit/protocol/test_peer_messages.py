from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry import Pose2
from protocol.codec import decode, encode, frame_bytes
from protocol.packing import Packer
from protocol.peer_messages import POINTS_IN_BEACON, Beacon
from tests.unit.protocol.samples import header_of


def beacon(x: float, y: float, theta: float, path: np.ndarray | None = None) -> Beacon:
    return Beacon(
        life=0,
        T_map_base=Pose2(x, y, theta),
        sigma_m=0.0,
        radius_m=0.25,
        speed_m_s=0.5,
        busy=True,
        held=2**31 + 5,
        path_map=np.zeros((0, 2), np.float32) if path is None else path.astype(np.float32),
    )


def test_a_beacon_with_a_long_path_takes_no_more_than_ninety_bytes() -> None:
    ahead = np.array([12.0, -7.0]) + 0.3 * np.outer(np.arange(1, 13), (math.cos(2), math.sin(2)))
    told = beacon(12.0, -7.0, 2.0, ahead).model_copy(update={"goal_map": (32.15, -17.25)})
    assert frame_bytes(encode(header_of(told, to="*", sequence=700), told)) <= 90


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5), st.floats(-math.pi, math.pi))
def test_a_pose_is_rounded_once(x: float, y: float, theta: float) -> None:
    told = beacon(x, y, theta)
    _, heard = decode(encode(header_of(told), told))
    assert isinstance(heard, Beacon)
    pose = told.T_map_base
    assert heard.T_map_base == pose
    assert max(abs(pose.x - x), abs(pose.y - y)) <= 0.501e-3
    assert abs(pose.theta - theta) <= 1e-4


def test_a_path_is_told_in_centimetres_and_no_farther_than_anybody_drives() -> None:
    told = beacon(0.0, 0.0, 0.0, np.array([[1.234, -5.678], [3e38, 0.0]]))
    assert told.path_map.tolist() == pytest.approx(np.array([[1.23, -5.68], [10_000.0, 0.0]]))
    assert not told.path_map.flags.writeable
    with pytest.raises(ValueError, match="points"):
        beacon(0.0, 0.0, 0.0, np.zeros((POINTS_IN_BEACON + 1, 2)))


@given(st.none() | st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)))
def test_a_goal_is_told_in_centimetres_if_there_is_one(goal: tuple[float, float] | None) -> None:
    fields = beacon(1.0, 2.0, 0.0).model_dump(exclude={"T_map_base", "path_map"})
    told = Beacon(
        **{**fields, "goal_map": goal},
        T_map_base=Pose2(1.0, 2.0, 0.0),
        path_map=np.zeros((0, 2), np.float32),
    )
    _, heard = decode(encode(header_of(told), told))
    assert isinstance(heard, Beacon)
    assert heard.goal_map == told.goal_map
    assert (heard.goal_map is None) == (goal is None)
    for value, given_value in zip(told.goal_map or (), goal or (), strict=True):
        assert abs(value - max(-1e4, min(1e4, given_value))) <= 0.00501


def test_an_angle_that_is_not_wrapped_is_refused() -> None:
    with pytest.raises(ValueError, match="wrapped"):
        Beacon.unpacked(Packer().number(0).signed(0).signed(0).signed(40_000).data())
