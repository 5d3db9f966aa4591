"""What was sent once in this major version is understood for ever."""

from __future__ import annotations

import json
from pathlib import Path

import msgpack
import pytest

from protocol.codec import KINDS, Header, decode
from protocol.messages import PROTOCOL_VERSION
from tests.golden.wire.frames import FOLDER, add_missing, meaning

FRAMES = sorted(FOLDER.glob("*.bin"))


@pytest.mark.parametrize("path", FRAMES, ids=lambda path: path.stem)
def test_a_golden_frame_means_what_it_meant(path: Path) -> None:
    """Fields that came later have their defaults and are not in the expectation."""
    header, message = decode(msgpack.unpackb(path.read_bytes()))
    assert header == Header(path.stem, "robot1", "server", 7, 12.5, header.version, 3)
    assert (1, 0) <= header.version <= PROTOCOL_VERSION
    expected = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    meant = meaning(message)
    assert {key: meant[key] for key in expected} == expected


def test_every_type_has_its_golden_frame() -> None:
    names = [path.stem for path in FRAMES]
    assert names == sorted(KINDS), "add the new ones: python -m tests.golden.wire.frames"


def test_golden_frames_are_never_overwritten(tmp_path: Path) -> None:
    added = add_missing(tmp_path)
    assert sorted(added) == sorted(KINDS)
    (tmp_path / "ping.bin").write_bytes(b"as it was")
    (tmp_path / "bid.bin").unlink()
    assert add_missing(tmp_path) == ["bid"]
    assert (tmp_path / "ping.bin").read_bytes() == b"as it was"
