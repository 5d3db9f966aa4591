from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from protocol.number_ranges import holds, numbers_of, ranges_of


def test_examples() -> None:
    assert ranges_of([]) == []
    assert ranges_of([1, 2, 3, 7]) == [(1, 3), (7, 7)]
    assert list(numbers_of([(1, 3), (7, 7)], 100)) == [1, 2, 3, 7]


@given(st.sets(st.integers(1, 60)))
def test_ranges_hold_just_their_numbers(numbers: set[int]) -> None:
    ranges = ranges_of(sorted(numbers))
    assert list(numbers_of(ranges, 1000)) == sorted(numbers)
    assert [n for n in range(62) if holds(ranges, n)] == sorted(numbers)


def test_no_more_numbers_come_out_than_wanted() -> None:
    assert list(numbers_of([(5, 2**31 - 1), (1, 2**31 - 1)], 3)) == [5, 6, 7]
