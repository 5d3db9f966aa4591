"""Golden frames: bytes of this major version as they were first sent, and what they mean.

`python -m tests.golden.wire.frames` adds a frame for each message type that has none yet. It never
touches one that exists: those frames are out in the world, and must decode for the whole major.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgpack

from protocol.codec import KINDS, encode
from protocol.messages import PROTOCOL_VERSION, Message
from tests.unit.protocol.samples import examples, header_of

FOLDER = Path(__file__).parent / f"v{PROTOCOL_VERSION[0]}"


def meaning(message: Message) -> dict[str, Any]:
    """Return all values of a message as plain JSON values."""
    kind = KINDS[message.type]
    values: dict[str, Any] = message.model_dump(mode="json", include=set(kind.plain))
    for name in kind.arrays:
        array = getattr(message, name)
        values[name] = {"dtype": array.dtype.str, "values": array.tolist(), "shape": array.shape}
    return json.loads(json.dumps(values))  # type: ignore[no-any-return]


def add_missing(folder: Path) -> list[str]:
    """Write the frames of all types that have none in `folder`; return those types."""
    folder.mkdir(parents=True, exist_ok=True)
    added = []
    for name, message in sorted(examples().items()):
        path = folder / f"{name}.bin"
        if path.exists():
            continue
        header = header_of(message, sequence=7, acknowledged=3)
        path.write_bytes(msgpack.packb(encode(header, message)))
        text = json.dumps(meaning(message), indent=1, sort_keys=True) + "\n"
        path.with_suffix(".json").write_text(text, encoding="utf-8")
        added.append(name)
    return added


if __name__ == "__main__":
    print("added:", ", ".join(add_missing(FOLDER)) or "nothing, every type has its frame")
