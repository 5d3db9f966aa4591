from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.cell_box import CellBox
from mapping.changed_regions import TILE, changed_regions


def test_equal_grids_differ_nowhere() -> None:
    cells = np.ones((40, 70), dtype=np.int8)
    assert changed_regions(cells, cells.copy(), CellBox(0, 0, 40, 70)) == []


def test_far_changes_are_apart_and_near_ones_together() -> None:
    before = np.zeros((10 * TILE, 10 * TILE), dtype=np.int8)
    after = before.copy()
    after[3, 5] = after[TILE + 2, TILE + 7] = 1  # in tiles that meet at a corner
    after[8 * TILE + 1 : 8 * TILE + 4, 6 * TILE - 2 : 6 * TILE + 2] = -7
    assert changed_regions(before, after, CellBox(100, 200, 420, 520)) == [
        CellBox(103, 205, 100 + TILE + 3, 200 + TILE + 8),
        CellBox(101 + 8 * TILE, 198 + 6 * TILE, 104 + 8 * TILE, 202 + 6 * TILE),
    ]


@settings(max_examples=40, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 130), st.integers(1, 130)),
    changes=st.lists(st.tuples(st.integers(0, 129), st.integers(0, 129)), max_size=12),
)
def test_every_change_is_in_a_region_and_every_edge_is_needed(
    shape: tuple[int, int], changes: list[tuple[int, int]]
) -> None:
    before = np.zeros(shape, dtype=np.int8)
    after = before.copy()
    for iy, ix in changes:
        after[iy % shape[0], ix % shape[1]] = 3
    regions = changed_regions(before, after, CellBox(0, 0, *shape))
    left = before != after
    for box in regions:
        part = (before != after)[box.slices]
        assert part[0].any() and part[-1].any() and part[:, 0].any() and part[:, -1].any()
        left[box.slices] = False
    assert not left.any()
