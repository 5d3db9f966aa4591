"""One member's copy of the team's observations and poses, as whoever draws them wants it."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from typing import Protocol

from mapping.geometry import Pose2
from protocol.log.author_log import Author
from protocol.log.observation_log import ObservationLog
from protocol.log.pose_coding import pose_of
from protocol.log.sync import LogSync


class HeldLog:
    """The observation log as a source of bytes and poses.

    Args:
        log: what is held.
    """

    def __init__(self, log: ObservationLog) -> None:
        self._log = log

    def payload(self, author: tuple[str, int], number: int) -> bytes:
        """Return the bytes of an entry that is held."""
        return self._log.of(Author(*author)).entries[number].what.payload

    def told_at(self, author: tuple[str, int], number: int) -> Pose2:
        """Return where an entry was made, as its author first said, map frame."""
        return pose_of(self._log.of(Author(*author)).entries[number].what.pose)

    def pose(self, author: tuple[str, int], number: int) -> Pose2:
        """Return where an entry was made, by the newest word on it, map frame."""
        return pose_of(self._log.of(Author(*author)).pose(number))

    def poses(self, author: tuple[str, int]) -> dict[int, Pose2]:
        """Return where the entries of an author were made, by the newest word on it, map frame."""
        log = self._log.of(Author(*author))
        return {number: pose_of(log.pose(number)) for number in sorted(log.entries)}

    def told_by(self, author: tuple[str, int], number: int) -> str:
        """Return the peer that told an entry that is held."""
        return self._log.of(Author(*author)).entries[number].by

    def checksum(self) -> int:
        """Return a CRC-32 of all that is held: two that hold the same have the same one."""
        total = 0
        for author in self._log.authors():
            log = self._log.of(author)
            if log.entries:
                held = f"{author.robot} {author.life} {log.count} {log.checksum(log.count)} "
                total = zlib.crc32((held + str(log.beyond())).encode(), total)
        return total


class Drawing(Protocol):
    """What is drawn of a copy of the observations; see `mapping.shared_map`."""

    def take_in(
        self,
        held: HeldLog,
        entries: Iterable[tuple[tuple[str, int], int]],
        repositioned: Iterable[tuple[str, int]],
        forgotten: Iterable[tuple[str, int]],
    ) -> list[tuple[tuple[tuple[str, int], int], str]]:
        """Follow what has changed; return the new entries that cannot be read, and why."""
        ...


def draw_changes(sync: LogSync, held: HeldLog, drawing: Drawing, now: float) -> None:
    """Let a map follow the log; an author that told what is no observation is to blame.

    Whoever only passed it on could not help it: it holds what the others hold.
    """
    changes = sync.log.take_changes()
    entries = [*changes.entries, *changes.replaced]
    bad = drawing.take_in(held, entries, changes.repositioned, changes.forgotten)
    for (author, number), reason in bad:
        if held.told_by(author, number) == author[0]:
            sync.fault(author[0], reason, now)
