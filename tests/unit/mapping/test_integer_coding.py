from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mapping.integer_coding import decode_integers, encode_integers


@given(hnp.arrays(np.int32, st.tuples(st.integers(0, 20), st.integers(1, 4))))
@settings(deadline=None)
def test_any_table_comes_back(table: np.ndarray) -> None:
    back = decode_integers(encode_integers(table), *table.shape)
    assert back.dtype == np.int32
    assert np.array_equal(back, table)


def test_zeros_take_next_to_nothing_and_small_numbers_little() -> None:
    zeros = np.zeros((1000, 3), dtype=np.int32)
    assert len(encode_integers(zeros)) < 20
    small = np.random.default_rng(1).integers(-2, 3, (1000, 3)).astype(np.int32)
    # log2(5) bits each; what is above that is odds that are learnt, and last bits without odds.
    assert len(encode_integers(small)) < 1.2 * 3000 * np.log2(5) / 8


@given(st.binary(max_size=40))
@settings(deadline=None, max_examples=50)
def test_damaged_bytes_give_some_table(data: bytes) -> None:
    assert decode_integers(np.frombuffer(data, dtype=np.uint8), 5, 3).shape == (5, 3)


def test_old_odds_fade() -> None:
    table = np.zeros((800, 1), dtype=np.int32)
    table[400:] = 1
    assert len(encode_integers(table)) < 60
    assert np.array_equal(decode_integers(encode_integers(table), 800, 1), table)
