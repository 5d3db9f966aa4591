"""The radio relay: carries fleet frames between robots and server as the link model lets them.

It speaks the fleet protocol without understanding it: it reads headers, counts every byte per
message type and per link, delays, limits or drops frames, and passes them on byte for byte.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from protocol.codec import Frame, Header, frame_bytes
from protocol.messages import EVERYONE, SERVER


@dataclass(slots=True)
class Tally:
    """Frames and bytes."""

    count: int = 0
    bytes: int = 0

    def add(self, size: int) -> None:
        """Count one frame of `size` bytes."""
        self.count += 1
        self.bytes += size


@dataclass(slots=True)
class Ledger:
    """Every byte of every link: sent = delivered + lost (+ queued, for links with delay).

    Attributes:
        sent: (from, to, message type) -> what was handed to the radio.
        delivered: the same, what arrived.
        lost: the same, what did not.
    """

    sent: dict[tuple[str, str, str], Tally] = field(default_factory=dict)
    delivered: dict[tuple[str, str, str], Tally] = field(default_factory=dict)
    lost: dict[tuple[str, str, str], Tally] = field(default_factory=dict)

    def note(self, book: str, key: tuple[str, str, str], size: int) -> None:
        """Enter a frame in the book `sent`, `delivered` or `lost`."""
        table: dict[tuple[str, str, str], Tally] = getattr(self, book)
        table.setdefault(key, Tally()).add(size)


@dataclass(frozen=True, slots=True)
class Outage:
    """A time during which a robot's radio is cut off: start <= t < end [s]."""

    robot: str
    start: float
    end: float


@dataclass(slots=True)
class Relay:
    """Decides which frames arrive where.

    Args:
        robots: names of all robots that have a radio.
        outages: scripted cuts.
    """

    robots: tuple[str, ...]
    outages: tuple[Outage, ...] = ()
    ledger: Ledger = field(default_factory=Ledger)

    def carry(self, sender: str, header: Header, frame: Frame, now: float) -> list[str]:
        """Return who gets the frame, at this instant.

        Args:
            sender: the robot whose radio sent it, or `server`.
            header: the frame's header; its `to` is the server, one robot, or everyone.
            frame: the frame itself.
            now: mission time [s].
        """
        size = frame_bytes(frame)
        arrived = []
        for receiver in self._receivers(sender, header.to):
            key = (sender, receiver, header.type)
            self.ledger.note("sent", key, size)
            if self._cut(sender, now) or self._cut(receiver, now):
                self.ledger.note("lost", key, size)
            else:
                self.ledger.note("delivered", key, size)
                arrived.append(receiver)
        return arrived

    def _receivers(self, sender: str, to: str) -> Iterable[str]:
        """Return the names a frame is meant for."""
        if to == EVERYONE:
            return [name for name in self.robots if name != sender]
        return [to] if to == SERVER or to in self.robots else []

    def _cut(self, name: str, now: float) -> bool:
        """Whether a robot's radio is cut at this time."""
        return any(o.robot == name and o.start <= now < o.end for o in self.outages)
