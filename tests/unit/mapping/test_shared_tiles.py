from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.grid import Padding
from mapping.resampling import systematic_resample
from mapping.shared_tiles import NO_TILE, SIDE, SharedTiles, find_cell, own_tile

MAPS = 3
Cell = tuple[int, int, int]


def write(tiles: SharedTiles, particle: int, cell: Cell, value: int) -> None:
    tiles.reserve(1)
    tile = own_tile(tiles.tables[particle], *cell, tiles.pool, tiles.references, tiles.free)
    _, place = find_cell(tiles.tables[particle], *cell)
    tiles.pool[tile, place, 0] = value


def read(tiles: SharedTiles, particle: int, cell: Cell) -> int:
    tile, place = find_cell(tiles.tables[particle], *cell)
    return 0 if tile == NO_TILE else int(tiles.pool[tile, place, 0])


def started() -> SharedTiles:
    tiles = SharedTiles(MAPS, 2, 1)
    tiles.grow(Padding(0, 1, 0, 1))
    return tiles


cells = st.tuples(st.integers(0, 1), st.integers(0, 2 * SIDE - 1), st.integers(0, 2 * SIDE - 1))
writes = st.tuples(st.integers(0, MAPS - 1), cells, st.integers(1, 9))
seeds = st.integers(0, 2**32)


@settings(max_examples=60)
@given(st.lists(writes | seeds, max_size=40))
def test_shared_maps_are_as_good_as_copies(steps: list[tuple[int, Cell, int] | int]) -> None:
    tiles = started()
    copies: list[dict[Cell, int]] = [{} for _ in range(MAPS)]
    for step in steps:
        if isinstance(step, int):
            rng = np.random.default_rng(step)
            parents = systematic_resample(rng.dirichlet(np.ones(MAPS)), rng)
            tiles.inherit(parents)
            copies = [dict(copies[parent]) for parent in parents]
        else:
            particle, cell, value = step
            write(tiles, particle, cell, value)
            copies[particle][cell] = value
    for particle, copy in enumerate(copies):
        for layer in range(2):
            for iy in range(2 * SIDE):
                for ix in range(2 * SIDE):
                    cell = (layer, iy, ix)
                    assert read(tiles, particle, cell) == copy.get(cell, 0)
    named = np.bincount(tiles.tables[tiles.tables >= 0], minlength=len(tiles.references))
    assert (named == tiles.references).all()
    assert tiles.used == (named > 0).sum()
    unnamed = tiles.free[1 : tiles.free[0] + 1]
    assert sorted(unnamed) == np.flatnonzero(named == 0).tolist()


def test_heirs_cost_nothing_until_they_differ() -> None:
    tiles = started()
    write(tiles, 0, (0, 1, 1), 5)
    write(tiles, 0, (0, 1, SIDE + 1), 6)
    tiles.inherit(np.array([0, 0, 0]))
    assert tiles.used == 2
    write(tiles, 2, (0, 1, 2), 7)
    assert tiles.used == 3
    assert [read(tiles, i, (0, 1, 2)) for i in range(MAPS)] == [0, 0, 7]
    assert [read(tiles, i, (0, 1, 1)) for i in range(MAPS)] == [5, 5, 5]


def test_a_map_that_is_inherited_must_stay() -> None:
    with pytest.raises(ValueError, match="keep its place"):
        started().inherit(np.array([1, 2, 2]))


def test_outside_of_the_tables_there_is_nothing() -> None:
    tiles = started()
    tiles.reserve(1)
    for iy, ix in ((-1, 0), (0, -1), (2 * SIDE, 0), (0, 2 * SIDE)):
        assert find_cell(tiles.tables[0], 0, iy, ix) == (NO_TILE, 0)
        assert (
            own_tile(tiles.tables[0], 0, iy, ix, tiles.pool, tiles.references, tiles.free)
            == NO_TILE
        )
    assert tiles.used == 0


def test_growing_keeps_what_was_written() -> None:
    tiles = started()
    write(tiles, 1, (1, 2, 3), 4)
    tiles.grow(Padding(1, 0, 2, 0))
    tiles.grow(Padding(0, 0, 0, 0))
    assert read(tiles, 1, (1, 2 + SIDE, 3 + 2 * SIDE)) == 4
