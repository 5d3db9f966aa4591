"""Whose word is still taken: faults of each peer, and who is isolated for them.

Every fault is counted under its peer and kind. A peer that makes `most` faults within `window`
seconds is isolated: nothing that it sends is taken any more, and one line names it. There is no way
back: a peer that lies is not asked whether it will stop.
"""

from __future__ import annotations

from collections import deque

from protocol.effects import Note
from protocol.fault_book import FaultBook

_PEERS = 256  # a hostile sender invents names; the books stay small


class Standing:
    """The peers' standing.

    Args:
        most: so many faults isolate a peer.
        window: if they come within this time [s].

    Attributes:
        book: the counts.
        isolated: peers that are isolated, and when they were [s].
    """

    def __init__(self, most: int, window: float) -> None:
        self.book = FaultBook()
        self.isolated: dict[str, float] = {}
        self._most = most
        self._window = window
        self._recent: dict[str, deque[float]] = {}

    def fault(self, peer: str, reason: str, now: float) -> list[Note]:
        """Count a fault of a peer; return what is to be said about it.

        Args:
            peer: whose fault it is.
            reason: what is wrong; the part before the first colon is the kind of fault.
            now: mission time [s].
        """
        if peer in self.isolated:
            return []
        notes = self.book.enter("words", peer, reason)
        if peer not in self._recent and len(self._recent) >= _PEERS:
            return notes
        times = self._recent.setdefault(peer, deque(maxlen=self._most))
        times.append(now)
        if len(times) < self._most or now - times[0] > self._window:
            return notes
        self.isolated[peer] = now
        del self._recent[peer]
        text = f"{peer} is isolated: {self._most} faults, the last was {reason}"
        return [*notes, Note("warning", text)]
