"""One author's log: its entries, and the newest revision of their poses.

See `observation_log` for what they are for.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from protocol.log.pose_coding import PoseSteps, PoseTable
from protocol.number_ranges import Range, ranges_of

Verdict = Literal["new", "same", "different"]


class Author(NamedTuple):
    """A robot in one of its lives: one that lost its log begins a new life with entry 1."""

    robot: str
    life: int


@dataclass(frozen=True, slots=True)
class Entry:
    """One observation.

    Attributes:
        payload: what was observed; opaque here.
        pose: (x [mm], y [mm], theta [0.1 mrad]) it was first told with, map frame.
        version: number of the pose revision that this pose belongs to; 0 before the first.
    """

    payload: bytes
    pose: PoseSteps
    version: int

    def packed(self) -> bytes:
        """Return its bytes for checksums."""
        return struct.pack("<iiiqI", *self.pose, self.version, len(self.payload)) + self.payload


@dataclass(frozen=True, slots=True, eq=False)
class PoseRevision:
    """Newer poses of an author's first entries.

    Attributes:
        version: counts an author's revisions from 1.
        poses: (m, 3) int32, row k is the pose of entry k + 1 in the map frame, in steps.
    """

    version: int
    poses: PoseTable

    def packed(self) -> bytes:
        """Return its bytes for checksums."""
        return struct.pack("<q", self.version) + self.poses.astype("<i4").tobytes()


class Told(NamedTuple):
    """An entry, and the peer that told it: first hand if that is its author's robot."""

    what: Entry
    by: str


class AuthorLog:
    """What is held of one author.

    Attributes:
        entries: by number; any may be missing.
        count: entries 1 to `count` are all held.
        top: highest number that is held; 0 for none.
        revision: the newest that is held, or None.
        revision_by: the peer that told it.
        bytes: size of all payloads.
    """

    def __init__(self) -> None:
        self.entries: dict[int, Told] = {}
        self.count = 0
        self.top = 0
        self.revision: PoseRevision | None = None
        self.revision_by = ""
        self.bytes = 0
        self._sums = [0]  # of the first k entries, k = 0 to count
        self._beyond: dict[int, None] = {}  # numbers held after the first gap

    @property
    def version(self) -> int:
        """Version of the newest revision held; 0 for none."""
        return self.revision.version if self.revision else 0

    @property
    def poses(self) -> PoseTable:
        """The poses (m, 3) of the newest revision held; of none, no poses."""
        return self.revision.poses if self.revision else np.zeros((0, 3), dtype=np.int32)

    def pose(self, number: int) -> PoseSteps:
        """Return where an entry that is held was made, by the newest poses held, map frame."""
        if number <= len(self.poses):
            x, y, theta = self.poses[number - 1].tolist()
            return x, y, theta
        return self.entries[number].what.pose

    def beyond(self) -> list[Range]:
        """Return the ranges of numbers that are held after the first gap."""
        return ranges_of(sorted(self._beyond))

    def missing(self, top: int) -> Iterable[int]:
        """Yield the numbers up to `top` that are not held, ascending."""
        return (n for n in range(self.count + 1, top + 1) if n not in self.entries)

    def checksum(self, count: int) -> int:
        """Return the CRC-32 over the first `count` entries and the newest revision."""
        return self.checksum_of(count, self.revision)

    def checksum_of(self, count: int, revision: PoseRevision | None) -> int:
        """Return the CRC-32 over the first `count` entries and a revision."""
        return zlib.crc32(revision.packed() if revision else b"", self._sums[count])

    def compare(self, number: int, entry: Entry) -> Verdict:
        """Return how an entry that is told compares to what is held under its number."""
        held = self.entries.get(number)
        if held is None:
            return "new"
        return "same" if held.what == entry else "different"

    def vouch(self, number: int, by: str) -> None:
        """Note that `by` told the entry that is held, too, and knows best."""
        self.entries[number] = self.entries[number]._replace(by=by)

    def put(self, number: int, entry: Entry, by: str) -> None:
        """Hold an entry, in place of another one if there is."""
        before = self.entries.get(number)
        self.bytes += len(entry.payload) - (len(before.what.payload) if before else 0)
        self.entries[number] = Told(entry, by)
        self.top = max(self.top, number)
        if number <= self.count:
            self.count = number - 1
            del self._sums[number:]
        else:
            self._beyond[number] = None
        while (told := self.entries.get(self.count + 1)) is not None:
            self.count += 1
            self._beyond.pop(self.count, None)
            self._sums.append(zlib.crc32(told.what.packed(), self._sums[-1]))
