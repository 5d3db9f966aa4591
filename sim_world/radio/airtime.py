"""The one channel that all radios share: who sends, and when a frame is through.

Frames wait in line at their sender's radio. The channel goes round from sender to sender, a packet
at each turn, so that a long frame of one does not keep the others from being heard.

Source: the round goes as in IEEE 802.11 (1999), whose distributed coordination gives each station
that has something to send the same share of packets; collisions and idle slots are left out.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from dataclasses import dataclass

from protocol.codec import Frame

_HAIR = 1e-3  # [bit]; instants do not add up exactly, and no frame shall wait for that


@dataclass(slots=True)
class Transmission:
    """A frame that waits for the channel or is on it.

    Attributes:
        sender: whose radio holds it.
        receivers: names it is meant for.
        type: of the message.
        frame: the frame itself.
        size: its length [bytes].
        left: what the channel has not carried yet [bit].
    """

    sender: str
    receivers: tuple[str, ...]
    type: str
    frame: Frame
    size: int
    left: float


class Channel:
    """A channel with a bit rate that is shared among all who send.

    Args:
        capacity: [bit/s]; None for a channel that is never busy.
        turn: what a sender may send at each turn [bytes].
    """

    def __init__(self, capacity: float | None, turn: int) -> None:
        self._capacity = capacity
        self._turn = 8.0 * turn if capacity is not None else math.inf
        self._lines: dict[str, deque[Transmission]] = {}
        self._held: Counter[str] = Counter()
        self._round: deque[str] = deque()  # who has something to send, next first
        self._begun = 0.0  # what the sender whose turn it is has sent of its packet [bit]

    def put(self, item: Transmission) -> None:
        """Let a frame wait in its sender's line."""
        line = self._lines.setdefault(item.sender, deque())
        if not line:
            self._round.append(item.sender)
        line.append(item)
        self._held[item.sender] += item.size

    def held(self, sender: str) -> int:
        """Return how many bytes of frames wait at a sender's radio, one partly sent included."""
        return self._held[sender]

    def waiting(self) -> list[Transmission]:
        """Return what waits anywhere, by senders in the order in which they first spoke."""
        return [item for line in self._lines.values() for item in line]

    def drop(self, sender: str) -> list[Transmission]:
        """Empty a sender's line and return what waited in it."""
        dropped = list(self._lines.get(sender, ()))
        if dropped:
            if self._round[0] == sender:
                self._begun = 0.0
            self._round.remove(sender)
            self._lines[sender].clear()
            self._held[sender] = 0
        return dropped

    def run(self, since: float, until: float) -> list[tuple[Transmission, float]]:
        """Send from `since` to `until` [s]; return the frames that got through, and when [s]."""
        per_bit = 0.0 if self._capacity is None else 1.0 / self._capacity
        budget = math.inf if self._capacity is None else self._capacity * (until - since)
        through: list[tuple[Transmission, float]] = []
        spent = 0.0
        while self._round and spent < budget - _HAIR:
            line = self._lines[self._round[0]]
            item = line[0]
            bits = min(item.left, self._turn - self._begun, budget - spent)
            item.left -= bits
            self._begun += bits
            spent += bits
            if item.left <= _HAIR:
                line.popleft()
                self._held[item.sender] -= item.size
                through.append((item, min(since + spent * per_bit, until)))
            if item.left <= _HAIR or self._begun >= self._turn - _HAIR:
                self._begun = 0.0
                sender = self._round.popleft()
                if line:
                    self._round.append(sender)
        return through
