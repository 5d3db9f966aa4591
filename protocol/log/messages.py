"""How robots tell each other what they observed, and find out what they lack.

They are packed: nearly all that a team puts on the air are these. Parts of a message that must fit
each other are checked where they are read, see `entries_of`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from protocol.fields import ArrayField, Name
from protocol.log.author_log import Author, Entry
from protocol.log.packing import (
    pack_listing,
    pack_ranges,
    pack_source,
    unpack_listing,
    unpack_ranges,
    unpack_source,
    unpack_table,
)
from protocol.log.pose_coding import PoseTable, pack_poses
from protocol.packing import PackedMessage, Unpacker

ENTRIES_IN_FRAME = 256
RANGES_IN_FRAME = 256
AUTHORS_IN_FRAME = 64
DATA_IN_FRAME = 240_000

Number = Annotated[int, Field(ge=1, le=2**31 - 1)]
Tally = Annotated[int, Field(ge=0, le=2**31 - 1)]
Checksum = Annotated[int, Field(ge=0, le=2**32 - 1)]
Data = Annotated[npt.NDArray[np.uint8], ArrayField("uint8", (None,), DATA_IN_FRAME)]
Steps = Annotated[npt.NDArray[np.int32], ArrayField("int32", (None, 3), 3 * ENTRIES_IN_FRAME)]
Authors = Annotated[tuple[Name, ...], Field(max_length=AUTHORS_IN_FRAME)]
Tallies = Annotated[tuple[Tally, ...], Field(max_length=AUTHORS_IN_FRAME)]
NumberRanges = Annotated[
    tuple[tuple[Tally, Number, Number], ...], Field(max_length=RANGES_IN_FRAME)
]


class Observations(PackedMessage):
    """Entries of one author's log, all told in its pose revision `version`.

    The author is the robot `author`, or the sender where that is nothing, in its life `life`.
    Entry `numbers[i]` (ascending) has the pose `poses[i]` (x [mm], y [mm], theta [0.1 mrad]; map
    frame) and `sizes[i]` bytes of payload; `data` holds the payloads one behind the other.
    """

    type: Literal["observations"] = "observations"
    author: Name | None = None
    life: Tally
    version: Tally
    numbers: Annotated[tuple[Number, ...], Field(max_length=ENTRIES_IN_FRAME)]
    sizes: Annotated[tuple[Tally, ...], Field(max_length=ENTRIES_IN_FRAME)]
    poses: Steps
    data: Data

    def packed(self) -> bytes:
        """Return all fields as bytes; numbers, sizes and poses as steps from entry to entry."""
        packer = pack_source(self.author, self.life).number(self.version)
        packer.number(len(self.numbers)).steps(self.numbers)
        packer.number(len(self.sizes)).steps(self.sizes)
        packer.number(len(self.poses))
        for column in self.poses.T.tolist():
            packer.steps(column)
        return packer.raw(self.data.tobytes()).data()

    @classmethod
    def unpacked(cls, data: bytes) -> dict[str, object]:
        """Return the fields that `packed` made these bytes of."""
        unpacker = Unpacker(data)
        fields = unpack_source(unpacker) | {"version": unpacker.number()}
        fields["numbers"] = tuple(unpacker.steps(unpacker.count(ENTRIES_IN_FRAME)))
        fields["sizes"] = tuple(unpacker.steps(unpacker.count(ENTRIES_IN_FRAME)))
        count = unpacker.count(ENTRIES_IN_FRAME)
        fields["poses"] = unpack_table(unpacker, count)
        return fields | {"data": np.frombuffer(unpacker.rest(), dtype=np.uint8)}


class PoseSet(PackedMessage):
    """New poses of an author's entries 1 to `count`, in place of all older ones.

    `data` holds them packed, see `pose_coding`: as they are, or, where `back` is not 0, as
    differences to what the author told before, its revision `version` - `back`. The author as in
    `observations`.
    """

    type: Literal["pose_set"] = "pose_set"
    author: Name | None = None
    life: Tally
    version: Number
    count: Tally
    back: Tally = 0
    data: Data

    def packed(self) -> bytes:
        """Return all fields as bytes."""
        packer = (
            pack_source(self.author, self.life)
            .number(self.version)
            .number(self.count)
            .number(self.back)
        )
        return packer.raw(self.data.tobytes()).data()

    @classmethod
    def unpacked(cls, data: bytes) -> dict[str, object]:
        """Return the fields that `packed` made these bytes of."""
        unpacker = Unpacker(data)
        fields = unpack_source(unpacker) | {"version": unpacker.number()}
        fields |= {"count": unpacker.number(), "back": unpacker.number()}
        return fields | {"data": np.frombuffer(unpacker.rest(), dtype=np.uint8)}


class LogHave(PackedMessage):
    """What the sender holds of each author: robot `authors[i]` in its life `lives[i]`.

    It holds the entries 1 to `counts[i]`, and the ranges of `beyond` (index of the author, first,
    last); `versions[i]` is its newest pose revision, 0 for none. `sums[i]` is the CRC-32 over
    those first entries and that revision.
    """

    type: Literal["log_have"] = "log_have"
    authors: Authors
    lives: Tallies
    counts: Tallies
    versions: Tallies
    sums: Annotated[tuple[Checksum, ...], Field(max_length=AUTHORS_IN_FRAME)]
    beyond: NumberRanges = ()

    def packed(self) -> bytes:
        """Return all fields as bytes."""
        packer = pack_listing(self.authors, self.lives, self.versions)
        packer.numbers(self.counts).number(len(self.sums))
        for checksum in self.sums:
            packer.raw(checksum.to_bytes(4, "little"))
        return pack_ranges(packer, self.beyond).data()

    @classmethod
    def unpacked(cls, data: bytes) -> dict[str, object]:
        """Return the fields that `packed` made these bytes of."""
        unpacker = Unpacker(data)
        fields = unpack_listing(unpacker, AUTHORS_IN_FRAME)
        fields["counts"] = unpacker.numbers(AUTHORS_IN_FRAME)
        sums = [unpacker.raw(4) for _ in range(unpacker.count(AUTHORS_IN_FRAME))]
        fields["sums"] = tuple(int.from_bytes(each, "little") for each in sums)
        return fields | {"beyond": unpack_ranges(unpacker, RANGES_IN_FRAME)}


class LogWant(PackedMessage):
    """What the sender wants from the receiver.

    `ranges` are (index of the author, first, last); `versions[i]` is the pose revision wanted of
    author i, or any newer one; 0 for none. It may be told as a difference to version `bases[i]` -
    1, where that is not 0.
    """

    type: Literal["log_want"] = "log_want"
    authors: Authors
    lives: Tallies
    versions: Tallies
    bases: Tallies = ()
    ranges: NumberRanges = ()

    def packed(self) -> bytes:
        """Return all fields as bytes."""
        packer = pack_listing(self.authors, self.lives, self.versions)
        return pack_ranges(packer.numbers(self.bases), self.ranges).data()

    @classmethod
    def unpacked(cls, data: bytes) -> dict[str, object]:
        """Return the fields that `packed` made these bytes of."""
        unpacker = Unpacker(data)
        fields = unpack_listing(unpacker, AUTHORS_IN_FRAME)
        fields["bases"] = unpacker.numbers(AUTHORS_IN_FRAME)
        return fields | {"ranges": unpack_ranges(unpacker, RANGES_IN_FRAME)}


LogMessage = Observations | PoseSet | LogHave | LogWant


def observations(
    author: Author, told: Sequence[tuple[int, Entry]], sender: str, version: int
) -> Observations:
    """Return the message that tells entries, all of one version.

    Args:
        author: whose they are.
        told: numbers, ascending, and entries.
        sender: who tells them; an author need not say its name.
        version: of the pose revision they were told in.
    """
    payloads = [entry.payload for _, entry in told]
    return Observations(
        author=None if author.robot == sender else author.robot,
        life=author.life,
        version=version,
        numbers=tuple(number for number, _ in told),
        sizes=tuple(len(payload) for payload in payloads),
        poses=np.array([entry.pose for _, entry in told], dtype=np.int32).reshape(-1, 3),
        data=np.frombuffer(b"".join(payloads), dtype=np.uint8),
    )


def pose_set(
    author: Author,
    version: int,
    poses: PoseTable,
    sender: str,
    before: tuple[int, PoseTable] | None = None,
) -> PoseSet:
    """Return the message that tells a pose revision.

    Args:
        author: whose it is.
        version: its number.
        poses: (n, 3) int32 of the entries 1 to n.
        sender: who tells it; an author need not say its name.
        before: an older version, and the poses (n, 3) of the same entries in it; so told are
            differences only.
    """
    return PoseSet(
        author=None if author.robot == sender else author.robot,
        life=author.life,
        version=version,
        count=len(poses),
        back=version - before[0] if before else 0,
        data=pack_poses(poses, before[1] if before else None),
    )


def entries_of(message: Observations) -> list[tuple[int, Entry]]:
    """Return numbers and entries of a message.

    Raises:
        ValueError: its parts do not fit each other.
    """
    numbers, sizes = message.numbers, message.sizes
    if not 0 < len(numbers) == len(sizes) == len(message.poses):
        raise ValueError("parts that do not fit: numbers, sizes and poses")
    if any(after <= before for before, after in pairwise(numbers)):
        raise ValueError("numbers that do not ascend")
    if sum(sizes) != len(message.data):
        raise ValueError("parts that do not fit: sizes and data")
    data = message.data.tobytes()
    told, begin = [], 0
    for number, size, (x, y, theta) in zip(numbers, sizes, message.poses.tolist(), strict=True):
        payload = data[begin : begin + size]
        told.append((number, Entry(payload, (x, y, theta), message.version)))
        begin += size
    return told


def authors_of(message: LogHave | LogWant) -> list[Author]:
    """Return the authors that a message lists.

    Raises:
        ValueError: its parts do not fit each other.
    """
    lengths = [len(message.authors), len(message.lives), len(message.versions)]
    if isinstance(message, LogHave):
        lengths += [len(message.counts), len(message.sums)]
    elif message.bases:
        lengths.append(len(message.bases))
    authors = [Author(*pair) for pair in zip(message.authors, message.lives, strict=False)]
    if min(lengths) != max(lengths) or len({*authors}) != len(authors):
        raise ValueError("parts that do not fit: authors and what is said of them")
    ranges = message.beyond if isinstance(message, LogHave) else message.ranges
    if any(index >= len(authors) or first > last for index, first, last in ranges):
        raise ValueError("ranges that are none")
    return authors


def listing(authors: Sequence[Author]) -> dict[str, tuple[str, ...] | tuple[int, ...]]:
    """Return the fields that name authors in `LogHave` and `LogWant`."""
    return {
        "authors": tuple(author.robot for author in authors),
        "lives": tuple(author.life for author in authors),
    }
