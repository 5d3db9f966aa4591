"""Parts that messages about logs share, packed: whose log, lists of authors, ranges, poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from protocol.log.pose_coding import PoseTable
from protocol.packing import Packer, Unpacker


def pack_source(author: str | None, life: int) -> Packer:
    """Begin to pack a message that tells something of one author: its name, or nothing."""
    return Packer().text(author or "").number(life)


def unpack_source(unpacker: Unpacker) -> dict[str, object]:
    """Return the fields `author` and `life`."""
    return {"author": unpacker.text() or None, "life": unpacker.number()}


def pack_listing(authors: Sequence[str], lives: Sequence[int], versions: Sequence[int]) -> Packer:
    """Begin to pack a message that lists authors."""
    packer = Packer().number(len(authors))
    for name in authors:
        packer.text(name)
    return packer.numbers(lives).numbers(versions)


def unpack_listing(unpacker: Unpacker, most: int) -> dict[str, object]:
    """Return the fields `authors`, `lives` and `versions`, each of at most so many."""
    names = tuple(unpacker.text() for _ in range(unpacker.count(most)))
    return {
        "authors": names,
        "lives": unpacker.numbers(most),
        "versions": unpacker.numbers(most),
    }


def pack_ranges(packer: Packer, ranges: Sequence[tuple[int, int, int]]) -> Packer:
    """Pack ranges (index of the author, first, last), which end the message."""
    packer.number(len(ranges))
    for index, first, last in ranges:
        packer.number(index).number(first).signed(last - first)
    return packer


def unpack_ranges(unpacker: Unpacker, most: int) -> tuple[tuple[int, int, int], ...]:
    """Return ranges, at most so many.

    Raises:
        ValueError: the message does not end with them.
    """
    ranges = []
    for _ in range(unpacker.count(most)):
        index, first = unpacker.number(), unpacker.number()
        ranges.append((index, first, first + unpacker.signed()))
    unpacker.end()
    return tuple(ranges)


def unpack_table(unpacker: Unpacker, count: int) -> PoseTable:
    """Return poses (count, 3) int32 that were packed as steps, column by column.

    Raises:
        ValueError: a number does not fit in.
    """
    columns = [unpacker.steps(count) for _ in range(3)]
    if any(not -(2**31) <= value < 2**31 for column in columns for value in column):
        raise ValueError("a packed pose beyond all reason")
    return np.array(columns, dtype=np.int32).T.reshape(-1, 3)
