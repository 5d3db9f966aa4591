"""Tables of small whole numbers as bytes: adaptive, for tables too short for a general compressor.

Of each number first its length in bits is written, as six decisions, then its bits. Each decision
has its own odds, which follow what came before in the same column; so a column that is mostly zero
takes a small part of a bit a row. The odds are counts, split in integers: both ends compute the
same.

Source: binary decisions with odds by counting, Krichevsky & Trofimov 1981; exponential Golomb
codes, Teuhola 1978.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.entropy_coding import (
    TOTAL,
    Bytes,
    Ints,
    finish,
    new_reader,
    new_writer,
    place_of_next,
    room_for,
    take_share,
    write_share,
)

Table = npt.NDArray[np.int32]

_LENGTHS = 64  # 0 to 32 bits, told in six decisions
_LENGTH_BITS = 6
_NUMBER_BITS = 32
_STEP = 5  # what a decision adds to its count,
_START = 2  # and what each count begins with: (n + 0.4) / (all + 0.8)
_MOST = 1500  # halved there, so that old ones weigh less


def encode_integers(table: Table) -> Bytes:
    """Return the bytes (k,) uint8 of a table (n, columns) int32."""
    rows, columns = table.shape
    out = np.zeros(room_for(rows * columns * (_LENGTH_BITS + _NUMBER_BITS)), dtype=np.uint8)
    zigzag = (table.astype(np.int64) << 1) ^ (table.astype(np.int64) >> 63)
    state = new_writer()
    _write(state, out, np.ascontiguousarray(zigzag), _new_counts(columns))
    return out[: finish(state, out)].copy()


def decode_integers(data: Bytes, rows: int, columns: int) -> Table:
    """Return the table (rows, columns) int32 that `encode_integers` made these bytes of.

    Bytes that were damaged give some other table, never a fault.
    """
    zigzag = _read(data, rows, _new_counts(columns))
    return ((zigzag >> 1) ^ -(zigzag & 1)).astype(np.int32)


def _new_counts(columns: int) -> Ints:
    """Return fresh counts (columns, 2, decisions, 2).

    By column; whether the number before was zero; the decision, of the length, then the first bit
    by length; and how often it was 0 and 1.
    """
    return np.full((columns, 2, _LENGTHS + _NUMBER_BITS + 1, 2), _START, dtype=np.int64)


@compiled
def _write(state: Ints, out: Bytes, zigzag: Ints, counts: Ints) -> None:
    """Write a table of numbers (n, columns), none negative."""
    rows, columns = zigzag.shape
    for row in range(rows):
        for column in range(columns):
            number = zigzag[row, column]
            before = 1 if row > 0 and zigzag[row - 1, column] != 0 else 0
            mine = counts[column, before]
            length = 0
            while number >> length:
                length += 1
            node = 1
            for k in range(_LENGTH_BITS - 1, -1, -1):
                bit = (length >> k) & 1
                _write_bit(state, out, mine[node], bit)
                node = 2 * node + bit
            for k in range(length - 2, -1, -1):
                bit = (number >> k) & 1
                if k == length - 2:
                    _write_bit(state, out, mine[_LENGTHS + length], bit)
                else:
                    write_share(state, out, bit * (TOTAL // 2), TOTAL // 2)


@compiled
def _read(data: Bytes, rows: int, counts: Ints) -> Ints:
    """Read a table (rows, columns) of numbers, none negative."""
    state = new_reader(data)
    columns = len(counts)
    zigzag = np.zeros((rows, columns), dtype=np.int64)
    for row in range(rows):
        for column in range(columns):
            before = 1 if row > 0 and zigzag[row - 1, column] != 0 else 0
            mine = counts[column, before]
            node = 1
            for _ in range(_LENGTH_BITS):
                node = 2 * node + _read_bit(state, data, mine[node])
            length = min(node - _LENGTHS, _NUMBER_BITS)
            number = 1 if length else 0
            for k in range(length - 2, -1, -1):
                if k == length - 2:
                    bit = _read_bit(state, data, mine[_LENGTHS + length])
                else:
                    bit = 1 if place_of_next(state) >= TOTAL // 2 else 0
                    take_share(state, data, bit * (TOTAL // 2), TOTAL // 2)
                number = 2 * number + bit
            zigzag[row, column] = number
    return zigzag


@compiled
def _split(count: Ints) -> int:
    """Return the share of a decision that is 0."""
    return int(TOTAL * count[0] // (count[0] + count[1]))


@compiled
def _learn(count: Ints, bit: int) -> None:
    count[bit] += _STEP
    if count[0] + count[1] > _MOST:
        count[0] = count[0] // 2 + 1
        count[1] = count[1] // 2 + 1


@compiled
def _write_bit(state: Ints, out: Bytes, count: Ints, bit: int) -> None:
    zero = _split(count)
    if bit:
        write_share(state, out, zero, TOTAL - zero)
    else:
        write_share(state, out, 0, zero)
    _learn(count, bit)


@compiled
def _read_bit(state: Ints, data: Bytes, count: Ints) -> int:
    zero = _split(count)
    bit = 1 if place_of_next(state) >= zero else 0
    if bit:
        take_share(state, data, zero, TOTAL - zero)
    else:
        take_share(state, data, 0, zero)
    _learn(count, bit)
    return bit
