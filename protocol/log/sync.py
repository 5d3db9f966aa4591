"""Keeps the observation logs of a team the same, with no master, over any links: sans-I/O.

Messages and time in, messages out. A member broadcasts what it observes, in batches; sees by the
numbers what it lacks, and by what others announce that they hold; asks one peer for it; and answers
from all that it holds, its own or not. So what one robot saw reaches all that are linked to it by
any chain of others, also when it is gone itself.

`intake` says what is believed, `standing` what becomes of those who tell what cannot be. A peer
that is isolated is neither heard nor answered nor asked.

Source: Pfingsthorn et al. 2007, section 2; anti-entropy by version vectors, Demers et al. 1987,
section 1.3.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from protocol.effects import Effect, Note, Send
from protocol.log.announcing import Announcing
from protocol.log.answering import Answering
from protocol.log.asking import Asking
from protocol.log.author_log import Author
from protocol.log.intake import Intake
from protocol.log.messages import (
    RANGES_IN_FRAME,
    LogHave,
    LogMessage,
    Observations,
    PoseSet,
    authors_of,
    listing,
)
from protocol.log.observation_log import ObservationLog
from protocol.log.peers import Claim, Peers
from protocol.log.pose_coding import PoseSteps, PoseTable, within_reach
from protocol.log.settings import LogSyncSettings
from protocol.log.telling import Telling
from protocol.messages import EVERYONE
from protocol.standing import Standing


class Outgoing(NamedTuple):
    """A message for one peer, or for `*`."""

    to: str
    message: LogMessage


def sends(channel: str, outgoing: Iterable[Outgoing]) -> list[Effect]:
    """Return the effects that send messages over a channel."""
    return [Send(channel, out.to, out.message) for out in outgoing]


class LogSync:
    """One member's part.

    Args:
        log: what it holds, empty or restored; what is in its own log counts as told.
        settings: how often and how much.
        rng: for the instants at which it speaks.
        now: mission time [s].
        team: names of all robots that can be authors; empty for anyone.

    Attributes:
        log: what it holds.
        standing: the faults of its peers.
        notes: lines for the log file; take them away with `take_notes`.
    """

    def __init__(
        self,
        log: ObservationLog,
        settings: LogSyncSettings,
        rng: np.random.Generator,
        now: float = 0.0,
        team: tuple[str, ...] = (),
    ) -> None:
        self.log = log
        self.settings = settings
        self.standing = Standing(settings.faults_to_isolate, settings.faults_window_s)
        self.notes: list[Note] = []
        self.peers = Peers(settings.away_s, settings.away_s + 1.5 * settings.announce_period_max_s)
        self.intake = Intake(log, self.peers, settings, team)
        self.asking = Asking(log, self.peers, settings, rng)
        self.answering = Answering(log, settings)
        self._announcing = Announcing(
            settings.announce_period_s, settings.announce_period_max_s, rng, now
        )
        self.telling = Telling(log, settings, self.peers)
        self._differing: dict[Author, None] = {}
        self._restored = log.own.count, log.own.version
        # What was held when the last two intervals of announcing ended, as in `_held`.
        self._before: list[dict[Author, tuple[int, int]]] = [{}, {}]

    @property
    def overtaken(self) -> bool:
        """Whether others hold more of this life than this member: it must begin a new one."""
        return self.intake.overtaken

    def begin_life(self, life: int, now: float) -> None:
        """Go on in a new life, after `overtaken`: what was written since the start is told in it.

        Args:
            life: one that this robot never lived.
            now: mission time [s].
        """
        self.log.begin_life(life, *self._restored)
        self.intake.overtaken = self.intake.restored = False
        self._restored = 0, 0
        self.telling = Telling(self.log, self.settings, self.peers)
        self.telling.count = 0
        self._changed(now)
        if self.log.own.count:
            self.telling.news(now)

    def append(self, payload: bytes, pose: PoseSteps, now: float) -> int:
        """Write an observation of one's own; return its number. It is told with the next batch.

        Raises:
            ValueError: the payload is larger, or the pose farther out, than anybody would take.
        """
        self._check_reach(np.array([pose], dtype=np.int32))
        if len(payload) > self.settings.payload_bytes_most:
            raise ValueError(f"a payload of {len(payload)} bytes is too large")
        number = self.log.append(payload, pose)
        self._changed(now)
        self.telling.news(now)
        return number

    def revise(self, poses: PoseTable, now: float) -> None:
        """Replace all poses (n, 3) of one's own entries. They are told soon.

        Raises:
            ValueError: not one pose for each entry, or one farther out than anybody would take.
        """
        self._check_reach(poses)
        self.log.revise(poses, self.telling.count)
        self._changed(now)
        self.telling.revised(now)

    def handle(self, peer: str, message: LogMessage, now: float) -> None:
        """Take a peer's message. What it asks for is sent by `tick`, when that is due."""
        if peer in self.standing.isolated or peer == self.log.me.robot:
            return
        back = self.peers.hear(peer, now)
        if back and not isinstance(message, LogHave):
            self._announcing.contact(now)
        try:
            if isinstance(message, Observations):
                self._observations(peer, message, now)
            elif isinstance(message, PoseSet):
                self._pose_set(peer, message, now)
            elif isinstance(message, LogHave):
                self._have(peer, message, back, now)
            else:
                self.answering.take(peer, message, now)
        except ValueError as error:
            self.fault(peer, str(error), now)
        self.asking.schedule(now)

    def hear(self, peer: str, now: float) -> None:
        """Note that a peer sent something else than a message about logs: it is here."""
        known = peer not in self.standing.isolated and peer != self.log.me.robot
        if known and self.peers.hear(peer, now):
            self._announcing.contact(now)

    def fault(self, peer: str, reason: str, now: float) -> None:
        """Count a fault of a peer; frames that cannot even be read may be counted here, too."""
        self.notes += self.standing.fault(peer, reason, now)
        if peer in self.standing.isolated:
            self.peers.forget(peer)
            self.answering.forget(peer)

    def tick(self, now: float) -> list[Outgoing]:
        """Return what is due to be sent at mission time `now` [s]."""
        sent: list[Outgoing] = []
        if self.telling.due is not None and now >= self.telling.due:
            sent += [Outgoing(EVERYONE, message) for message in self.telling.tell_due(now)]
        if self.asking.due is not None and now >= self.asking.due:
            sent += [Outgoing(*request) for request in self.asking.ask(now)]
        if self.answering.due is not None and now >= self.answering.due:
            sent += [Outgoing(*answer) for answer in self.answering.answer(now)]
        if now >= self._announcing.due:
            if self.asking.lacking:
                self._changed(now)
            self._before = [self._before[1], {a: self._held(a) for a in self.log.authors()}]
            if self._announcing.speak(now):
                if self.telling.forgotten:
                    sent += [Outgoing(EVERYONE, message) for message in self.telling.tell()]
                sent.append(Outgoing(EVERYONE, self._announcement()))
        return sent

    def next_deadline(self) -> float:
        """Return the mission time [s] at which `tick` is due next."""
        due = (self.telling.due, self.asking.due, self.answering.due, self._announcing.due)
        return min(at for at in due if at is not None)

    def take_notes(self) -> list[Note]:
        """Return the lines since the last call."""
        notes, self.notes = self.notes, []
        return notes

    def _changed(self, now: float) -> None:
        """Something changed: say what is held before long, if anybody can hear it."""
        if self.peers.heard_within(self.settings.away_s, now):
            self._announcing.change(now)

    def _check_reach(self, poses: PoseTable) -> None:
        """Check that the others will take these poses."""
        if not within_reach(poses, self.settings.reach_m):
            raise ValueError(f"poses beyond {self.settings.reach_m} m, or angles not wrapped")

    def _announcement(self) -> LogHave:
        """Return the message that says what is held, as far as it was told."""
        authors = self.log.authors()
        logs = [self.log.of(author) for author in authors]
        counts = [log.count for log in logs]
        versions = [log.version for log in logs]
        mine = authors.index(self.log.me)
        # What waits for the next batch must not look as if it was lost.
        counts[mine], versions[mine] = self.telling.count, self.telling.version
        sums = [log.checksum(count) for log, count in zip(logs, counts, strict=True)]
        told = self.log.own_revision(self.telling.version)
        sums[mine] = self.log.own.checksum_of(self.telling.count, told)
        beyond = [(i, *held) for i, log in enumerate(logs) for held in log.beyond()]
        return LogHave(
            **listing(authors),
            counts=tuple(counts),
            versions=tuple(versions),
            sums=tuple(sums),
            beyond=tuple(beyond[:RANGES_IN_FRAME]),
        )

    def _observations(self, peer: str, message: Observations, now: float) -> None:
        """Take a peer's entries."""
        author = Author(message.author or peer, message.life)
        before = len(self.log.of(author).entries)
        self._blame(self.intake.entries(peer, message, now), now)
        self._heard(peer, author, message.numbers, now)
        if len(self.log.of(author).entries) > before:
            self._changed(now)

    def _pose_set(self, peer: str, message: PoseSet, now: float) -> None:
        """Take a peer's pose revision."""
        author = Author(message.author or peer, message.life)
        before = self.log.of(author).version
        self._blame(self.intake.revision(peer, message, now), now)
        version = self.log.of(author).version
        if not message.back:
            self._heard(peer, author, (0,), now)
        elif version >= message.version:  # others may not have been able to read it
            self.asking.arrived(author, (0,), peer, now)
        if version > before:
            self._changed(now)

    def _blame(self, faults: list[tuple[str, str]], now: float) -> None:
        """Count the faults that a message shows."""
        for peer, reason in faults:
            self.fault(peer, reason, now)

    def _heard(self, peer: str, author: Author, numbers: tuple[int, ...], now: float) -> None:
        """Something was told: nobody need ask for it, or answer with it, any more."""
        self.asking.arrived(author, numbers, peer, now)
        self.answering.overheard(author, numbers)

    def _have(self, peer: str, message: LogHave, back: bool, now: float) -> None:
        """Take what a peer says it holds, who may be back from away."""
        authors = authors_of(message)
        claims = {}
        for index, author in enumerate(authors):
            if not self.intake.admits(author, peer, now, strict=False):
                continue
            beyond = [(a, b) for i, a, b in message.beyond if i == index]
            claim = Claim(message.counts[index], message.versions[index], tuple(sorted(beyond)))
            if author == self.log.me:
                self.intake.surpass(peer, claim.top > self.log.own.count, now)
            claims[author] = claim
            self._compare(peer, author, claim, message.sums[index], now)
        self.peers.introduce(peer, claims)
        for author in [author for author in claims if author.robot == peer]:
            if self.peers.lives(author, now):
                self.intake.hear_version(author, claims[author].version, now)
                self._blame(self.intake.disproved(peer, now), now)
        covers, lacks = self._covers(peer, claims, now)
        self._announcing.hear(covers, lacks, back, now)

    def _covers(self, peer: str, claims: dict[Author, Claim], now: float) -> tuple[bool, bool]:
        """Return whether a peer with these claims can speak for this member, and lacks news of it.

        What an author told just now it lacks only by chance, and will see from the next frame.
        What it does not know after a while it cannot hear from the author itself.
        """
        covers, lacks, nothing = True, False, Claim()
        for author in self.log.authors():
            claim = claims.get(author, nothing)
            top, version = self._held(author)
            heard = author.robot != peer and self.peers.lives(author, now)
            if heard:
                top, version = self._before[0].get(author, (0, 0))
            news = claim.top < top or claim.version < version
            known = heard or author == self.log.me
            covers &= not news and (known or claim.count >= top)
            lacks |= news and (author != self.log.me or self.telling.due is None)
        return covers, lacks

    def _held(self, author: Author) -> tuple[int, int]:
        """Return the highest number and version held of an author, as far as it was told."""
        if author == self.log.me:
            return self.telling.count, self.telling.version
        log = self.log.of(author)
        return log.top, log.version

    def _compare(self, peer: str, author: Author, claim: Claim, checksum: int, now: float) -> None:
        """Compare a peer's checksum with what is held, where both hold the same."""
        log = self.log.of(author)
        comparable = 0 < claim.count <= log.count and claim.version == log.version
        if author == self.log.me or not comparable or checksum == log.checksum(claim.count):
            return
        if self.peers.lives(author, now):
            self.asking.doubt(author, claim.count, now)
        elif author not in self._differing:
            self._differing[author] = None
            text = f"{peer} and this robot hold different logs of {author.robot}, who is gone"
            self.notes.append(Note("warning", text))
