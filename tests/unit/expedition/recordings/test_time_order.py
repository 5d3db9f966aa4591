from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from expedition.recordings.time_order import out_of_time


def stray(stamps: list[float]) -> list[int]:
    places = np.zeros((len(stamps), 2))
    return np.flatnonzero(out_of_time(np.array(stamps), places)).tolist()


def test_nothing() -> None:
    assert stray([]) == []


def test_pauses_are_no_error() -> None:
    assert stray([0.0, 1.0, 100.0, 101.0, 1e6, 1e7]) == []


def test_rare_readings_whose_clock_was_set_back() -> None:
    stamps = [1e6 + 60.0 * k for k in range(40)] + [60.0 * k for k in range(40)]
    assert stray(stamps) == []


def test_the_wrong_first_line_goes() -> None:
    assert stray([500.0, *(0.1 * k for k in range(20))]) == [0]


@given(st.lists(st.floats(0.0, 1e4), min_size=1, max_size=60))
def test_what_is_kept_goes_back_only_for_twenty_lines(stamps: list[float]) -> None:
    gone = set(stray(stamps))
    kept = [stamp for index, stamp in enumerate(stamps) if index not in gone]
    assert kept
    newest, backs = kept[0], 0
    for stamp in kept[1:]:
        backs += stamp < newest - 5.0
        newest = stamp if stamp < newest - 5.0 else max(newest, stamp)
    assert backs * 20 <= len(kept)
