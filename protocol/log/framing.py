"""How many entries go into a frame."""

from __future__ import annotations

from collections.abc import Iterable

from protocol.log.author_log import Entry
from protocol.log.messages import ENTRIES_IN_FRAME

FRAME_OVERHEAD = 60  # [bytes], about, of a frame of observations
ENTRY_OVERHEAD = 9  # [bytes], about, of an entry in it: pose, number, size


def fill_frame(
    entries: Iterable[tuple[int, Entry]], most: int
) -> tuple[list[tuple[int, Entry]], int]:
    """Return as many entries, with their numbers, as a frame holds, and about its size [bytes].

    Args:
        entries: of one author, all told in the same version; at least one goes in.
        most: about so many bytes go into a frame.
    """
    told: list[tuple[int, Entry]] = []
    size = FRAME_OVERHEAD
    for number, entry in entries:
        size += ENTRY_OVERHEAD + len(entry.payload)
        if told and (size > most or len(told) >= ENTRIES_IN_FRAME):
            break
        told.append((number, entry))
    return told, size
