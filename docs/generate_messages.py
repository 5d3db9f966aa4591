"""Writes `docs/messages.md` from the messages themselves: `python docs/generate_messages.py`."""

from __future__ import annotations

import inspect
import sys
import types
import typing
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent.parent))

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from mapping.geometry import Pose2
from protocol import fleet, messages, world_messages
from protocol.body import Body, Drive, Lidar, VictimDetector
from protocol.codec import (
    MAX_BODY_BYTES,
    MAX_FRAME_BYTES,
    MAX_HEADER_BYTES,
    MAX_PARTS,
)
from protocol.fields import ArrayField
from protocol.packing import PackedMessage

PAGE = Path(__file__).parent / "messages.md"
_PARTS = (Body, Lidar, Drive, VictimDetector)

_HEAD = """# Messages

Generated from `protocol/` by `python docs/generate_messages.py`; do not edit.

Protocol version {major}.{minor}. A frame is `[header, body, array, ...]`: at most {parts} parts
and {frame} bytes. The header (msgpack, at most {head} bytes) is the list
`[[major, minor], type, source, to, sequence, stamp_s, acknowledged]`. The body (msgpack, at most
{body} bytes) is a map of the fields; its key `~` lists `[field, dtype, shape]` of the arrays, whose
raw little-endian bytes follow in that order. Of a message that is marked as packed, `~` is one byte
string with all its fields, as its class in `protocol/` writes them, and no arrays follow. Minor
versions only add: unknown fields are ignored, unknown types counted and dropped. Another major is
refused.

Names are 1 to 32 of `A-Z a-z 0-9 - _ .`; `to` may also be `*`, every robot in reach. A pose is
`[x, y, theta]` in metres and radians. Every number is finite.
"""


def page() -> str:
    """Return the whole page."""
    major, minor = messages.PROTOCOL_VERSION
    head = _HEAD.format(
        major=major,
        minor=minor,
        parts=MAX_PARTS,
        frame=MAX_FRAME_BYTES,
        head=MAX_HEADER_BYTES,
        body=MAX_BODY_BYTES,
    )
    sections = [head]
    for title, union in (
        ("Fleet: robots, server, operators, observers", fleet.FleetMessage),
        ("World: a body, and the clock of a simulated mission", world_messages.WorldMessage),
    ):
        sections.append(f"## {title}\n")
        models = typing.get_args(typing.get_args(union)[0])
        sections += [_section(model, f"`{model.model_fields['type'].default}`") for model in models]
    sections.append("## Parts of messages\n")
    sections += [_section(model, model.__name__) for model in _PARTS]
    return "\n".join(sections)


def _section(model: Any, title: str) -> str:
    """Return a heading, the docstring and a table of the fields."""
    fields = {name: field for name, field in model.model_fields.items() if name != "type"}
    lines = [f"### {title}\n", inspect.getdoc(model) or "", ""]
    if issubclass(model, PackedMessage):
        lines += ["Packed.", ""]
    if fields:
        lines += ["| field | is | default |", "|---|---|---|"]
        lines += [
            f"| `{name}` | {_kind(field)} | {_default(field)} |" for name, field in fields.items()
        ]
        lines.append("")
    return "\n".join(lines)


def _default(field: FieldInfo) -> str:
    if field.default is PydanticUndefined:
        return "required"
    if isinstance(field.default, _PARTS):
        return "see below"
    return f"`{field.default!r}`"


def _kind(field: FieldInfo) -> str:
    """Return what a field holds, in words."""
    for meta in field.metadata:
        if isinstance(meta, ArrayField):
            shape = ", ".join("n" if size is None else str(size) for size in meta.shape)
            comma = "," if len(meta.shape) == 1 else ""
            return f"array {meta.dtype} ({shape}{comma}), at most {meta.max_elements} elements"
    return _words(field.annotation, field.metadata)


def _words(kind: Any, metadata: list[Any]) -> str:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        inner = [
            m for a in arguments[1:] for m in (a.metadata if isinstance(a, FieldInfo) else [a])
        ]
        return _words(arguments[0], inner)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(_words(argument, []) for argument in arguments)
    if origin is typing.Literal:
        return ", ".join(f"`{argument}`" for argument in arguments)
    if origin is tuple and arguments[-1] is ...:
        return f"list of: {_words(arguments[0], [])}{_limits(metadata)}"
    if origin is tuple:
        return f"{len(arguments)} times: {_words(arguments[0], [])}"
    named = {Pose2: "pose", type(None): "nothing", bool: "yes or no", int: "integer"}
    named |= {float: "number", str: "text"} | {part: part.__name__ for part in _PARTS}
    return named[kind] + _limits(metadata)


def _limits(metadata: list[Any]) -> str:
    """Return the bounds of a value."""
    signs = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<", "max_length": "length <="}
    bounds = [
        f"{sign} {getattr(meta, key)}"
        for meta in metadata
        for key, sign in signs.items()
        if getattr(meta, key, None) is not None
    ]
    named = any(
        getattr(getattr(meta, "func", None), "__name__", "") == "_name" for meta in metadata
    )
    return (", a name" if named else "") + "".join(f", {bound}" for bound in bounds)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE}")
