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
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from protocol.log.author_log import Author, AuthorLog, Entry, PoseRevision
from protocol.log.pose_coding import PoseSteps, PoseTable

_PAST_MOST = 32


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
