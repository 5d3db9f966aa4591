"""What a member lacks, and whom it asks for it.

Everything is asked of one peer at a time: of the author if it is here, else of one that claims to
hold it, the same one that anybody else would choose, so that two that lack the same ask the same
peer, which then answers both at once. After a time-out the next peer is asked.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from protocol.log.author_log import Author
from protocol.log.messages import RANGES_IN_FRAME, LogWant, listing
from protocol.log.observation_log import ObservationLog
from protocol.log.peers import Claim, Peers
from protocol.log.settings import LogSyncSettings
from protocol.number_ranges import ranges_of

Key = tuple[Author, int]  # number 0 stands for the author's newest revision

_SOON = 2.0  # [s]; a member that lacks a lot waits until all have said what they hold
_NEXT = 0.3  # [s]; and less while it is being answered
_JITTER = 0.3  # [s]; so that not all ask at the same instant
_GROWTH = 1.25  # of the time-out with every attempt
_PATIENT = 8  # so often an author is asked for its own word on something that is held
_NEIGHBOURS = 64  # so many numbers in a row are asked of the same peer


@dataclass(slots=True)
class _Asked:
    """Something that was asked for: how often, and when it is asked for again [s]."""

    attempts: int
    deadline: float


class Asking:
    """What is asked for.

    Args:
        log: what is held.
        peers: who is there, and what they hold.
        settings: how many and how often.
        rng: for the jitter.

    Attributes:
        due: when `ask` is due [s], or None.
        asked: what was asked for and has not come.
    """

    def __init__(
        self,
        log: ObservationLog,
        peers: Peers,
        settings: LogSyncSettings,
        rng: np.random.Generator,
    ) -> None:
        self.due: float | None = None
        self.asked: dict[Key, _Asked] = {}
        self._log = log
        self._peers = peers
        self._settings = settings
        self._rng = rng
        self._last = -np.inf
        self._noticed: float | None = None
        self._jitter = float(rng.uniform(0.0, _JITTER))
        self._doubted: dict[Key, None] = {}
        self._doubted_at: dict[Author, float] = {}

    @property
    def lacking(self) -> bool:
        """Whether something is lacking, asked for or not yet."""
        return self._noticed is not None or bool(self.asked)

    def doubt(self, author: Author, upto: int, now: float) -> bool:
        """Ask the author, who is here, for all that others told of it; return whether it is new.

        Args:
            author: of whom something that is held seems to be wrong.
            upto: the highest number that may be.
            now: mission time [s].
        """
        if now - self._doubted_at.get(author, -np.inf) < self._settings.backoff_max_s:
            return False
        self._doubted_at[author] = now
        log = self._log.of(author)
        relayed = [n for n in range(1, upto + 1) if log.entries[n].by != author.robot]
        if log.revision is not None and log.revision_by != author.robot:
            relayed.insert(0, 0)
        for number in relayed:
            self._doubted[author, number] = None
        return True

    def arrived(self, author: Author, numbers: tuple[int, ...], peer: str, now: float) -> None:
        """Note that a peer told something; what else was asked for gets more time."""
        progress = False
        for number in numbers:
            progress |= self.asked.pop((author, number), None) is not None
            if peer == author.robot:
                self._doubted.pop((author, number), None)
        if progress:
            patience = now + self._settings.request_timeout_s
            for asked in self.asked.values():
                if asked.deadline > now:
                    asked.deadline = max(asked.deadline, patience)

    def schedule(self, now: float) -> None:
        """Set when to ask next, after anything that may have changed what is lacking."""
        waiting = [asked.deadline for asked in self.asked.values() if asked.deadline > now]
        expiry = min(waiting) if waiting else None
        many, patience = self._settings.request_many, self._settings.request_patience_s
        if expiry is not None and len(waiting) < many:
            expiry = (expiry // patience + 1.0) * patience + self._jitter
        if len(waiting) > self._settings.request_entries // 2:
            self.due = expiry
            return
        lacking = len(self._lacking(now, many))
        if not lacking:
            self._noticed, self.due = None, expiry
            return
        if self._noticed is None:
            self._noticed = now
        if lacking >= many:
            due = max(now, self._last) + (_NEXT if self.asked else _SOON)
        else:  # all ask at about the same time, so that one answer serves several
            due = (now // patience + 1.0) * patience
        due += self._jitter
        self.due = min(due, np.inf if self.due is None else self.due)

    def ask(self, now: float) -> list[tuple[str, LogWant]]:
        """Return what is asked of whom now."""
        self._give_up(now)
        waiting = sum(asked.deadline > now for asked in self.asked.values())
        room = self._settings.request_entries - waiting
        spread = 1.0 + 0.25 * float(self._rng.random())
        by_peer: dict[str, list[Key]] = {}
        for key in self._lacking(now, room):
            asked = self.asked.setdefault(key, _Asked(0, 0.0))
            peer = self._choose(key, asked.attempts, now)
            grown = self._settings.request_timeout_s * _GROWTH ** min(asked.attempts, 30)
            asked.deadline = now + min(grown, self._settings.backoff_max_s) * spread
            asked.attempts += 1
            if peer is not None:
                by_peer.setdefault(peer, []).append(key)
        self._last, self._noticed, self.due = now, None, None
        self._jitter = float(self._rng.uniform(0.0, _JITTER))
        self.schedule(now)
        return [(peer, self._want(by_peer[peer])) for peer in sorted(by_peer)]

    def _give_up(self, now: float) -> None:
        """Forget what nobody here holds any more, and doubts that no answer came to."""
        for key, asked in list(self.asked.items()):
            if key in self._doubted and asked.attempts >= _PATIENT:
                del self._doubted[key]
            if now - asked.deadline > self._settings.backoff_max_s:
                del self.asked[key]

    def _lacking(self, now: float, most: int) -> list[Key]:
        """Return what is lacking, not waited for, and held by somebody here; at most `most`."""
        keys: list[Key] = []
        for key in self._lacked(now):
            if len(keys) >= most:
                break
            asked = self.asked.get(key)
            if asked is None or asked.deadline <= now:
                keys.append(key)
        return keys

    def _lacked(self, now: float) -> Iterator[Key]:
        """Yield all that is lacking and held by somebody here, authors sorted, numbers up."""
        for key in list(self._doubted):
            if self._peers.lives(key[0], now):
                yield key
        for author in self._peers.authors():
            claims = self._peers.claims(author, now)
            if author == self._log.me or not claims or self._peers.unborn(author, now):
                continue
            log = self._log.of(author)
            if self._version(author, claims, now) > log.version:
                yield author, 0
            top = min(
                max(claim.top for claim in claims.values()),
                log.count + self._settings.window_entries,
                self._settings.author_entries_most,
            )
            for number in log.missing(top):
                if any(claim.holds(number) for claim in claims.values()):
                    yield author, number

    def _version(self, author: Author, claims: dict[str, Claim], now: float) -> int:
        """Return the newest revision there is: by the author's own word if it is here."""
        if self._peers.lives(author, now):
            return claims[author.robot].version if author.robot in claims else 0
        return max(claim.version for claim in claims.values())

    def _choose(self, key: Key, attempts: int, now: float) -> str | None:
        """Return whom to ask for something, or None if nobody here holds it."""
        author, number = key
        if key in self._doubted:
            return author.robot
        claims = self._peers.claims(author, now)
        if number:
            able = [name for name, claim in claims.items() if claim.holds(number)]
        else:
            newest = self._version(author, claims, now) if claims else 0
            able = [name for name, claim in claims.items() if claim.version >= newest]
        if not able:
            return None
        part = f"{author.robot} {author.life} {number // _NEIGHBOURS} "
        able.sort(key=lambda name: (name != author.robot, zlib.crc32((part + name).encode()), name))
        return able[attempts % len(able)]

    def _want(self, keys: list[Key]) -> LogWant:
        """Return the message that asks for something."""
        authors = sorted({author: None for author, _ in keys})
        versions = tuple(
            max(1, self._log.of(author).version + ((author, 0) not in self._doubted))
            if (author, 0) in keys
            else 0
            for author in authors
        )
        ranges = [
            (index, first, last)
            for index, author in enumerate(authors)
            for first, last in ranges_of(sorted(n for a, n in keys if a == author and n))
        ]
        return LogWant(
            **listing(authors),
            versions=versions,
            bases=tuple(self._base(author, keys) for author in authors),
            ranges=tuple(ranges[:RANGES_IN_FRAME]),
        )

    def _base(self, author: Author, keys: list[Key]) -> int:
        """Return to what an author's poses may be told as differences.

        That is tried once, and only if the same request asks for all entries that lack: the
        differences may speak of them.
        """
        asked = self.asked.get((author, 0))
        if asked is None or asked.attempts > 1 or (author, 0) in self._doubted:
            return 0
        if any(key[0] == author and key not in keys for key in self.asked):
            return 0
        return 1 + self._log.of(author).version
