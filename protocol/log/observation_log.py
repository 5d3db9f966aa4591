"""All robots' observations and where they were made: what a member of the team holds.

Each robot writes a log of its own: entries 1, 2, 3 ... that never change once they were told, each
with the pose it was first told with. Poses get better, so they are told apart from the entries: a
`PoseRevision` holds newer poses of the entries 1 to m, and the newest revision replaces all older
ones. An entry beyond m has its own pose. So the map is a function of the entries and the newest
revisions: members that hold the same hold the same map, in whatever order, how often and by whom
they were told.

An entry that was told in an older revision than the newest but lies beyond its m cannot be, if the
author keeps the rules. It is held all the same, with its own pose: refusing it would make the map
depend on the order of arrival.

Source: Pfingsthorn et al. 2007, sections 2 and 3.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from protocol.log.pose_coding import PoseSteps, PoseTable
from protocol.number_ranges import Range, ranges_of

_PAST_MOST = 32
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


@dataclass(frozen=True, slots=True)
class Changes:
    """What the map must draw anew.

    Attributes:
        entries: that are new, as (author, number); numbers may leave gaps that are filled later.
        replaced: entries whose content was wrong until now.
        repositioned: authors with a new pose revision.
        forgotten: authors that never were; all of theirs must go.
    """

    entries: tuple[tuple[Author, int], ...]
    replaced: tuple[tuple[Author, int], ...]
    repositioned: tuple[Author, ...]
    forgotten: tuple[Author, ...] = ()


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


@dataclass(slots=True)
class _News:
    """What has changed since it was last asked for; dicts for their order."""

    entries: dict[tuple[Author, int], None] = field(default_factory=dict)
    replaced: dict[tuple[Author, int], None] = field(default_factory=dict)
    repositioned: dict[Author, None] = field(default_factory=dict)
    forgotten: dict[Author, None] = field(default_factory=dict)


class ObservationLog:
    """The logs of all authors, as far as they are held; one of them is this robot's own.

    Args:
        robot: this robot's name.
        life: which life of it this is.

    Attributes:
        past: the last of this robot's own revisions before the newest, by version.
    """

    def __init__(self, robot: str, life: int = 0) -> None:
        self.me = Author(robot, life)
        self.logs: dict[Author, AuthorLog] = {self.me: AuthorLog()}
        self.past: dict[int, PoseTable] = {}
        self._news = _News()

    @property
    def own(self) -> AuthorLog:
        """What this robot wrote in this life."""
        return self.logs[self.me]

    def authors(self) -> list[Author]:
        """Return all authors something is held of, sorted."""
        return sorted(self.logs)

    def of(self, author: Author) -> AuthorLog:
        """Return what is held of an author; an empty log for one that is not known."""
        return self.logs.get(author) or AuthorLog()

    def append(self, payload: bytes, pose: PoseSteps) -> int:
        """Write an entry of this robot's own, told in its newest revision; return its number."""
        number = self.own.count + 1
        self.put(self.me, number, Entry(payload, pose, self.own.version), self.me.robot)
        return number

    def revise(self, poses: PoseTable, told: int) -> None:
        """Replace the poses of this robot's own n entries by (n, 3) int32 in steps, map frame.

        Those of the first `told` entries become a new revision, if there are any. The others nobody
        has heard of yet: they will be told with the new pose as their first.

        Raises:
            ValueError: not one pose for each entry.
        """
        if poses.shape != (self.own.count, 3):
            raise ValueError(f"poses of shape {poses.shape} for {self.own.count} entries")
        if told:
            held = np.array(poses[:told], dtype=np.int32)
            held.flags.writeable = False
            self.past[self.own.version] = self.own.poses
            self.past.pop(self.own.version - _PAST_MOST, None)
            revision = PoseRevision(self.own.version + 1, held)
            self.put_revision(self.me, revision, self.me.robot)
        for number in range(told + 1, self.own.count + 1):
            x, y, theta = poses[number - 1].tolist()
            payload = self.own.entries[number].what.payload
            entry = Entry(payload, (x, y, theta), self.own.version)
            self.own.put(number, entry, self.me.robot)
        self._news.repositioned[self.me] = None

    def own_revision(self, version: int) -> PoseRevision | None:
        """Return a revision of this robot's own; None for 0, before the first.

        Raises:
            KeyError: it is none of the last ones.
        """
        if version == self.own.version or not version:
            return self.own.revision if version else None
        return PoseRevision(version, self.past[version])

    def put(self, author: Author, number: int, entry: Entry, by: str) -> None:
        """Hold an entry that `by` told; the caller has judged it."""
        log = self.logs.setdefault(author, AuthorLog())
        new = number not in log.entries
        log.put(number, entry, by)
        if new:
            self._news.entries[author, number] = None
        elif (author, number) not in self._news.entries:
            self._news.replaced[author, number] = None

    def put_revision(self, author: Author, revision: PoseRevision | None, by: str) -> None:
        """Hold a revision that `by` told, or none; the caller has judged it."""
        log = self.logs.setdefault(author, AuthorLog())
        log.revision, log.revision_by = revision, by
        self._news.repositioned[author] = None

    def forget(self, author: Author) -> None:
        """Hold nothing more of an author that turned out to be made up."""
        del self.logs[author]
        news = self._news
        news.repositioned.pop(author, None)
        for told in (news.entries, news.replaced):
            for key in [key for key in told if key[0] == author]:
                del told[key]
        news.forgotten[author] = None

    def begin_life(self, life: int, count: int, version: int) -> None:
        """Go on in a new life: others hold more of the one so far.

        Of that one stay the first `count` entries, and the poses up to `version`; what came after
        is written once more, as the first entries of the new life.
        """
        before, own = self.me, self.own
        poses = {number: own.pose(number) for number in sorted(own.entries)}
        self.forget(before)
        self.me = Author(before.robot, life)
        self.logs[before], self.logs[self.me] = AuthorLog(), AuthorLog()
        for number, told in sorted(own.entries.items()):
            if number <= count:
                self.put(before, number, told.what, told.by)
            else:
                self.append(told.what.payload, poses[number])
        if own.revision is not None and own.version <= version:
            self.put_revision(before, own.revision, own.revision_by)

    def take_changes(self) -> Changes:
        """Return what has changed since the last call: all that must be drawn, or drawn anew.

        Any entry that is held may be drawn, whether there is a gap before it or not: the map needs
        no order. What is forgotten goes first: it may have come back since.
        """
        news, self._news = self._news, _News()
        entries, replaced = tuple(news.entries), tuple(news.replaced)
        return Changes(entries, replaced, tuple(news.repositioned), tuple(news.forgotten))

    def digest(self, authors: Sequence[Author] | None = None) -> str:
        """Return the SHA-256 of the map: entries with their newest poses, hexadecimal.

        Equal digests mean equal maps. Hashed are of each author, sorted: name and life; number,
        pose and payload of each entry, ascending.

        Args:
            authors: whose entries count; all by default.
        """
        sha = hashlib.sha256()
        for author in sorted(self.logs if authors is None else authors):
            log = self.of(author)
            if not log.entries:
                continue
            name = author.robot.encode()
            sha.update(struct.pack("<BqI", len(name), author.life, len(log.entries)) + name)
            for number in sorted(log.entries):
                payload = log.entries[number].what.payload
                sha.update(struct.pack("<qiiiI", number, *log.pose(number), len(payload)))
                sha.update(payload)
        return sha.hexdigest()
