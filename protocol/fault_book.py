"""Counts what was dropped, by peer and kind of fault; a peer's fault is named once."""

from __future__ import annotations

from protocol.effects import Note

_KINDS = 100  # a hostile peer invents a new fault with every frame; books stay small


class FaultBook:
    """The counts.

    Attributes:
        counts: how often, by (peer, kind of fault).
    """

    def __init__(self) -> None:
        self.counts: dict[tuple[str, str], int] = {}

    def enter(self, what: str, peer: str, reason: str) -> list[Note]:
        """Count a fault; return a line about it the first time that the peer makes it.

        Args:
            what: that was dropped, for people: "a frame".
            peer: whose.
            reason: why; the part before the first colon is the kind of fault.
        """
        key = (peer, reason.split(":", maxsplit=1)[0])
        if key not in self.counts and len(self.counts) >= _KINDS:
            key = ("others", "more kinds of faults than are told apart")
        self.counts[key] = self.counts.get(key, 0) + 1
        if self.counts[key] > 1:
            return []
        return [Note("warning", f"dropped {what} of {peer}: {reason}")]
