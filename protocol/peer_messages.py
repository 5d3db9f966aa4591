"""What members of a team without a master tell each other besides their logs."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, Field

from mapping.geometry import Pose2
from protocol.fields import ArrayField, Coordinate, Count, NotNegative, Points, PoseField
from protocol.messages import Message
from protocol.packing import PackedMessage, Packer, Unpacker

POINTS_IN_BEACON = 64
DISCS_IN_LOOKOUT = 32
_FARTHEST = 10_000.0  # [m]; paths are told up to there
_STRAIGHT_ON = 31_415  # the largest whole tenth of a milliradian below pi
_FLAGS = ("busy", "idle", "through")
_WITH_GOAL = 1 << len(_FLAGS)


def _rounded(digits: int) -> AfterValidator:
    return AfterValidator(lambda value: round(value, digits))


def _round_pose(pose: Pose2) -> Pose2:
    """Return a pose in whole millimetres and tenths of a milliradian, as it is told."""
    x, y, theta = _steps(pose)
    return Pose2(x / 1e3, y / 1e3, theta / 1e4)


def _round_path(path: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return a path in whole centimetres, as it is told.

    Raises:
        ValueError: it has too many points.
    """
    if len(path) > POINTS_IN_BEACON:
        raise ValueError(f"{len(path)} points, at most {POINTS_IN_BEACON}")
    rounded = (_centimetres(path) / 100.0).astype(np.float32)
    rounded.flags.writeable = False
    return rounded


def _round_goal(goal: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return a place in whole centimetres, as it is told."""
    if goal is None:
        return None
    x, y = (max(-_FARTHEST, min(_FARTHEST, value)) for value in goal)
    return round(x * 100.0) / 100.0, round(y * 100.0) / 100.0


def _steps(pose: Pose2) -> tuple[int, int, int]:
    theta = max(-_STRAIGHT_ON, min(_STRAIGHT_ON, round(pose.theta * 1e4)))
    return round(pose.x * 1e3), round(pose.y * 1e3), theta


def _centimetres(path: npt.NDArray[np.float32]) -> npt.NDArray[np.int64]:
    near = np.clip(path.astype(np.float64), -_FARTHEST, _FARTHEST)
    return np.rint(near * 100.0).astype(np.int64)


class Beacon(PackedMessage):
    """Here I am: broadcast all the time, so that others keep clear and know what is left to do.

    `path_map` (n, 2) [m] is what the robot is about to drive, nearest first. `busy`: it drives for
    a task, to `goal_map` (x, y) [m]; `through`: it finds nothing more that is worth a trip, and all
    that it knows of hold what it holds. `held` is a checksum of all observations and poses that it
    holds.

    Values are rounded to what is told: the pose to millimetres and tenths of a milliradian, the
    path, the goal, `sigma_m` and `speed_m_s` to centimetres, `radius_m` to millimetres.
    """

    type: Literal["beacon"] = "beacon"
    life: Count
    T_map_base: Annotated[PoseField, AfterValidator(_round_pose)]
    sigma_m: Annotated[float, Field(ge=0.0, le=1.0e6, allow_inf_nan=False), _rounded(2)]
    radius_m: Annotated[float, Field(ge=0.001, le=1.0e3, allow_inf_nan=False), _rounded(3)]
    speed_m_s: Annotated[float, Field(ge=-1e3, le=1e3, allow_inf_nan=False), _rounded(2)] = 0.0
    busy: bool = False
    idle: bool = False
    through: bool = False
    held: Count = 0
    goal_map: Annotated[tuple[Coordinate, Coordinate] | None, AfterValidator(_round_goal)] = None
    path_map: Annotated[Points, AfterValidator(_round_path)]

    def packed(self) -> bytes:
        """Return all fields as bytes."""
        packer = Packer().number(self.life)
        for step in _steps(self.T_map_base):
            packer.signed(step)
        packer.number(round(self.sigma_m * 100.0)).number(round(self.radius_m * 1000.0))
        packer.signed(round(self.speed_m_s * 100.0))
        flags = sum(getattr(self, flag) << k for k, flag in enumerate(_FLAGS))
        packer.number(flags | (_WITH_GOAL if self.goal_map else 0))
        for value in self.goal_map or ():
            packer.signed(round(value * 100.0))
        packer.number(self.held).number(len(self.path_map))
        for column in _centimetres(self.path_map).T.tolist():
            packer.steps(column)
        return packer.data()

    @classmethod
    def unpacked(cls, data: bytes) -> dict[str, object]:
        """Return the fields that `packed` made these bytes of."""
        unpacker = Unpacker(data)
        fields: dict[str, object] = {"life": unpacker.number()}
        x, y, theta = (unpacker.signed() for _ in range(3))
        if abs(theta) > math.ceil(math.pi * 1e4):
            raise ValueError("an angle that is not wrapped")
        fields["T_map_base"] = [x / 1e3, y / 1e3, theta / 1e4]
        fields["sigma_m"] = unpacker.number() / 100.0
        fields["radius_m"] = unpacker.number() / 1000.0
        fields["speed_m_s"] = unpacker.signed() / 100.0
        flags = unpacker.number()
        fields |= {flag: bool(flags >> k & 1) for k, flag in enumerate(_FLAGS)}
        if flags & _WITH_GOAL:
            fields["goal_map"] = [unpacker.signed() / 100.0, unpacker.signed() / 100.0]
        fields["held"] = unpacker.number()
        count = unpacker.count(POINTS_IN_BEACON)
        path = np.array([unpacker.steps(count), unpacker.steps(count)], dtype=np.float64).T
        fields["path_map"] = (path.reshape(-1, 2) / 100.0).astype(np.float32)
        return fields


class LastHeard(Message):
    """Where you were when I last heard you, before you were started anew.

    Told to a teammate that lives a later life than `life` and does not know where it is.
    `T_map_base` is where it said that it was, at mission time `stamp_s`.
    """

    type: Literal["last_heard"] = "last_heard"
    life: Count
    stamp_s: Annotated[float, Field(ge=0.0, le=1e9, allow_inf_nan=False)]
    T_map_base: PoseField


class Presence(PackedMessage):
    """Here I am, somebody who holds the logs but has no body: a server that listens."""

    type: Literal["presence"] = "presence"

    def packed(self) -> bytes:
        """Return all fields, none, as bytes."""
        return b""

    @classmethod
    def unpacked(cls, data: bytes) -> dict[str, object]:
        """Return the fields that `packed` made these bytes of."""
        Unpacker(data).end()
        return {}


class Lookout(Message):
    """What I saw of the others from where I started: for those who must find out where they are.

    Broadcast again and again while somebody does not know its place. `discs_own` (k, 2) [m] is
    where I saw discs of a teammate's size, and `place_own` (1, 2) [m] where I stood, both in the
    frame of my own map, `turn_variance` [rad^2] how well I knew my heading in it. That frame lies
    in the team's at `T_map_own`: as I know it if I am `tied`, else as I was told, to within
    `error_m` and `error_rad`.
    """

    type: Literal["lookout"] = "lookout"
    life: Count
    T_map_own: PoseField
    tied: bool
    error_m: NotNegative
    error_rad: NotNegative
    place_own: Annotated[npt.NDArray[np.float32], ArrayField("float32", (1, 2), 2)]
    turn_variance: NotNegative
    discs_own: Annotated[
        npt.NDArray[np.float32], ArrayField("float32", (None, 2), 2 * DISCS_IN_LOOKOUT)
    ]
