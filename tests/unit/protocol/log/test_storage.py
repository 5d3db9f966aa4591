from __future__ import annotations

import zlib

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.errors import DamagedLogError
from protocol.log.author_log import Author, Entry
from protocol.log.observation_log import ObservationLog
from protocol.log.storage import dump, load

ANN = Author("ann", 1)


def some_log() -> ObservationLog:
    log = ObservationLog("me", 3)
    log.append(b"one", (1, 2, 3))
    log.revise(np.array([[5, 6, 7]], dtype=np.int32), log.own.count)
    log.append(b"", (-1, -2, -3))
    log.put(ANN, 4, Entry(b"four", (4, 4, 4), 2), "ben")
    return log


def forged(body: object) -> bytes:
    packed = msgpack.packb(body)
    return b"observation log 1\n" + zlib.crc32(packed).to_bytes(4, "little") + packed


def test_a_log_comes_back_as_it_was() -> None:
    log = some_log()
    back = load(dump(log))
    assert back.me == log.me
    assert back.digest() == log.digest()
    assert dump(back) == dump(log)
    assert back.of(ANN).entries == log.of(ANN).entries
    assert back.own.checksum(2) == log.own.checksum(2)
    assert back.append(b"three", (0, 0, 0)) == 3
    assert set(back.take_changes().entries) == {(back.me, 1), (back.me, 2), (back.me, 3), (ANN, 4)}


SAVED = dump(some_log())


@given(st.data())
@settings(deadline=None)
def test_damaged_bytes_are_refused_with_the_mend(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(SAVED) - 1))
    flipped = bytearray(SAVED)
    flipped[at] ^= 1 << data.draw(st.integers(0, 7))
    for damaged in (bytes(flipped), SAVED[:at]):
        with pytest.raises(DamagedLogError, match="delete it"):
            load(damaged)


@pytest.mark.parametrize(
    "body",
    [
        None,
        [],
        [["me", 0]],
        [["m e", 0], []],
        [["me", "0"], []],
        [["me", 0], [[["ann", 0], [[0, b"", [1, 2, 3], 0, "x"]], 0, b"", ""]]],
        [["me", 0], [[["ann", 0], [[1, "", [1, 2, 3], 0, "x"]], 0, b"", ""]]],
        [["me", 0], [[["ann", 0], [[1, b"", [1, 2], 0, "x"]], 0, b"", ""]]],
        [["me", 0], [[["ann", 0], [[1, b"", [1, 2, 2**40], 0, "x"]], 0, b"", ""]]],
        [["me", 0], [[["ann", 0], [], 1, b"12345", ""]]],
    ],
)
def test_other_contents_are_refused(body: object) -> None:
    with pytest.raises(DamagedLogError, match="another kind"):
        load(forged(body))
