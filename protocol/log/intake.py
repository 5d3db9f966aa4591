"""Judges what a peer tells before it is held.

Whose word counts:

* A robot's word on the life it lives now is first hand, everything else is relayed. First hand
  beats relayed: what was relayed and turns out different is replaced, and counts against the peer
  that relayed it. A relayed entry that differs from one held first hand counts against its relayer.
  A robot that contradicts itself: what it said first stays, and it counts against the robot.
  Two relayed words that differ: the first stays until the author speaks.
* Only a robot begins its lives: of a later life than it told nothing is taken from others while the
  robot is here. If it still tells the earlier one a while after, that was a fault; and what others
  told of it before the robot spoke is forgotten. Of its own lives a robot believes nobody.
* A pose revision told as a difference to one that is not held, or to another one than its author
  means, is as if it had not come: its checksum tells. Only the author tells differences.
* A relayed pose revision is taken when its author is not here, or has told that version itself. If
  the author then goes on in an older one, the relayed one was forged: it is dropped.
* Faults, one for each frame: parts that do not fit, poses out of reach, payloads or logs that are
  too large, too many authors, numbers that leap by more than the window from all that the peer
  claimed so far. Numbers after the window are not held, and are no fault as such: a member that was
  away for long is simply behind.

There are no signatures. The word of a robot that is gone cannot be checked: if it lied, or somebody
in its name after it was gone, members may hold different things of that author, and no others. And
a robot that tells different members different things makes their honest relayed words contradict.
"""

from __future__ import annotations

import numpy as np

from protocol.log.author_log import Author, AuthorLog, Entry, PoseRevision
from protocol.log.earlier_poses import poses_of_first
from protocol.log.messages import Observations, PoseSet, entries_of
from protocol.log.observation_log import ObservationLog
from protocol.log.peers import Peers
from protocol.log.pose_coding import unpack_poses, within_reach
from protocol.log.settings import LogSyncSettings

_SETTLE = 5.0  # [s]; frames of an author that were overtaken on their way are older than that
_NEW_LIVES = 256  # a hostile peer invents them; no more are remembered
LIAR = "relayed what its author did not say"

Fault = tuple[str, str]  # whose, and what


