from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.entropy_coding import (
    TOTAL,
    finish,
    new_reader,
    new_writer,
    place_of_next,
    room_for,
    take_share,
    write_share,
)

# Shares that cut the whole, by how wide they are; some as narrow and as wide as can be.
shares = st.lists(
    st.tuples(st.integers(0, TOTAL - 1), st.integers(1, TOTAL)).map(
        lambda share: (share[0], min(share[1], TOTAL - share[0]))
    ),
    max_size=60,
)


def written(symbols: list[tuple[int, int]]) -> bytes:
    out = np.zeros(room_for(len(symbols)), dtype=np.uint8)
    state = new_writer()
    for first, width in symbols:
        write_share(state, out, first, width)
    return out[: finish(state, out)].tobytes()


def read_back(data: bytes, symbols: list[tuple[int, int]]) -> None:
    array = np.frombuffer(data, dtype=np.uint8)
    state = new_reader(array)
    for first, width in symbols:
        assert first <= place_of_next(state) < first + width
        take_share(state, array, first, width)


@given(shares)
def test_what_was_written_is_read(symbols):
    read_back(written(symbols), symbols)


@given(shares)
def test_a_symbol_costs_what_its_share_asks_for(symbols):
    bits = sum(math.log2(TOTAL / width) for _, width in symbols)
    assert 8 * len(written(symbols)) <= bits + 9 + 0.1 * len(symbols)


@pytest.mark.parametrize("first", [0, TOTAL // 2, TOTAL - 1, TOTAL - 2])
def test_carries_run_through_many_bytes(first):
    symbols = [(TOTAL - 1, 1)] * 9 + [(first, 1)] * 9 + [(TOTAL // 3, TOTAL // 3)] * 40
    read_back(written(symbols), symbols)


def test_a_carry_reaches_bytes_held_back():
    # The middle of the range stays on a boundary of bytes until the last symbols decide.
    for last in range(0, TOTAL, TOTAL // 64):
        symbols = [(TOTAL // 2 - 1, 2)] * 12 + [(last, 1)] * 3
        read_back(written(symbols), symbols)


def test_nothing_takes_no_bytes():
    assert written([]) == b""
    assert written([(0, TOTAL)] * 5) == b""


@given(st.binary(max_size=12), st.integers(1, TOTAL - 1))
def test_any_bytes_are_some_symbols(data, cut):
    array = np.frombuffer(data, dtype=np.uint8)
    state = new_reader(array)
    for _ in range(40):
        place = place_of_next(state)
        assert 0 <= place < TOTAL
        first, end = (0, cut) if place < cut else (cut, TOTAL)
        take_share(state, array, first, end - first)
