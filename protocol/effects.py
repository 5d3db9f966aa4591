"""What a core is: events in, effects out, and no clock of its own.

Every process of a team is a core inside a shell. The shell (`protocol.runner` over ZeroMQ,
`protocol.in_process` without sockets) hands it events with the mission time and carries out what it
returns. A core never waits, never reads a clock, opens no file and draws only from the random
generator it was given.

A core speaks on named channels. On a typed channel it gets `Received` events with validated
messages; on a raw channel (the world's radio relay) it gets `Passing` frames that it need not
understand. `joined` and `left` tell about peers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

from protocol.codec import Frame, Header
from protocol.messages import Message


class Received(NamedTuple):
    """A valid message arrived on `channel` from the peer named in its header."""

    channel: str
    header: Header
    message: Message


class Passing(NamedTuple):
    """A frame arrived on a raw channel; only its header was looked at."""

    channel: str
    header: Header
    frame: Frame


@dataclass(frozen=True, slots=True)
class Rejected:
    """A peer sent something that is no valid message; it was dropped and counted."""

    channel: str
    source: str
    reason: str


@dataclass(frozen=True, slots=True)
class PeerLeft:
    """The transport says that a peer is gone: its process ended or its connection broke."""

    channel: str
    peer: str


Event = Received | Passing | Rejected | PeerLeft


class Send(NamedTuple):
    """Send a message to a peer."""

    channel: str
    to: str
    message: Message


class PassOn(NamedTuple):
    """Send a frame on to a peer as it came, byte for byte."""

    channel: str
    to: str
    frame: Frame


@dataclass(frozen=True, slots=True)
class Note:
    """Write a line to the log. level: `debug`, `info`, `warning` or `error`."""

    level: str
    text: str


@dataclass(frozen=True, slots=True)
class Strike:
    """The world strikes a process with a scripted fault.

    kind: `kill`, `restart`, `reboot`, `freeze` or `thaw`.
    """

    peer: str
    kind: str


@dataclass(frozen=True, slots=True)
class Stop:
    """The core is through; its shell writes what is to be written and ends the process."""

    reason: str


Effect = Send | PassOn | Note | Strike | Stop


class Core(Protocol):
    """The pure part of a process."""

    def handle(self, event: Event, now: float) -> list[Effect]:
        """Take an event at mission time `now` [s]; return what is to be done."""
        ...

    def tick(self, now: float) -> list[Effect]:
        """Do what is due at mission time `now` [s]."""
        ...

    def next_deadline(self) -> float | None:
        """Return the mission time [s] at which `tick` is due next, or None."""
        ...
