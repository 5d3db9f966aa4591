"""How robots tell each other what they observed, and find out what they lack.

Field names are short: a frame of two observations has room for 300 bytes of them. Parts of a
message that must fit each other are checked where they are read, see `entries_of`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from protocol.fields import ArrayField, Name
from protocol.messages import Message
from protocol.observation_log import Author, Entry
from protocol.pose_coding import PoseTable, pack_poses

ENTRIES_IN_FRAME = 256
RANGES_IN_FRAME = 256
AUTHORS_IN_FRAME = 64
DATA_IN_FRAME = 262_144

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


class Observations(Message):
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


class PoseSet(Message):
    """New poses of an author's entries 1 to `count`, in place of all older ones.

    `data` holds them packed, see `protocol.pose_coding`. The author as in `observations`.
    """

    type: Literal["pose_set"] = "pose_set"
    author: Name | None = None
    life: Tally
    version: Number
    count: Tally
    data: Data


class LogHave(Message):
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


class LogWant(Message):
    """What the sender wants from the receiver.

    `ranges` are (index of the author, first, last); `versions[i]` is the pose revision wanted of
    author i, or any newer one; 0 for none.
    """

    type: Literal["log_want"] = "log_want"
    authors: Authors
    lives: Tallies
    versions: Tallies
    ranges: NumberRanges = ()


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


def pose_set(author: Author, version: int, poses: PoseTable, sender: str) -> PoseSet:
    """Return the message that tells a pose revision; arguments as for `observations`."""
    return PoseSet(
        author=None if author.robot == sender else author.robot,
        life=author.life,
        version=version,
        count=len(poses),
        data=pack_poses(poses),
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
