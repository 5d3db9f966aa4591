"""Many maps that have most of their cells in common: tiles, shared until one of them is written to.

Each particle has a table that names, for every place, the tile that holds its cells. When a
particle is duplicated only its table is; the first write to a tile that several tables name copies
that tile. So memory grows with what differs between the maps, not with their number.

Source: Eliazar & Parr 2004, "DP-SLAM 2.0", for maps that particles inherit from each other; the
sharing by copy on write is that of every operating system.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.grid import Padding

Ids = npt.NDArray[np.int32]
Shorts = npt.NDArray[np.int16]

SIDE_BITS = 3
SIDE = 1 << SIDE_BITS  # cells along the edge of a tile
NO_TILE = -1


class SharedTiles:
    """The tiles of several maps of one lattice.

    Attributes:
        tables: (maps, layers, rows, cols) int32, by place the tile of each map, or -1: all zero.
        pool: (capacity, SIDE * SIDE, fields) int16, the cells of each tile row by row.
        references: (capacity,) int32, how many places of all tables name the tile.
        free: (capacity + 1,) int32, first their number, then the tiles that nobody names.
    """

    __slots__ = ("free", "pool", "references", "tables")

    def __init__(self, maps: int, layers: int, fields: int) -> None:
        self.tables: Ids = np.full((maps, layers, 1, 1), NO_TILE, dtype=np.int32)
        self.pool: Shorts = np.zeros((0, SIDE * SIDE, fields), dtype=np.int16)
        self.references: Ids = np.zeros(0, dtype=np.int32)
        self.free: Ids = np.zeros(1, dtype=np.int32)

    @property
    def used(self) -> int:
        """Number of tiles that some map names."""
        return len(self.references) - int(self.free[0])

    def grow(self, padding: Padding) -> None:
        """Make all tables larger, by so many tiles on each side."""
        if not padding.none:
            self.tables = padding.pad(self.tables, NO_TILE)

    def reserve(self, tiles: int) -> None:
        """Make room for writes to `tiles` tiles that are new, or shared so far."""
        lacking = tiles - int(self.free[0])
        if lacking <= 0:
            return
        capacity = len(self.references)
        more = max(lacking, capacity // 8)
        # In place: a copy would need the memory twice, at the very moment it is short.
        self.pool.resize((capacity + more, *self.pool.shape[1:]), refcheck=False)
        self.references = np.concatenate((self.references, np.zeros(more, dtype=np.int32)))
        new = np.arange(capacity + more - 1, capacity - 1, -1, dtype=np.int32)
        unnamed = self.free[1 : self.free[0] + 1]
        spare = np.zeros(capacity - len(unnamed), dtype=np.int32)
        self.free = np.concatenate(
            (np.array([more + len(unnamed)], dtype=np.int32), new, unnamed, spare)
        )

    def inherit(self, parents: npt.NDArray[np.int64]) -> None:
        """Let map i become what map `parents[i]` is, for each i; nothing is copied but tables.

        Args:
            parents: (maps,) int64; a map that is inherited from must itself stay what it is.

        Raises:
            ValueError: it does not.
        """
        if (parents[parents] != parents).any():
            raise ValueError("a map that others inherit must keep its place: parents[i] is i")
        for heir in np.flatnonzero(parents != np.arange(len(parents))):
            _name_tiles_of(
                self.tables[heir], self.tables[parents[heir]], self.references, self.free
            )


@compiled
def _name_tiles_of(heir: Ids, parent: Ids, references: Ids, free: Ids) -> None:
    """Make one table (layers, rows, cols) a copy of another; count who names what."""
    layers, rows, cols = heir.shape
    for layer in range(layers):
        for ty in range(rows):
            for tx in range(cols):
                old, new = heir[layer, ty, tx], parent[layer, ty, tx]
                if old == new:
                    continue
                if old >= 0:
                    references[old] -= 1
                    if references[old] == 0:
                        free[0] += 1
                        free[free[0]] = old
                if new >= 0:
                    references[new] += 1
                heir[layer, ty, tx] = new


@compiled
def find_cell(table: Ids, layer: int, iy: int, ix: int) -> tuple[int, int]:
    """Return tile and place within it of a cell, -1 and 0 if the map has no tile there.

    Args:
        table: (layers, rows, cols) int32 of one map.
        layer: which layer.
        iy: row of the cell from the lattice's corner; `ix` its column; may lie outside.
    """
    ty, tx = iy >> SIDE_BITS, ix >> SIDE_BITS
    if ty < 0 or tx < 0 or ty >= table.shape[1] or tx >= table.shape[2]:
        return NO_TILE, 0
    return int(table[layer, ty, tx]), (iy & (SIDE - 1)) * SIDE + (ix & (SIDE - 1))


@compiled
def own_tile(
    table: Ids,
    layer: int,
    iy: int,
    ix: int,
    pool: Shorts,
    references: Ids,
    free: Ids,
) -> int:
    """Return a tile that this map alone names for a cell, ready to be written to; -1 if outside.

    Args:
        table: (layers, rows, cols) int32 of one map, changed here.
        layer: which layer.
        iy: row of the cell from the lattice's corner; `ix` its column.
        pool: `SharedTiles.pool`; `references` and `free` alike. Room must have been reserved.
    """
    ty, tx = iy >> SIDE_BITS, ix >> SIDE_BITS
    if ty < 0 or tx < 0 or ty >= table.shape[1] or tx >= table.shape[2]:
        return NO_TILE
    tile = int(table[layer, ty, tx])
    if tile >= 0 and references[tile] == 1:
        return tile
    own = int(free[free[0]])
    free[0] -= 1
    references[own] = 1
    if tile >= 0:
        references[tile] -= 1
        pool[own] = pool[tile]
    else:
        pool[own] = 0
    table[layer, ty, tx] = own
    return own
