"""What peers asked for, and how it is answered: what several want is broadcast once.

The peers take turns, and no more than `answer_bytes_s` leave, so that a thousand missing entries do
not block the air, and a peer that asks for everything again and again only waits for itself.
"""

from __future__ import annotations

from collections.abc import Iterator

from protocol.log.author_log import Author, Entry
from protocol.log.earlier_poses import own_poses_at
from protocol.log.framing import FRAME_OVERHEAD, fill_frame
from protocol.log.messages import (
    LogWant,
    Observations,
    PoseSet,
    authors_of,
    observations,
    pose_set,
)
from protocol.log.observation_log import ObservationLog
from protocol.log.settings import LogSyncSettings
from protocol.messages import EVERYONE
from protocol.number_ranges import numbers_of

Key = tuple[Author, int]  # number 0 stands for the author's newest revision


class Answering:
    """The open requests.

    Args:
        log: what is held.
        settings: how much and how soon.

    Attributes:
        due: when `answer` is due [s], or None.
        wanted: by peer, what it wants and did not get yet, and when it asked [s].
    """

    def __init__(self, log: ObservationLog, settings: LogSyncSettings) -> None:
        self.due: float | None = None
        self.wanted: dict[str, dict[Key, float]] = {}
        self._log = log
        self._settings = settings
        self._bases: dict[str, int] = {}  # the version of this robot's poses that a peer holds
        self._budget = 0.0  # [bytes]
        self._filled = 0.0  # when the budget was last filled up [s]

    def take(self, peer: str, message: LogWant, now: float) -> None:
        """Note what a peer wants.

        Raises:
            ValueError: what is wrong with the message; a fault of the peer.
        """
        authors = authors_of(message)
        wanted = self.wanted.setdefault(peer, {})
        for index, author in enumerate(authors):
            log = self._log.of(author)
            ranges = [(first, last) for i, first, last in message.ranges if i == index]
            for number in numbers_of(ranges, self._settings.request_entries):
                if len(wanted) > 2 * self._settings.request_entries:
                    break
                if number in log.entries:
                    wanted.setdefault((author, number), now)
            # New poses come last: they may be told as differences to those of the entries.
            if 0 < message.versions[index] <= log.version:
                wanted.setdefault((author, 0), now)
                if author == self._log.me:
                    self._bases[peer] = message.bases[index] - 1 if message.bases else -1
        if not wanted:
            self.forget(peer)
        self._schedule(now)

    def overheard(self, author: Author, numbers: tuple[int, ...]) -> None:
        """Somebody else told this to all: it need not be told again."""
        self._done(list(self.wanted), [(author, number) for number in numbers])

    def forget(self, peer: str) -> None:
        """Give a peer no answer."""
        self.wanted.pop(peer, None)
        self._bases.pop(peer, None)

    def answer(self, now: float) -> list[tuple[str, Observations | PoseSet]]:
        """Return what is told to whom now."""
        rate, most = self._settings.answer_bytes_s, float(self._settings.frame_bytes)
        self._budget = min(self._budget + rate * (now - self._filled), max(most, rate * 0.5))
        self._filled = now
        for author in self._log.authors():
            if self._log.of(author).revision is None:  # it was forged, and dropped
                self.overheard(author, (0,))
        answers: list[tuple[str, Observations | PoseSet]] = []
        ripe = now - self._settings.answer_delay_s
        while self._budget > 0.0 and (peer := self._turn(ripe)) is not None:
            to, message, size = self._next(peer, ripe)
            self._budget -= size
            answers.append((to, message))
        self._schedule(now)
        return answers

    def _turn(self, ripe: float) -> str | None:
        """Return the peer whose turn it is, of those that asked by `ripe` [s], or None."""
        peers = (peer for peer, wanted in self.wanted.items() if self._oldest(wanted) <= ripe)
        return next(peers, None)

    def _oldest(self, wanted: dict[Key, float]) -> float:
        """Return when a peer asked for the first of what it wants [s]."""
        return next(iter(wanted.values()))

    def _schedule(self, now: float) -> None:
        """Set when to answer next."""
        self.due = None
        if self.wanted:
            ripe = min(map(self._oldest, self.wanted.values())) + self._settings.answer_delay_s
            self.due = max(ripe, self._filled - self._budget / self._settings.answer_bytes_s)
            self.due = max(self.due, now + 0.01)

    def _next(self, peer: str, ripe: float) -> tuple[str, Observations | PoseSet, int]:
        """Return the next answer to a peer, whom else it is for, and its size."""
        author, number = next(iter(self.wanted[peer]))
        several = self._several((author, number))
        log, robot = self._log.of(author), self._log.me.robot
        message: Observations | PoseSet
        if number == 0:
            message = self._poses(author, peer, several)
            size = FRAME_OVERHEAD + len(message.data)
            keys = [(author, 0)]
        else:
            version = log.entries[number].what.version
            alike = self._alike(peer, (author, version), several, ripe)
            told, size = fill_frame(alike, self._settings.frame_bytes)
            message = observations(author, told, robot, version)
            keys = [(author, n) for n, _ in told]
        self.wanted[peer] = self.wanted.pop(peer)  # the others' turn
        self._done(list(self.wanted) if several else [peer], keys)
        return EVERYONE if several else peer, message, size

    def _poses(self, author: Author, peer: str, several: bool) -> PoseSet:
        """Return the newest poses: one's own as differences, if all that ask hold the same."""
        log = self._log.of(author)
        before = None
        if author == self._log.me:
            asking = [p for p, wanted in self.wanted.items() if (author, 0) in wanted]
            bases = [self._bases.get(p, -1) for p in (asking if several else [peer])]
            if min(bases) == max(bases):
                before = own_poses_at(self._log, bases[0], len(log.poses))
        return pose_set(author, log.version, log.poses, self._log.me.robot, before)

    def _alike(
        self, peer: str, source: tuple[Author, int], several: bool, ripe: float
    ) -> Iterator[tuple[int, Entry]]:
        """Yield what can go in the same frame: of one author and version, ascending."""
        author, version = source
        entries = self._log.of(author).entries
        asked = self.wanted[peer].items()
        for number in sorted(n for (a, n), at in asked if a == author and n and at <= ripe):
            entry = entries[number].what
            if entry.version == version and self._several((author, number)) == several:
                yield number, entry

    def _several(self, key: Key) -> bool:
        """Whether so many want it that it is broadcast."""
        asking = sum(key in wanted for wanted in self.wanted.values())
        return asking >= self._settings.broadcast_from

    def _done(self, peers: list[str], keys: list[Key]) -> None:
        """Cross out what peers need not be told any more."""
        for peer in peers:
            for key in keys:
                self.wanted[peer].pop(key, None)
            if not self.wanted[peer]:
                self.forget(peer)
