"""Map cells on the wire."""

from __future__ import annotations

import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mapping.grid import GridGeometry
from protocol.map_cells import (
    LARGEST_CELLS,
    dequantise,
    map_digest,
    pack_cells,
    quantise,
    unpack_cells,
)

SHAPES = st.tuples(st.integers(1, 20), st.integers(1, 20))


@given(hnp.arrays(np.float32, SHAPES, elements=st.floats(-20, 20, width=32)))
@settings(max_examples=60, deadline=None)
def test_cells_come_back_within_half_a_step(log_odds: np.ndarray) -> None:
    cells = unpack_cells(pack_cells(log_odds), *log_odds.shape)
    assert cells.dtype == np.int8 and cells.shape == log_odds.shape
    assert np.array_equal(cells, quantise(log_odds))
    clipped = np.clip(log_odds, -6.35, 6.35)
    assert np.abs(dequantise(cells) - clipped).max() <= 0.0251


def test_unknown_stays_unknown_and_bounds_hold() -> None:
    log_odds = np.array([[0.0, 100.0, -100.0]], dtype=np.float32)
    assert unpack_cells(pack_cells(log_odds), 1, 3).tolist() == [[0, 127, -127]]


@given(st.binary(max_size=200))
@settings(max_examples=60, deadline=None)
def test_any_bytes_are_refused_politely(data: bytes) -> None:
    with pytest.raises(ValueError):
        unpack_cells(np.frombuffer(data, dtype=np.uint8), 7, 11)


def test_wrong_sizes_are_refused() -> None:
    packed = pack_cells(np.zeros((4, 5), dtype=np.float32))
    for rows, cols in ((5, 5), (0, 20), (-4, -5), (20000, 20000), (LARGEST_CELLS, 2)):
        with pytest.raises(ValueError, match="cells"):
            unpack_cells(packed, rows, cols)


def test_a_bomb_is_not_opened() -> None:
    bomb = zstandard.ZstdCompressor().compress(bytes(50_000_000))
    with pytest.raises(ValueError, match="announce"):
        unpack_cells(np.frombuffer(bomb, dtype=np.uint8), 10, 10)


def test_damaged_and_trailing_bytes_are_refused() -> None:
    rng = np.random.default_rng(0)
    packed = pack_cells(rng.normal(size=(30, 30)).astype(np.float32))
    with pytest.raises(ValueError, match="decompressed"):
        unpack_cells(packed[:-20], 30, 30)
    with pytest.raises(ValueError, match="decompressed"):
        unpack_cells(np.append(packed, np.uint8(7)), 30, 30)


def test_the_digest_tells_maps_apart_but_not_the_room_around_them() -> None:
    cells = np.array([[0, 0, 0], [0, 5, -7], [0, 0, 9]], dtype=np.int8)
    geometry = GridGeometry(0.05, -0.15, 0.3, 3, 3)
    digest = map_digest(cells, geometry)
    assert len(digest) == 64
    roomy = np.pad(cells, ((2, 1), (4, 3)))
    assert map_digest(roomy, GridGeometry(0.05, -0.35, 0.2, *roomy.shape)) == digest
    assert map_digest(cells, GridGeometry(0.05, -0.1, 0.3, 3, 3)) != digest
    changed = cells.copy()
    changed[1, 1] = 6
    assert map_digest(changed, geometry) != digest
    assert map_digest(np.zeros((3, 3), dtype=np.int8), geometry) == ""
