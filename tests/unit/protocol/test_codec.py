"""Frames: what goes in comes out; hostile bytes raise nothing but a ProtocolError."""

from __future__ import annotations

import tracemalloc
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import codec
from protocol.codec import KINDS, Header, decode, decode_header, encode, frame_bytes
from protocol.errors import (
    FrameError,
    MessageError,
    ProtocolError,
    UnknownTypeError,
    VersionError,
)
from protocol.messages import Hello, Message, Welcome
from protocol.world_messages import BodyFrame
from tests.unit.protocol.samples import POSE, examples, f32, header_of, messages

EXAMPLES = examples()
HEAD = [[1, 0], "body_frame", "world", "robot1", 1, 0.5, 0]
FRAME = BodyFrame(stamp_s=0.5, T_wheel_base=POSE, bumped=False, ranges=f32(1.0, 2.0))


def same(one: Message, other: Message) -> bool:
    """Whether two messages hold the same values, arrays bit by bit."""
    kind = KINDS[one.type]
    return (
        type(one) is type(other)
        and all(getattr(one, name) == getattr(other, name) for name in kind.plain)
        and all(
            getattr(one, name).dtype == getattr(other, name).dtype
            and getattr(one, name).shape == getattr(other, name).shape
            and getattr(one, name).tobytes() == getattr(other, name).tobytes()
            for name in kind.arrays
        )
    )


def test_there_is_an_example_of_every_type() -> None:
    assert sorted(EXAMPLES) == sorted(KINDS)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_an_example_comes_back_as_it_was(kind: str) -> None:
    message = EXAMPLES[kind]
    header, back = decode(encode(header_of(message), message))
    assert header == header_of(message)
    assert same(message, back)


@given(messages())
@settings(deadline=None, max_examples=300)
def test_any_message_comes_back_as_it_was(message: Message) -> None:
    header, back = decode(encode(header_of(message), message))
    assert header.type == message.type
    assert same(message, back)


def test_arrays_from_the_wire_are_read_only_and_do_not_share_the_buffer() -> None:
    _, message = decode(encode(header_of(FRAME), FRAME))
    assert isinstance(message, BodyFrame)
    assert not message.ranges.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        message.ranges[0] = 1.0


def test_a_header_can_be_read_without_its_body() -> None:
    frame = encode(header_of(FRAME, to="*", acknowledged=3), FRAME)
    header = decode_header([frame[0], b"\xff\xff"])
    assert (header.to, header.acknowledged) == ("*", 3)


def test_frame_bytes_counts_all_parts() -> None:
    assert frame_bytes([b"12", b"345", b""]) == 5


def test_victims_cost_nothing_where_none_are_seen() -> None:
    frame = encode(header_of(FRAME), FRAME)
    assert len(frame) == 3
    assert b"victims" not in frame[1]
    seen = FRAME.model_copy(update={"victims_base": f32(1.0, 2.0).reshape(1, 2)})
    _, back = decode(encode(header_of(seen), seen))
    assert isinstance(back, BodyFrame)
    assert back.victims_base.tolist() == [[1.0, 2.0]]


def test_unknown_fields_are_ignored_also_within_a_body() -> None:
    hello = EXAMPLES["hello"]
    frame = encode(header_of(hello), hello)
    content = msgpack.unpackb(frame[1])
    content |= {"new_field": [1, {"deep": 2}], "body": content["body"] | {"wings": 2}}
    content["body"]["lidar"]["colour"] = "red"
    _, back = decode([frame[0], msgpack.packb(content)])
    assert same(back, hello)


def test_a_body_that_is_no_table_is_refused() -> None:
    with pytest.raises(MessageError, match="body"):
        decode(framed("hello", {"role": "robot", "body": 3}))


def test_a_newer_minor_version_is_understood() -> None:
    head = list(HEAD)
    head[0] = [1, 99]
    assert decode([msgpack.packb(head), *encode(header_of(FRAME), FRAME)[1:]])[0].version == (1, 99)


def test_another_major_version_is_refused_with_the_mend() -> None:
    head = list(HEAD)
    head[0] = [2, 0]
    with pytest.raises(VersionError, match=r"world speaks protocol 2\.0.*same major version"):
        decode([msgpack.packb(head), b"\x80"])


def test_an_unknown_type_is_an_error_of_its_own() -> None:
    head = list(HEAD)
    head[1] = "teleport"
    with pytest.raises(UnknownTypeError, match="teleport"):
        decode([msgpack.packb(head), b"\x80"])


def framed(kind: str, body: Any, *buffers: bytes) -> list[bytes]:
    """A frame whose header is fine."""
    return [
        msgpack.packb([[1, 0], kind, "world", "robot1", 1, 0.5, 0]),
        msgpack.packb(body),
        *buffers,
    ]


