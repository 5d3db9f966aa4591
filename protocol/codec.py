"""Messages to bytes and back: one header, one body, one buffer per array.

A frame is a list of byte strings `[header, body, array, ...]`. Header and body are msgpack; the
body describes each array (field, dtype, shape) and the raw little-endian bytes follow in order. A
message that is packed has its fields as one byte string in the place of that description.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgpack
import numpy as np
from pydantic import ValidationError

from protocol.errors import FrameError, MessageError, UnknownTypeError, VersionError
from protocol.fields import ArrayField, is_name
from protocol.fleet import FleetMessage
from protocol.messages import EVERYONE, PROTOCOL_VERSION, Message
from protocol.packing import PackedMessage
from protocol.world_messages import WorldMessage

MAX_PARTS = 8
MAX_HEADER_BYTES = 1024
MAX_BODY_BYTES = 256_000
MAX_FRAME_BYTES = 16_000_000

Frame = list[bytes]


class Header(NamedTuple):
    """Envelope of a message.

    Attributes:
        type: the message's type.
        source: name of the process that sent it.
        to: name of the one it is for, `server`, or `*` for everybody in reach.
        sequence: counts the frames from this source to this destination, from 1.
        stamp: mission time of sending [s].
        version: (major, minor) of the protocol.
        acknowledged: highest sequence seen from the destination; 0 for none.
    """

    type: str
    source: str
    to: str
    sequence: int
    stamp: float
    version: tuple[int, int] = PROTOCOL_VERSION
    acknowledged: int = 0


@dataclass(frozen=True, slots=True)
class _Kind:
    """A message class, which of its fields are arrays, and which are left out when empty."""

    model: type[Message]
    arrays: tuple[str, ...]
    omitted: tuple[str, ...]
    plain: set[str]


def _kinds(union: Any) -> dict[str, _Kind]:
    """Return the table type name -> class of a discriminated union."""
    table = {}
    for model in union.__origin__.__args__:
        arrays = {
            name: meta
            for name, field in model.model_fields.items()
            for meta in field.metadata
            if isinstance(meta, ArrayField)
        }
        omitted = tuple(name for name, meta in arrays.items() if meta.omit_empty)
        plain = set(model.model_fields) - set(arrays) - {"type"}
        table[model.model_fields["type"].default] = _Kind(model, tuple(arrays), omitted, plain)
    return table


KINDS: dict[str, _Kind] = {**_kinds(FleetMessage), **_kinds(WorldMessage)}


def encode(header: Header, message: Message) -> Frame:
    """Return the frame of a message."""
    return [encode_header(header), *encode_content(message)]


def encode_header(header: Header) -> bytes:
    """Return the first part of a frame."""
    head = (
        header.version,
        header.type,
        header.source,
        header.to,
        header.sequence,
        header.stamp,
        header.acknowledged,
    )
    return bytes(msgpack.packb(head))


def encode_content(message: Message) -> list[bytes]:
    """Return the parts of a frame that follow its header: the same, whoever it is for."""
    if isinstance(message, PackedMessage):
        return [msgpack.packb({"~": message.packed()})]
    kind = KINDS[message.type]
    body = message.__pydantic_serializer__.to_python(message, include=kind.plain)
    buffers = []
    if kind.arrays:
        shapes = []
        for name in kind.arrays:
            array: np.ndarray[Any, Any] = getattr(message, name)
            if not array.size and name in kind.omitted:
                continue
            shapes.append((name, array.dtype.str, array.shape))
            buffers.append(array.tobytes())
        body["~"] = shapes
    return [msgpack.packb(body), *buffers]


def decode_header(frame: Sequence[bytes]) -> Header:
    """Return the header of a frame, without looking at its body.

    Raises:
        FrameError: the bytes are no frame of ours.
        VersionError: another major version.
    """
    if not 2 <= len(frame) <= MAX_PARTS or len(frame[0]) > MAX_HEADER_BYTES:
        raise FrameError("wrong number of parts or oversized header")
    if sum(map(len, frame)) > MAX_FRAME_BYTES:
        raise FrameError(f"more than {MAX_FRAME_BYTES} bytes")
    head = _unpack(frame[0])
    if not isinstance(head, list) or len(head) < 7:
        raise FrameError("header is not a list of seven")
    version, kind, source, to, sequence, stamp, acknowledged = head[:7]
    if not (
        isinstance(version, list)
        and len(version) == 2
        and _is_count(version[0])
        and _is_count(version[1])
        and isinstance(kind, str)
        and is_name(kind)
        and isinstance(source, str)
        and is_name(source)
        and (to == EVERYONE or (isinstance(to, str) and is_name(to)))
        and _is_count(sequence)
        and _is_count(acknowledged)
        and isinstance(stamp, float)
        and 0.0 <= stamp < 1e12
    ):
        raise FrameError("header has wrong fields")
    if version[0] != PROTOCOL_VERSION[0]:
        raise VersionError(
            f"{source} speaks protocol {version[0]}.{version[1]}, this is "
            f"{PROTOCOL_VERSION[0]}.{PROTOCOL_VERSION[1]}: install the same major version"
        )
    return Header(kind, source, to, sequence, stamp, (version[0], version[1]), acknowledged)


def decode(frame: Sequence[bytes]) -> tuple[Header, Message]:
    """Return header and message of a frame.

    Raises:
        FrameError: the bytes are no frame of ours.
        VersionError: another major version.
        UnknownTypeError: a type this version does not know.
        MessageError: the message breaks the rules of its type.
    """
    header = decode_header(frame)
    kind = KINDS.get(header.type)
    if kind is None:
        raise UnknownTypeError(f"unknown message type {header.type!r}")
    if len(frame[1]) > MAX_BODY_BYTES:
        raise FrameError("oversized body")
    body = _unpack(frame[1])
    if not isinstance(body, dict):
        raise FrameError("body is not a map")
    described = body.pop("~", [])
    try:
        body.update(_described(kind, described, frame[2:]))
        return header, kind.model.__pydantic_validator__.validate_python(body)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise MessageError(f"{header.type}.{place}: {first['msg']}") from None
    except (ValueError, TypeError) as error:
        raise MessageError(f"{header.type}: {error}") from None


def frame_bytes(frame: Iterable[bytes]) -> int:
    """Return the number of bytes of a frame on the wire, without the transport's own framing."""
    return sum(map(len, frame))


