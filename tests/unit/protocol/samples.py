"""Messages to test with: one plain example of each type, and any valid one by Hypothesis."""

from __future__ import annotations

import types
import typing
from typing import Any

import annotated_types as limits
import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from mapping.geometry import Pose2
from protocol import messages as words
from protocol import operator_messages as asks
from protocol import peer_messages as peers
from protocol import world_messages as body
from protocol.body import Body, Drive, Lidar
from protocol.codec import KINDS, Header
from protocol.fields import ArrayField
from protocol.log import messages as logs
from protocol.messages import Message
from protocol.peer_messages import Beacon

POSE = Pose2(1.5, -2.25, 0.5)


def header_of(message: Message, **changes: Any) -> Header:
    """A header for a message, from `robot1` to the server unless told otherwise."""
    values: dict[str, Any] = {
        "type": message.type,
        "source": "robot1",
        "to": "server",
        "sequence": 7,
        "stamp": 12.5,
    }
    return Header(**(values | changes))


def f32(*values: float) -> np.ndarray[Any, np.dtype[np.float32]]:
    return np.array(values, dtype=np.float32)


def examples() -> dict[str, Message]:
    """One example of each message type, by type."""
    a_body = Body(radius_m=0.3, lidar=Lidar(beams=90), drive=Drive(speed_max_m_s=0.4))
    cells = np.arange(12, dtype=np.uint8)
    track = np.array([[12.3, 1.0, -2.0, 0.4], [12.5, 1.5, -2.25, 0.5]])
    some: list[Message] = [
        words.Hello(role="robot", incarnation=2, body=a_body, start=POSE, start_sigma_m=1.0),
        words.Welcome(now_s=12.5, strategy="auction"),
        words.Refused(reason="no robot of that name"),
        words.Heartbeat(
            T_odom_base=POSE,
            speed_m_s=0.25,
            moving=True,
            path_map=f32(1.0, 2.0, 3.0, 4.0).reshape(2, 2),
            reports=3,
            map_number=9,
        ),
        words.TeamPoses(
            robots=("robot1", "robot2"),
            poses_map=track,
            radii_m=f32(0.25, 0.3),
            uncertainty_m=f32(0.05, 0.125),
            paths_map=f32(1.0, 2.0).reshape(1, 2),
            path_lengths=(1, 0),
            busy=(True, False),
        ),
        words.ScanReport(
            number=3,
            stamp_s=12.5,
            ranges=f32(1.0, 2.0, 8.0),
            bearing_start_rad=-1.5,
            bearing_step_rad=0.5,
            range_max_m=8.0,
            T_base_laser=Pose2(0.0, 0.0, 0.0),
            T_odom_base=POSE,
            covariance=np.diag([0.25, 0.5, 0.125]),
            track_odom=track,
        ),
        words.ReportsReceived(number=3),
        words.PoseUpdate(number=3, T_map_odom=POSE, uncertainty_m=0.125, matched=True),
        words.MapSnapshot(
            number=9,
            resolution_m=0.05,
            origin_x_m=-1.0,
            origin_y_m=-2.0,
            rows=3,
            cols=4,
            cells=cells,
        ),
        words.MapDelta(
            number=10, resolution_m=0.05, lattice_x=-20, lattice_y=5, rows=3, cols=4, cells=cells
        ),
        words.MapRequest(have=8),
        words.Bid(
            number=4,
            map_number=9,
            T_map_base=POSE,
            places_map=f32(1.0, 2.0).reshape(1, 2),
            gains=f32(3.5),
            costs_m=f32(1.25),
            rectangles_map=f32(0.0, 0.0, 2.0, 3.0).reshape(1, 4),
            unreachable_map=f32(9.0, 9.0).reshape(1, 2),
        ),
        words.Award(task=5, kind="explore", goal_map=(1.0, 2.0), lease_s=10.0),
        words.Terminate(task=5),
        words.TaskProgress(task=5, remaining_m=2.5),
        words.TaskEnd(task=5, outcome="failed", reason="stuck"),
        words.TightPlace(place_map=(3.5, -1.25)),
        words.MissionEnd(ended="explored", reason="nothing useful is left"),
        asks.VisitRequest(robot="robot1", x_m=1.0, y_m=-2.0),
        asks.PauseRequest(robot="robot1"),
        asks.ResumeRequest(robot="robot1"),
        asks.DriveRequest(robot="robot1", speed_m_s=0.25, turn_rate_rad_s=-0.5),
        asks.StopRequest(ended="coverage"),
        asks.Answer(accepted=True, text="robot1 is paused"),
        asks.RobotLost(robot="robot2", state="lost"),
        logs.Observations(
            author="robot2",
            life=1,
            version=2,
            numbers=(7, 9),
            sizes=(5, 7),
            poses=np.array([[1500, -2250, 5000], [1600, -2250, -31415]], dtype=np.int32),
            data=cells,
        ),
        logs.PoseSet(life=0, version=3, count=2, data=cells),
        logs.LogHave(
            authors=("robot1", "robot2"),
            lives=(0, 1),
            counts=(40, 7),
            versions=(3, 2),
            sums=(4_000_000_000, 17),
            beyond=((1, 9, 12),),
        ),
        logs.LogWant(
            authors=("robot1", "robot2"),
            lives=(0, 1),
            versions=(0, 3),
            bases=(0, 3),
            ranges=((1, 8, 8),),
        ),
        peers.Beacon(
            life=1,
            T_map_base=POSE,
            sigma_m=0.05,
            radius_m=0.25,
            speed_m_s=0.5,
            busy=True,
            held=4_000_000_000,
            path_map=f32(1.5, -2.25, 1.75, -2.5).reshape(2, 2),
        ),
        Beacon(
            life=1,
            T_map_base=POSE,
            sigma_m=0.125,
            radius_m=0.25,
            speed_m_s=0.5,
            busy=True,
            held=4_000_000_000,
            path_map=f32(1.0, 2.0, 3.0, 4.0).reshape(2, 2),
        ),
        peers.Presence(),
        peers.LastHeard(life=0, stamp_s=12.5, T_map_base=POSE),
        peers.Lookout(
            life=0,
            T_map_own=POSE,
            tied=False,
            error_m=1.0,
            error_rad=0.35,
            place_own=f32(0.0, 0.0).reshape(1, 2),
            turn_variance=1e-4,
            discs_own=f32(0.75, -0.5).reshape(1, 2),
        ),
        body.Join(role="robot", incarnation=1),
        body.Joined(lockstep=True, now_s=0.0, step_s=0.1, body=a_body, start=POSE),
        body.JoinRefused(reason="the name is taken"),
        body.BodyFrame(stamp_s=12.5, T_wheel_base=POSE, bumped=False, ranges=f32(1.0, 2.5)),
        body.MotionCommand(speed_m_s=0.25, turn_rate_rad_s=-0.5),
        body.Fault(kind="restart"),
        body.Shutdown(reason="over"),
        body.Finished(ended="time_limit", reason="60 s are over"),
        body.Through(through=True, held=7, shut_out=("robot3",)),
        body.Ping(value=1.5),
    ]
    return {message.type: message for message in some}


