"""The books of the radio: every frame and byte, by link and message type."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import TypeVar

Key = TypeVar("Key", bound=Hashable)
BOOKS = ("sent", "duplicated", "delivered", "lost", "queued")


@dataclass(slots=True)
class Tally:
    """Frames and bytes."""

    count: int = 0
    bytes: int = 0

    def add(self, size: int) -> None:
        """Count one frame of `size` bytes."""
        self.count += 1
        self.bytes += size


Tallies = dict[tuple[str, str, str], Tally]


@dataclass(slots=True)
class Ledger:
    """Every byte of every link; at all times sent + duplicated = delivered + lost + queued.

    The keys are (from, to, message type). A frame to everyone is entered once for each receiver;
    in `aired`, by (from, message type), once. What is queued is not entered here: the relay counts
    it where it lies, see `Relay.queued`.

    Attributes:
        sent: what was handed to the radio.
        duplicated: copies that came about on the way.
        delivered: what arrived.
        lost: what never will.
        aired: what occupied the channel, to its end.
    """

    sent: Tallies = field(default_factory=dict)
    duplicated: Tallies = field(default_factory=dict)
    delivered: Tallies = field(default_factory=dict)
    lost: Tallies = field(default_factory=dict)
    aired: dict[tuple[str, str], Tally] = field(default_factory=dict)


def enter(book: dict[Key, Tally], key: Key, size: int) -> None:
    """Enter a frame of `size` bytes in one of the books."""
    tally = book.get(key)
    if tally is None:
        tally = book[key] = Tally()
    tally.add(size)
