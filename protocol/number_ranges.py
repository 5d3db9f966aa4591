"""Ascending numbers as ranges (first, last), both included: 1 2 3 7 is (1, 3) (7, 7)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

Range = tuple[int, int]


def ranges_of(numbers: Iterable[int]) -> list[Range]:
    """Return the ranges of ascending numbers."""
    ranges: list[Range] = []
    for number in numbers:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1] = (ranges[-1][0], number)
        else:
            ranges.append((number, number))
    return ranges


def numbers_of(ranges: Iterable[Range], most: int) -> Iterator[int]:
    """Yield the numbers of ranges, but no more than `most`: ranges from a peer may claim any."""
    for first, last in ranges:
        for number in range(first, min(last, first + most - 1) + 1):
            yield number
            most -= 1


def holds(ranges: Iterable[Range], number: int) -> bool:
    """Whether a number is in one of the ranges."""
    return any(first <= number <= last for first, last in ranges)