def messages() -> st.SearchStrategy[Message]:
    """Any valid message of any type."""
    return st.sampled_from(sorted(KINDS)).flatmap(lambda name: _model(KINDS[name].model))


def _model(model: type[BaseModel]) -> st.SearchStrategy[Any]:
    """Any valid instance of a model."""
    fields = {name: _field(field) for name, field in model.model_fields.items() if name != "type"}
    return st.builds(model, **fields)


def _field(field: FieldInfo) -> st.SearchStrategy[Any]:
    for meta in field.metadata:
        if isinstance(meta, ArrayField):
            return _array(meta)
    return _value(field.annotation, field.metadata)


def _array(kind: ArrayField) -> st.SearchStrategy[Any]:
    sizes = st.tuples(*(st.integers(0, 5) if n is None else st.just(n) for n in kind.shape))
    elements: dict[str, Any] = {}
    if np.dtype(kind.dtype).kind == "f":
        elements = {"allow_nan": not kind.finite, "allow_infinity": not kind.finite}
    return sizes.flatmap(lambda shape: hnp.arrays(kind.dtype, shape, elements=elements or None))


def _value(kind: Any, metadata: list[Any]) -> st.SearchStrategy[Any]:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        inner = [
            m for a in arguments[1:] for m in (a.metadata if isinstance(a, FieldInfo) else [a])
        ]
        return _value(arguments[0], inner)
    if origin in (typing.Union, types.UnionType):
        return st.one_of(*(_value(argument, []) for argument in arguments))
    if origin is typing.Literal:
        return st.sampled_from(arguments)
    if origin is tuple and len(arguments) == 2 and arguments[1] is ...:
        return st.lists(_value(arguments[0], []), max_size=4).map(tuple)
    if origin is tuple:
        return st.tuples(*(_value(argument, []) for argument in arguments))
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return _model(kind)
    return _plain(kind, metadata)


def _plain(kind: Any, metadata: list[Any]) -> st.SearchStrategy[Any]:
    if kind is Pose2:
        metres, turn = st.floats(-1e5, 1e5), st.floats(-3.14, 3.14)
        return st.builds(Pose2, metres, metres, turn)
    if kind is type(None):
        return st.none()
    if kind is bool:
        return st.booleans()
    if kind is str:
        named = not any(isinstance(m, limits.MaxLen) for m in metadata)
        return st.from_regex(r"\A[A-Za-z0-9_.-]{1,32}\Z") if named else st.text(max_size=60)
    low, high, above = -1e300, 1e300, False
    for limit in metadata:
        low = getattr(limit, "ge", getattr(limit, "gt", low))
        above = above or getattr(limit, "gt", None) is not None
        high = getattr(limit, "le", getattr(limit, "lt", high))
    if kind is int:
        return st.integers(int(max(low, -(2**53))), int(min(high, 2**53)))
    return st.floats(low, high, exclude_min=above)
