"""What a member knows of the talk with one peer, without any socket: sans-I/O.

A session goes `new -> open -> silent -> open ...` by one table. It notices duplicates and gaps by
the frames' sequence numbers, a restarted peer by its incarnation, and silence by the clock it is
handed. Any traffic counts as a heartbeat.
"""

from __future__ import annotations

from dataclasses import dataclass

from protocol.codec import Header

# (state, event) -> state; a pair that is absent leaves the state as it is.
TRANSITIONS: dict[tuple[str, str], str] = {
    ("new", "hello"): "open",
    ("open", "silence"): "silent",
    ("open", "left"): "silent",
    ("silent", "traffic"): "open",
    ("silent", "hello"): "open",
}


@dataclass(slots=True)
class Session:
    """The talk with one peer.

    Attributes:
        peer: its name.
        silence: it counts as silent when nothing came for this long [s].
        state: `new` (no hello yet), `open`, or `silent`.
        incarnation: which life of the peer's process this is.
        heard: when something last came [s], mission time.
        received: highest sequence number seen.
        missed: frames that never came, by the gaps in the numbers.
        duplicates: frames that came again or too late.
    """

    peer: str
    silence: float
    state: str = "new"
    incarnation: int = -1
    heard: float = 0.0
    received: int = 0
    missed: int = 0
    duplicates: int = 0

    def hello(self, incarnation: int, now: float) -> bool:
        """The peer introduced itself; return whether this is a new life of it."""
        fresh = incarnation != self.incarnation
        if fresh:
            self.received = 0
        self.incarnation = incarnation
        self._on("hello", now)
        return fresh

    def accept(self, header: Header, now: float) -> bool:
        """Note a frame's arrival; return whether it is new (not a duplicate, not from the past)."""
        self._on("traffic", now)
        if header.sequence <= self.received:
            self.duplicates += 1
            return False
        self.missed += header.sequence - self.received - 1
        self.received = header.sequence
        return True

    def check(self, now: float) -> bool:
        """Return whether the peer has just fallen silent."""
        if self.state == "open" and now - self.heard > self.silence:
            self.state = TRANSITIONS["open", "silence"]
            return True
        return False

    def left(self) -> bool:
        """The transport says that the peer is gone; return whether that is news."""
        was_open = self.state == "open"
        self.state = TRANSITIONS.get((self.state, "left"), self.state)
        return was_open

    @property
    def deadline(self) -> float | None:
        """When `check` could find the peer silent [s], or None."""
        return self.heard + self.silence if self.state == "open" else None

    def _on(self, event: str, now: float) -> None:
        """Take a transition and note the time."""
        self.state = TRANSITIONS.get((self.state, event), self.state)
        self.heard = now