class Intake:
    """The judge.

    Args:
        log: what is held.
        peers: who is there.
        settings: the limits.
        team: names of all robots that can be authors; empty for anyone.

    Attributes:
        overtaken: others hold more of this robot's life than it does itself: it was restored from
            an old copy and must begin a new life.
    """

    def __init__(
        self, log: ObservationLog, peers: Peers, settings: LogSyncSettings, team: tuple[str, ...]
    ) -> None:
        self.overtaken = False
        self.restored = log.own.count > 0
        # Who knows more of a life that began with this start than the robot itself made it up.
        self._log = log
        self._peers = peers
        self._settings = settings
        self._team = team
        self._revised: dict[Author, float] = {}  # when the held revision came
        self._mouths: dict[str, tuple[float, float]] = {}  # contradict me: since, and last
        self._new_lives: dict[tuple[str, Author], float] = {}  # who spoke of a life, and when

    def entries(self, peer: str, message: Observations, now: float) -> list[Fault]:
        """Take the entries of a message; return the faults that it shows of other peers.

        Raises:
            ValueError: what is wrong with the message; a fault of the peer.
        """
        author = Author(message.author or peer, message.life)
        told = entries_of(message)
        self._check_sizes(told, message)
        if author == self._log.me:
            self._check_own(peer, told, now)
            return []
        if not self.admits(author, peer, now, strict=True):
            return []
        self._check_leap(peer, author, told[-1][0])
        first_hand = self._peers.known[peer].life == author.life and peer == author.robot
        if first_hand:
            claim = self._peers.claim(peer, author)
            claim.count = max(claim.count, told[-1][0])
            self.hear_version(author, message.version, now)
        faults: dict[Fault, None] = dict.fromkeys(self.disproved(peer, now))
        for number, entry in told:
            fault = self._take(author, number, entry, peer, first_hand)
            if fault is not None:
                faults[fault] = None
        return list(faults)

    def revision(self, peer: str, message: PoseSet, now: float) -> list[Fault]:
        """Take a pose revision; return the faults that it shows of other peers.

        Raises:
            ValueError: what is wrong with the message; a fault of the peer.
        """
        author = Author(message.author or peer, message.life)
        revision = self._revision_of(author, peer, message)
        if author == self._log.me:
            self.surpass(peer, message.version > self._log.own.version, now)
            return []
        if not self.admits(author, peer, now, strict=True):
            return []
        first_hand = self._peers.known[peer].life == author.life and peer == author.robot
        if first_hand:
            self.hear_version(author, message.version, now)
        elif self._peers.lives(author, now) and self._told_version(author) < message.version:
            return []
        if revision is None:
            return []
        return self._take_revision(author, revision, peer, first_hand, now)

    def _revision_of(self, author: Author, peer: str, message: PoseSet) -> PoseRevision | None:
        """Return the revision that a message tells; None if what it builds on is not held.

        Raises:
            ValueError: what is wrong with the message.
        """
        most, base = self._settings.author_entries_most, None
        if message.count > most:
            raise ValueError("too many poses")
        if message.back:
            if peer != author.robot or message.back > message.version:
                raise ValueError("a difference of poses that its sender cannot tell")
            log = self._log.of(author)
            known = log.version == message.version - message.back
            base = poses_of_first(log, log.poses, message.count) if known else None
            if base is None:
                return None
        try:
            poses = unpack_poses(message.data, message.count, most, base)
        except ValueError:
            if base is None:
                raise
            return None  # what is held is not what its author told
        if not within_reach(poses, self._settings.reach_m):
            raise ValueError("impossible poses: out of reach")
        return PoseRevision(message.version, poses)

    def admits(self, author: Author, peer: str, now: float, strict: bool) -> bool:
        """Whether anything of an author is taken from a peer.

        Args:
            author: whose log it is about.
            peer: who speaks of it.
            now: mission time [s].
            strict: raise for what must not be; else only return False.

        Raises:
            ValueError: it must not be, if `strict`.
        """
        if peer != author.robot and self._peers.unborn(author, now):
            if len(self._new_lives) < _NEW_LIVES:
                self._new_lives.setdefault((peer, author), now)
            return False
        reason = self._objection(author, peer)
        if reason and strict:
            raise ValueError(reason)
        return not reason

    def disproved(self, robot: str, now: float) -> list[Fault]:
        """A robot speaks: forget its later lives that others spoke of; return who is to blame.

        Those who spoke of one before this robot was known to live an earlier one may have been
        told so themselves.
        """
        for author in self._log.authors():
            if author.robot == robot and self._peers.unborn(author, now):
                self._log.forget(author)
        faults = []
        for (peer, author), at in list(self._new_lives.items()):
            if author.robot == robot and now - at > _SETTLE:
                del self._new_lives[peer, author]
                if self._peers.unborn(author, now):
                    faults.append((peer, "a life that its robot did not tell"))
        return faults

    def hear_version(self, author: Author, version: int, now: float) -> None:
        """The author told the version it is in: drop a relayed one that it never made."""
        claim = self._peers.claim(author.robot, author)
        claim.version = max(claim.version, version)
        log = self._log.of(author)
        relayed = log.revision is not None and log.revision_by != author.robot
        settled = now - self._revised.get(author, now) > _SETTLE
        if relayed and settled and log.version > claim.version:
            self._log.put_revision(author, None, "")

    def _objection(self, author: Author, peer: str) -> str:
        """Return why nothing of an author is taken from a peer; empty if it is."""
        me = self._log.me
        if author.robot == me.robot and author.life > me.life:
            return "a life of mine: that I do not live"
        if self._team and author.robot not in self._team:
            return "a stranger's log: no robot of that name is in the team"
        if peer == author.robot:
            self._peers.known[peer].life = max(self._peers.known[peer].life, author.life)
        if author in self._log.logs:
            return ""
        lives = sum(other.robot == author.robot for other in self._log.logs)
        if len(self._log.logs) >= self._settings.authors_most or lives >= self._settings.lives_most:
            return "too many authors"
        return ""

    def _check_sizes(self, told: list[tuple[int, Entry]], message: Observations) -> None:
        """Check what can be checked without knowing anything."""
        if max(message.sizes) > self._settings.payload_bytes_most:
            raise ValueError("a payload that is too large")
        if told[-1][0] > self._settings.author_entries_most:
            raise ValueError("numbers beyond all reason")
        if not within_reach(message.poses, self._settings.reach_m):
            raise ValueError("impossible poses: out of reach")

    def _check_own(self, peer: str, told: list[tuple[int, Entry]], now: float) -> None:
        """Check what a peer says that I said in the life I live."""
        own = self._log.own
        if any(own.compare(number, entry) == "different" for number, entry in told):
            self._contradicted(peer, now)
            return
        self.surpass(peer, told[-1][0] > own.count, now)

    def surpass(self, peer: str, more: bool, now: float) -> None:
        """A peer holds more of the life this robot lives than itself, or does not.

        Raises:
            ValueError: it cannot: nobody can know more of a life that began with this start.
        """
        if more and not self.restored:
            self._contradicted(peer, now)
        else:
            self.overtaken |= more

    def _contradicted(self, peer: str, now: float) -> None:
        """A peer says that this robot wrote what it did not.

        Who was lied to before it heard this robot passes the lie on, and then learns better; who
        goes on with it is the liar.

        Raises:
            ValueError: the peer goes on with it.
        """
        first, last = self._mouths.get(peer, (now, now))
        if now - last > _SETTLE:
            first = now
        self._mouths[peer] = first, now
        if now - first >= _SETTLE:
            raise ValueError("words in my mouth")

    def _check_leap(self, peer: str, author: Author, number: int) -> None:
        """Check that a peer's numbers do not leap."""
        speaker = self._peers.known[peer]
        claim = speaker.claims.get(author)
        top = max(claim.top if claim else number, self._log.of(author).top)
        if speaker.introduced and number > top + self._settings.window_entries:
            raise ValueError("numbers that leap")

    def _take(
        self, author: Author, number: int, entry: Entry, peer: str, first_hand: bool
    ) -> Fault | None:
        """Take one entry; return the fault it shows, if any."""
        log = self._log.of(author)
        verdict = log.compare(number, entry)
        if verdict == "new":
            return self._take_new(author, log, number, entry, peer)
        by = log.entries[number].by
        if verdict == "same":
            if first_hand:
                log.vouch(number, peer)
            return None
        if first_hand and by != peer:
            self._log.put(author, number, entry, peer)
            return by, LIAR
        if first_hand:
            return peer, "contradicts itself"
        return (peer, LIAR) if by == author.robot else None

    def _take_new(
        self, author: Author, log: AuthorLog, number: int, entry: Entry, peer: str
    ) -> Fault | None:
        """Take an entry under a number that was free, if there is room for it."""
        if number > log.count + self._settings.window_entries:
            return None
        if log.bytes + len(entry.payload) > self._settings.author_bytes_most:
            return peer, "a log that is too large"
        self._log.put(author, number, entry, peer)
        return None

    def _take_revision(
        self, author: Author, revision: PoseRevision, peer: str, first_hand: bool, now: float
    ) -> list[Fault]:
        """Take a revision if it is newer, or its author's own word against a relayed one."""
        log = self._log.of(author)
        if revision.version < log.version:
            return []
        held, by = log.revision, log.revision_by
        if held is None or revision.version > held.version:
            self._log.put_revision(author, revision, peer)
            self._revised[author] = now
            return []
        if np.array_equal(held.poses, revision.poses):
            if first_hand:
                log.revision_by = peer
            return []
        if first_hand and by != peer:
            self._log.put_revision(author, revision, peer)
            return [(by, LIAR)]
        if first_hand:
            return [(peer, "contradicts itself")]
        return [(peer, LIAR)] if by == author.robot else []

    def _told_version(self, author: Author) -> int:
        """Return the newest version that an author itself told, 0 for none."""
        claim = self._peers.known[author.robot].claims.get(author)
        return claim.version if claim else 0
