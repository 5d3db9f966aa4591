"""A range coder: symbols become bytes, each at the price of its probability, and come back.

The coder knows nothing of symbols. Whoever codes splits 0 .. 2**TOTAL_BITS among them anew before
each one (that is what makes it adaptive) and hands over the share of the one that comes. The reader
asks where in the whole the next symbol lies, finds whose share that is, and hands over the same
share. All is integer arithmetic on 32 bits, held in int64, so that a carry is seen.

A reader goes on with zeros where the bytes end: that saves the zeros at the end, and makes reading
of damaged bytes end as soon as reading of whole ones. What it reads then is some other symbols,
never a fault.

Source: Martin 1979 ("Range encoding"); the carry is held back as Subbotin's coder does.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled

TOTAL_BITS = 20
"""Shares are in units of 2**-20 of the whole."""

TOTAL = 1 << TOTAL_BITS

Ints = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]

_TOP = 1 << 32
_NARROW = 1 << 24  # a range below this moves on by a byte
_FULL_BYTES = 0xFF << 24
# Where the state of a writer, or of a reader, keeps what.
_LOW, _RANGE, _HELD, _PENDING, AT = 0, 1, 2, 3, 4
_NOTHING_HELD = -1


def new_writer() -> Ints:
    """Return the state of a writer that has written nothing, (5,) int64."""
    return np.array([0, _TOP - 1, _NOTHING_HELD, 0, 0], dtype=np.int64)


@compiled
def new_reader(data: Bytes) -> Ints:
    """Return the state of a reader at the beginning of `data`, (5,) int64."""
    state = np.zeros(5, dtype=np.int64)
    state[_RANGE] = _TOP - 1
    for _ in range(4):
        state[_LOW] = (state[_LOW] << 8) | _next_byte(state, data)
    return state


def room_for(symbols: int) -> int:
    """Return how many bytes so many symbols take at most."""
    return (symbols * TOTAL_BITS) // 8 + symbols // 8 + 8


@compiled
def write_share(state: Ints, out: Bytes, first: int, width: int) -> None:
    """Append the symbol whose share is `first` .. `first + width`; moves `state` on.

    Args:
        state: of the writer.
        out: takes the bytes; `room_for` tells how long it has to be.
        first: where the share begins, 0 .. TOTAL - 1.
        width: how wide it is, 1 .. TOTAL - first.
    """
    unit = state[_RANGE] >> TOTAL_BITS
    state[_LOW] += unit * first
    # The last share takes what the division left over.
    if first + width == TOTAL:
        state[_RANGE] -= unit * first
    else:
        state[_RANGE] = unit * width
    while state[_RANGE] < _NARROW:
        state[_RANGE] <<= 8
        _shift_out(state, out)


@compiled
def finish(state: Ints, out: Bytes) -> int:
    """Write what tells the symbols so far from all others; return how many bytes there are."""
    low, last = state[_LOW], state[_LOW] + state[_RANGE] - 1
    for zeros in range(32, -1, -8):
        mask = (1 << zeros) - 1
        value = (low + mask) & ~mask
        if value <= last:
            state[_LOW] = value
            break
    for _ in range(5):
        _shift_out(state, out)
    length = state[AT]
    while length > 0 and out[length - 1] == 0:
        length -= 1
    return int(length)


@compiled
def _shift_out(state: Ints, out: Bytes) -> None:
    """Move on by a byte; one that a carry may still change is held back."""
    low = state[_LOW]
    if low < _FULL_BYTES or low >= _TOP:
        carry = low >> 32
        if state[_HELD] != _NOTHING_HELD:
            _append(state, out, state[_HELD] + carry)
        while state[_PENDING] > 0:
            _append(state, out, 0xFF + carry)
            state[_PENDING] -= 1
        state[_HELD] = (low >> 24) & 0xFF
    else:
        state[_PENDING] += 1
    state[_LOW] = (low & 0xFFFFFF) << 8


@compiled
def _append(state: Ints, out: Bytes, byte: int) -> None:
    out[state[AT]] = byte & 0xFF
    state[AT] += 1


@compiled
def place_of_next(state: Ints) -> int:
    """Return where in the whole the next symbol lies, 0 .. TOTAL - 1."""
    return int(min(state[_LOW] // (state[_RANGE] >> TOTAL_BITS), TOTAL - 1))


@compiled
def take_share(state: Ints, data: Bytes, first: int, width: int) -> None:
    """Go past the symbol with this share; it must hold `place_of_next`. Moves `state` on."""
    unit = state[_RANGE] >> TOTAL_BITS
    state[_LOW] -= unit * first
    if first + width == TOTAL:
        state[_RANGE] -= unit * first
    else:
        state[_RANGE] = unit * width
    while state[_RANGE] < _NARROW:
        state[_RANGE] <<= 8
        state[_LOW] = (state[_LOW] << 8) | _next_byte(state, data)


@compiled
def _next_byte(state: Ints, data: Bytes) -> int:
    """Return the next byte, 0 after the end; counts how many were asked for."""
    at = state[AT]
    state[AT] += 1
    return int(data[at]) if at < len(data) else 0