def head_with(index: int, value: Any) -> list[Any]:
    head = list(HEAD)
    head[index] = value
    return head


BAD_HEADS = [
    [],
    HEAD[:6],
    "text",
    7,
    None,
    *(head_with(0, v) for v in (1, [1], [1, 0, 0], [-1, 0], [1, "0"], [True, 0], None)),
    *(head_with(1, v) for v in ("", 5, "x" * 33, None, "body frame", "\x1b[2J")),
    *(head_with(2, v) for v in ("", b"world", "a\nb", "*", ["world"], "\u202eevil")),
    *(head_with(3, v) for v in ("", "**", 3, None)),
    *(head_with(4, v) for v in (-1, 1.0, True, 2**53, 2**63, None)),
    *(head_with(5, v) for v in (1, -0.1, float("nan"), float("inf"), 1e12, "0", None)),
    *(head_with(6, v) for v in (-1, "1", None)),
]


@pytest.mark.parametrize("head", BAD_HEADS, ids=repr)
def test_a_bad_header_is_refused(head: Any) -> None:
    with pytest.raises(FrameError):
        decode([msgpack.packb(head), b"\x80"])


@pytest.mark.parametrize("parts", [0, 1, codec.MAX_PARTS + 1])
def test_a_wrong_number_of_parts_is_refused(parts: int) -> None:
    with pytest.raises(FrameError):
        decode([msgpack.packb(HEAD)] * parts)


def test_oversized_frames_are_refused_before_anything_is_read() -> None:
    good = msgpack.packb(HEAD)
    with pytest.raises(FrameError, match="oversized header"):
        decode([b"\xc0" * (codec.MAX_HEADER_BYTES + 1), b"\x80"])
    with pytest.raises(FrameError, match="oversized body"):
        decode([good, b"\xc0" * (codec.MAX_BODY_BYTES + 1)])
    with pytest.raises(FrameError, match="bytes"):
        decode([good, b"\x80", bytes(codec.MAX_FRAME_BYTES)])


@pytest.mark.parametrize("body", [b"", b"\xc1", b"\x91", b"\x80\x80", msgpack.packb([1]), b"\x01"])
def test_a_body_that_is_no_map_is_refused(body: bytes) -> None:
    with pytest.raises(FrameError):
        decode([msgpack.packb(HEAD), body])


def arrays(*described: Any) -> dict[str, Any]:
    base = {"stamp_s": 0.5, "T_wheel_base": [0.0, 0.0, 0.0], "bumped": False}
    return base | {"~": list(described)}


ONE = np.array([1.0], dtype="<f4").tobytes()
BAD_ARRAYS: list[tuple[Any, tuple[bytes, ...]]] = [
    (arrays(), ()),
    (arrays(), (ONE,)),
    (arrays(["ranges", "<f4", [1]]), ()),
    (arrays(["ranges", "<f4", [2]]), (ONE,)),
    (arrays(["ranges", "<f4", [1, 1]]), (ONE,)),
    (arrays(["ranges", "<f4", [-1]]), (ONE,)),
    (arrays(["ranges", "<f4", [True]]), (ONE,)),
    (arrays(["ranges", "<f4", [1.0]]), (ONE,)),
    (arrays(["ranges", "<f4", [2**40, 2**40, 2**40]]), (ONE,)),
    (arrays(["ranges", "<f4", [0, 2**52]]), (b"",)),
    (arrays(["ranges", "<f4", [2**52, 0, 2**52]]), (b"",)),
    (arrays(["ranges", "<f4", [1, 1, 1, 1]]), (ONE,)),
    (arrays(["ranges", "<f8", [1]]), (bytes(8),)),
    (arrays(["ranges", "O", [1]]), (bytes(8),)),
    (arrays(["ranges", ["<f4"], [1]]), (ONE,)),
    (arrays(["ranges", "<f4"]), (ONE,)),
    (arrays(["ranges", "<f4", 1]), (ONE,)),
    (arrays("ranges"), (ONE,)),
    (arrays(["stamp_s", "<f4", [1]]), (ONE,)),
    (arrays([["ranges"], "<f4", [1]]), (ONE,)),
    (arrays(["ranges", "<f4", [1]]), (np.array([np.nan], "<f4").tobytes(),)),
    (arrays(["ranges", "<f4", [1]]), (np.array([np.inf], "<f4").tobytes(),)),
    (arrays(["ranges", "<f4", [4097]]), (bytes(4 * 4097),)),
    ({"~": 5}, (ONE,)),
    ({"~": {"ranges": 1}}, (ONE,)),
    ({"~": []}, ()),
]


