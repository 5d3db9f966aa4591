from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.closest_walls import move_walls

ROWS, COLS, REACH = 7, 8, 2


@given(
    st.lists(
        st.lists(
            st.tuples(st.integers(0, 1), st.integers(0, ROWS - 1), st.integers(0, COLS - 1)),
            min_size=1,
            max_size=6,
            unique=True,
        ),
        min_size=1,
        max_size=4,
    )
)
@settings(max_examples=25, deadline=None)
def test_distances_are_exact_after_any_changes(rounds):
    capacity = 2 * ROWS * COLS
    owned = np.arange(capacity, dtype=np.int32).reshape(2, ROWS, COLS)
    cells = np.argwhere(owned >= 0).astype(np.int32)
    occupied = np.zeros(capacity, dtype=np.bool_)
    closest = np.full((2, ROWS, COLS), -1, dtype=np.int32)
    squared = np.full((2, ROWS, COLS), 255, dtype=np.uint8)
    for toggled in rounds:
        flips = np.array([owned[cell] for cell in toggled], dtype=np.int32)
        occupied[flips] = ~occupied[flips]
        for cleared in (True, False):
            move_walls(flips, cleared, occupied, cells, owned, closest, squared, REACH)
        for layer in range(2):
            walls = cells[occupied & (cells[:, 0] == layer), 1:]
            for iy in range(ROWS):
                for ix in range(COLS):
                    far = ((walls - (iy, ix)) ** 2).sum(axis=1)
                    least = far.min() if len(far) else 999
                    k = closest[layer, iy, ix]
                    if least > REACH * REACH:
                        assert k == -1 and squared[layer, iy, ix] == 255
                    else:
                        assert squared[layer, iy, ix] == least
                        assert occupied[k] and ((cells[k] - (layer, iy, ix)) ** 2).sum() == least