def _unpack(data: bytes) -> object:
    """Read one msgpack value."""
    try:
        return msgpack.unpackb(data, strict_map_key=True)
    except Exception as error:  # msgpack raises many kinds for hostile bytes
        raise FrameError(f"not msgpack: {type(error).__name__}") from None


def _is_count(value: object) -> bool:
    """Whether a value is a not negative integer of reasonable size."""
    return type(value) is int and 0 <= value < 2**53


def _described(kind: _Kind, described: object, buffers: Sequence[bytes]) -> dict[str, object]:
    """Return the fields of a message that are not in its body by name."""
    if not issubclass(kind.model, PackedMessage):
        return {**_arrays(described, buffers, kind.arrays)}
    if not isinstance(described, bytes) or buffers:
        raise ValueError("not packed")
    return kind.model.unpacked(described)


def _arrays(
    described: object, buffers: Sequence[bytes], expected: tuple[str, ...]
) -> dict[str, np.ndarray[Any, Any]]:
    """Rebuild the arrays of a message; they are read-only and aligned, as `bytes` always are."""
    if not isinstance(described, list) or len(described) != len(buffers):
        raise ValueError("arrays and buffers do not match")
    arrays: dict[str, np.ndarray[Any, Any]] = {}
    for entry, buffer in zip(described, buffers, strict=True):
        if not (isinstance(entry, list) and len(entry) == 3 and isinstance(entry[2], list)):
            raise ValueError("bad array description")
        name, dtype_name, shape = entry
        if name not in expected or dtype_name not in _DTYPES:
            raise ValueError("unexpected array")
        if not all(_is_count(length) for length in shape) or len(shape) > 3:
            raise ValueError("bad array shape")
        dtype = _DTYPES[dtype_name]
        if math.prod(shape) * dtype.itemsize != len(buffer):
            raise ValueError("array shape does not match its bytes")
        arrays[name] = np.frombuffer(bytes(buffer), dtype=dtype).reshape(shape)
    return arrays


_DTYPES = {name: np.dtype(name) for name in ("<f4", "<f8", "|u1", "|i1", "<i4", "<i8")}
