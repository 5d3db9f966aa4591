from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.codec import encode, frame_bytes
from protocol.log.author_log import Author, Entry
from protocol.log.messages import (
    LogHave,
    LogWant,
    Observations,
    authors_of,
    entries_of,
    observations,
    pose_set,
)
from protocol.log.pose_coding import unpack_poses
from tests.unit.protocol.samples import header_of

ANN = Author("ann", 3)
STEPS = st.integers(-(2**31), 2**31 - 1)
ENTRIES = st.builds(Entry, st.binary(max_size=20), st.tuples(STEPS, STEPS, STEPS), st.just(4))


@given(st.dictionaries(st.integers(1, 2**31 - 1), ENTRIES, min_size=1, max_size=10))
def test_entries_come_back_as_they_were(held: dict[int, Entry]) -> None:
    told = sorted(held.items())
    message = observations(ANN, told, "ben", 4)
    assert (message.author, message.life) == ("ann", 3)
    assert entries_of(message) == told


def test_an_author_need_not_say_its_name() -> None:
    assert observations(ANN, [(1, Entry(b"", (0, 0, 0), 0))], "ann", 0).author is None
    message = pose_set(ANN, 2, np.ones((5, 3), dtype=np.int32), "ann")
    assert message.author is None
    assert unpack_poses(message.data, message.count, 5).tolist() == [[1, 1, 1]] * 5
    assert pose_set(ANN, 2, np.ones((5, 3), dtype=np.int32), "ben").author == "ann"


def test_a_frame_of_two_observations_is_small() -> None:
    told = [(n, Entry(bytes(130), (12_345, -6_789, 31_000), 3)) for n in (1000, 1001)]
    message = observations(ANN, told, "ann", 3)
    assert frame_bytes(encode(header_of(message, to="*"), message)) < 2 * 130 + 145


def changed(**changes: object) -> Observations:
    told = [(n, Entry(b"abc", (1, 2, 3), 0)) for n in (1, 2)]
    return observations(ANN, told, "ann", 0).model_copy(update=changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"numbers": (1,)},
        {"numbers": (2, 1)},
        {"numbers": (1, 1)},
        {"sizes": (3, 4)},
        {"sizes": (3,)},
        {"poses": np.zeros((3, 3), dtype=np.int32)},
        {"numbers": (), "sizes": (), "poses": np.zeros((0, 3), dtype=np.int32)},
        {"data": np.zeros(5, dtype=np.uint8)},
    ],
    ids=str,
)
def test_parts_that_do_not_fit_are_refused(changes: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"fit|ascend"):
        entries_of(changed(**changes))


def test_authors_are_listed_once_and_with_all_that_is_said_of_them() -> None:
    want = LogWant(authors=("ann", "ann"), lives=(0, 1), versions=(0, 0), ranges=((1, 2, 2),))
    assert authors_of(want) == [Author("ann", 0), Author("ann", 1)]
    have = LogHave(authors=("ann",), lives=(0,), counts=(4,), versions=(0,), sums=(0,))
    assert authors_of(have) == [Author("ann", 0)]
    for bad in (
        want.model_copy(update={"lives": (0, 0)}),
        want.model_copy(update={"versions": (0,)}),
        want.model_copy(update={"ranges": ((2, 1, 1),)}),
        want.model_copy(update={"ranges": ((0, 2, 1),)}),
        have.model_copy(update={"counts": ()}),
        have.model_copy(update={"sums": (1, 2)}),
        have.model_copy(update={"beyond": ((1, 9, 9),)}),
    ):
        with pytest.raises(ValueError, match=r"fit|none"):
            authors_of(bad)
