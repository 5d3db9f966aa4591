from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mapping.bucket_wave import BLOCKED
from mapping.cell_box import CellBox
from mapping.coarse_weights import block_box, coarsen_weights, refresh_weights


def test_a_block_costs_what_its_cheapest_cell_costs() -> None:
    weights = np.array([[0, 3, 0], [9, 2, 0], [0, 0, 5]], dtype=np.uint8)
    assert coarsen_weights(weights, 2).tolist() == [[2, BLOCKED], [BLOCKED, 5]]


def test_box_of_blocks() -> None:
    assert block_box(CellBox(3, 4, 9, 8), 4) == CellBox(0, 1, 3, 2)


@given(
    shape=st.tuples(st.integers(1, 12), st.integers(1, 12)),
    factor=st.integers(1, 4),
    seed=st.integers(0, 1000),
)
def test_refreshing_a_box_is_making_all_anew(
    shape: tuple[int, int], factor: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    weights = rng.integers(0, 7, shape).astype(np.uint8)
    coarse = coarsen_weights(weights, factor)
    iy0, ix0 = int(rng.integers(0, shape[0])), int(rng.integers(0, shape[1]))
    box = CellBox(iy0, ix0, shape[0], shape[1])
    weights[box.slices] = rng.integers(0, 7, (box.iy1 - iy0, box.ix1 - ix0))
    refresh_weights(coarse, weights, factor, box)
    np.testing.assert_array_equal(coarse, coarsen_weights(weights, factor))
