"""What a member knows of its peers: who is there, and what each says it holds."""

from __future__ import annotations

from dataclasses import dataclass, field

from protocol.log.author_log import Author
from protocol.number_ranges import Range, holds

_PEERS = 256  # a hostile sender invents names; no more are remembered

_CLAIMS = 128  # of a peer, about so many authors


@dataclass(slots=True)
class Claim:
    """What a peer says it holds of an author.

    Attributes:
        count: the entries 1 to `count`.
        version: its newest pose revision; 0 for none.
        beyond: ranges of entries after the first gap.
    """

    count: int = 0
    version: int = 0
    beyond: tuple[Range, ...] = ()

    @property
    def top(self) -> int:
        """Highest number it holds."""
        return max(self.count, self.beyond[-1][1] if self.beyond else 0)

    def holds(self, number: int) -> bool:
        """Whether it holds an entry."""
        return number <= self.count or holds(self.beyond, number)


@dataclass(slots=True)
class Peer:
    """One peer.

    Attributes:
        heard: when something last came from it [s].
        life: the newest life that it said it lives; -1 before it did.
        introduced: it has said what it holds since it was away.
        claims: what it says it holds.
    """

    heard: float
    life: int = -1
    introduced: bool = False
    claims: dict[Author, Claim] = field(default_factory=dict)


class Peers:
    """All peers.

    Args:
        away: a peer that was not heard for longer is away [s]: others speak for it.
        gone: one that was not heard for longer is gone [s]: it is not asked any more.
    """

    def __init__(self, away: float, gone: float) -> None:
        self.known: dict[str, Peer] = {}
        self._away = away
        self._gone = gone

    def hear(self, name: str, now: float) -> bool:
        """Note that a peer spoke; return whether it was away, or never there."""
        peer = self.known.get(name)
        if peer is None:
            if len(self.known) >= _PEERS:
                longest = min(sorted(self.known), key=lambda other: self.known[other].heard)
                del self.known[longest]
            self.known[name] = Peer(now)
            return True
        back = now - peer.heard > self._away
        peer.introduced &= not back
        peer.heard = max(peer.heard, now)
        return back

    def here(self, name: str, now: float) -> bool:
        """Whether a peer was heard lately."""
        peer = self.known.get(name)
        return peer is not None and now - peer.heard <= self._away

    def present(self, now: float) -> list[str]:
        """Return who is not gone, sorted."""
        return [name for name in sorted(self.known) if now - self.known[name].heard <= self._gone]

    def heard_within(self, seconds: float, now: float) -> list[str]:
        """Return who was heard in the last `seconds`, in no order that matters."""
        return [name for name, peer in self.known.items() if now - peer.heard <= seconds]

    def life(self, name: str, now: float) -> int:
        """Return the newest life that a peer told; -1 of one that did not, or is away."""
        return self.known[name].life if self.here(name, now) else -1

    def lives(self, author: Author, now: float) -> bool:
        """Whether an author itself was heard lately: its robot, in that very life."""
        return self.life(author.robot, now) == author.life

    def claim(self, name: str, author: Author) -> Claim:
        """Return what a peer claims of an author, to be read or changed.

        Raises:
            ValueError: it claims something of too many authors; a fault of the peer.
        """
        claims = self.known[name].claims
        if author not in claims and len(claims) >= _CLAIMS:
            raise ValueError("claims of too many authors")
        return claims.setdefault(author, Claim())

    def introduce(self, name: str, claims: dict[Author, Claim]) -> None:
        """Take all that a peer claims in place of what it claimed before.

        Of its own log it never holds less than it told: then this word was overtaken on its way.
        """
        peer = self.known[name]
        peer.introduced = True
        before = peer.claims
        peer.claims = dict(claims)
        for author, claim in claims.items():
            if author.robot == name and author in before:
                count = max(claim.count, before[author].count)
                version = max(claim.version, before[author].version)
                peer.claims[author] = Claim(count, version, claim.beyond)

    def unborn(self, author: Author, now: float) -> bool:
        """Whether an author's robot is here and lives an earlier life."""
        return -1 < self.life(author.robot, now) < author.life

    def claims(self, author: Author, now: float) -> dict[str, Claim]:
        """Return the claims of those not gone that hold something of an author, by name."""
        return {
            name: claim
            for name in self.present(now)
            if (claim := self.known[name].claims.get(author)) is not None
        }

    def forget(self, name: str) -> None:
        """Forget a peer and its claims."""
        self.known.pop(name, None)

    def authors(self) -> list[Author]:
        """Return all authors that somebody claims to hold something of, sorted."""
        return sorted({author: None for peer in self.known.values() for author in peer.claims})