@pytest.mark.parametrize("case", range(len(BAD_ARRAYS)))
def test_a_bad_array_is_refused(case: int) -> None:
    body, buffers = BAD_ARRAYS[case]
    with pytest.raises(MessageError, match="body_frame"):
        decode(framed("body_frame", body, *buffers))


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        ("award", {"task": -1, "kind": "explore", "goal_map": [0.0, 0.0], "lease_s": 1.0}),
        ("award", {"task": 1, "kind": "dance", "goal_map": [0.0, 0.0], "lease_s": 1.0}),
        ("award", {"task": 1, "kind": "explore", "goal_map": [0.0], "lease_s": 1.0}),
        ("award", {"task": 1, "kind": "explore", "goal_map": [0.0, 1e9], "lease_s": 1.0}),
        ("award", {"task": 1, "kind": "explore", "goal_map": [0.0, 0.0], "lease_s": 0.0}),
        ("motion_command", {"speed_m_s": float("nan"), "turn_rate_rad_s": 0.0}),
        ("motion_command", {"speed_m_s": 1e9, "turn_rate_rad_s": 0.0}),
        ("pose_update", {"number": 1, "T_map_odom": [0, 0], "uncertainty_m": 0.0, "matched": 1}),
        ("pause_request", {"robot": "a b"}),
        ("pause_request", {"robot": ["robot1"]}),
        ("pause_request", {}),
        ("answer", {"accepted": True, "text": "x" * 2001}),
        ("hello", {"role": "king"}),
    ],
)
def test_a_message_that_breaks_its_types_rules_is_refused(kind: str, body: Any) -> None:
    with pytest.raises(MessageError, match=kind):
        decode(framed(kind, body))


def test_deep_msgpack_is_refused() -> None:
    for depth in (100, 2000, 100_000):
        with pytest.raises(ProtocolError):
            decode([msgpack.packb(HEAD), b"\x91" * depth + b"\xc0"])
        nested = b"\x81\xa1x" * depth + b"\xc0"
        with pytest.raises(ProtocolError):
            decode([msgpack.packb(HEAD), nested[:250_000]])


def test_lengths_that_are_announced_but_not_there_allocate_nothing() -> None:
    liars = [
        b"\xdd\xff\xff\xff\xff",  # a list of 2**32 - 1
        b"\xdf\xff\xff\xff\xff",  # a map
        b"\xc6\xff\xff\xff\xff",  # bytes
        b"\xdb\xff\xff\xff\xff",  # text
        b"\xc9\xff\xff\xff\xff\x01",  # an extension
    ]
    tracemalloc.start()
    for liar in liars:
        with pytest.raises(ProtocolError):
            decode([msgpack.packb(HEAD), liar])
        with pytest.raises(ProtocolError):
            decode([liar, b"\x80"])
    body = arrays(["ranges", "<f4", [2**31]])
    with pytest.raises(ProtocolError):
        decode(framed("body_frame", body, ONE))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=4)
    ),
    max_leaves=12,
)


@given(st.lists(st.binary(max_size=64), max_size=9))
@settings(deadline=None, max_examples=200)
def test_random_bytes_are_refused(frame: list[bytes]) -> None:
    with pytest.raises(ProtocolError):
        decode(frame)


@given(st.data())
@settings(deadline=None, max_examples=400)
def test_a_damaged_message_raises_nothing_but_protocol_errors(data: st.DataObject) -> None:
    message = EXAMPLES[data.draw(st.sampled_from(sorted(EXAMPLES)))]
    frame = encode(header_of(message), message)
    part = data.draw(st.integers(0, len(frame) - 1))
    damage = data.draw(st.sampled_from(["cut", "flip", "drop", "add", "field"]))
    if damage == "cut":
        frame[part] = frame[part][: data.draw(st.integers(0, len(frame[part])))]
    elif damage == "flip" and frame[part]:
        at = data.draw(st.integers(0, len(frame[part]) - 1))
        flipped = bytearray(frame[part])
        flipped[at] ^= 1 << data.draw(st.integers(0, 7))
        frame[part] = bytes(flipped)
    elif damage == "drop":
        del frame[part]
    elif damage == "add":
        frame.append(data.draw(st.binary(max_size=32)))
    else:
        body = msgpack.unpackb(frame[1])
        key = data.draw(st.sampled_from([*sorted(body), "~", "extra"]))
        body[key] = data.draw(plain)
        frame[1] = msgpack.packb(body)
    try:
        decode(frame)
    except ProtocolError as error:
        assert str(error)


def test_encoding_wants_a_message_of_the_protocol() -> None:
    header = Header("welcome", "server", "robot1", 1, 0.0)
    assert decode(encode(header, Welcome(now_s=0.0)))[1] == Welcome(now_s=0.0)
    assert Hello(role="observer").start is None
