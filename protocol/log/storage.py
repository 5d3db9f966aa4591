"""An observation log as bytes, for a robot that is restarted with its log kept."""

from __future__ import annotations

import zlib
from typing import Any

import msgpack
import numpy as np

from protocol.errors import DamagedLogError
from protocol.fields import is_name
from protocol.log.author_log import Author, Entry, PoseRevision
from protocol.log.observation_log import ObservationLog

_MAGIC = b"observation log 1\n"


def dump(log: ObservationLog) -> bytes:
    """Return all that a log holds as bytes."""
    authors = []
    for author in log.authors():
        held = log.of(author)
        entries = [
            (number, told.what.payload, told.what.pose, told.what.version, told.by)
            for number, told in sorted(held.entries.items())
        ]
        poses = held.revision.poses.astype("<i4").tobytes() if held.revision else b""
        authors.append((author, entries, held.version, poses, held.revision_by))
    body: bytes = msgpack.packb((log.me, authors))
    return _MAGIC + zlib.crc32(body).to_bytes(4, "little") + body


def load(data: bytes) -> ObservationLog:
    """Return the log that `dump` made these bytes of; all of it counts as changed.

    Raises:
        DamagedLogError: the bytes are cut, changed, or no log at all.
    """
    head = len(_MAGIC) + 4
    body = data[head:]
    if (
        not data.startswith(_MAGIC)
        or zlib.crc32(body).to_bytes(4, "little") != data[head - 4 : head]
    ):
        raise DamagedLogError(
            "the saved observation log is damaged: delete it, and the robot begins a new life"
        )
    try:
        me, authors = msgpack.unpackb(body)
        log = ObservationLog(*_author(me))
        for author, entries, version, poses, by in authors:
            _restore(log, _author(author), entries, (version, poses, by))
    except Exception as error:  # whatever a forged body provokes
        raise DamagedLogError(
            "the saved observation log is of another kind: delete it, and the robot begins a new "
            f"life ({type(error).__name__})"
        ) from None
    return log


def _author(value: Any) -> Author:
    """Check an author."""
    robot, life = value
    if not (is_name(robot) and isinstance(life, int)):
        raise ValueError("no author")
    return Author(robot, life)


def _restore(log: ObservationLog, author: Author, entries: Any, revision: Any) -> None:
    """Put back what was held of an author."""
    for number, payload, (x, y, theta), version, by in entries:
        if not (isinstance(payload, bytes) and isinstance(number, int) and number > 0):
            raise ValueError("no entry")
        entry = Entry(payload, (x, y, theta), version)
        entry.packed()  # raises for numbers that are none
        log.put(author, number, entry, str(by))
    version, poses, by = revision
    if version:
        table = np.frombuffer(poses, dtype="<i4").reshape(-1, 3)
        log.put_revision(author, PoseRevision(int(version), table), str(by))
