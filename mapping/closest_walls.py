"""Which occupied cell is closest, for every cell in reach of one; kept up cell by cell.

A feature transform limited to a few cells: when cells become walls or stop being walls, only their
surroundings are looked at again. The distances are exact whatever the order of changes; where two
walls are equally close, either may be the one that is named.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled

Ids = npt.NDArray[np.int32]


@compiled
def move_walls(
    flips: Ids,
    cleared: bool,
    occupied: npt.NDArray[np.bool_],
    cells: Ids,
    owned: Ids,
    closest: Ids,
    squared: npt.NDArray[np.uint8],
    reach: int,
) -> None:
    """Update who is closest to whom: after cells stopped being wall (`cleared`) or became wall."""
    for k in flips:
        if occupied[k] == cleared:
            continue
        if cleared:
            _drop_wall(k, occupied, cells, owned, closest, squared, reach)
        else:
            _spread_wall(k, cells, closest, squared, reach)


@compiled
def _spread_wall(
    k: int, cells: Ids, closest: Ids, squared: npt.NDArray[np.uint8], reach: int
) -> None:
    """Tell the cells around the new wall cell `k` of it."""
    _, rows, cols = closest.shape
    layer, cy, cx = cells[k, 0], cells[k, 1], cells[k, 2]
    for iy in range(max(0, cy - reach), min(rows, cy + reach + 1)):
        for ix in range(max(0, cx - reach), min(cols, cx + reach + 1)):
            far = (iy - cy) * (iy - cy) + (ix - cx) * (ix - cx)
            if far <= reach * reach and far < squared[layer, iy, ix]:
                squared[layer, iy, ix] = far
                closest[layer, iy, ix] = k


@compiled
def _drop_wall(
    k: int,
    occupied: npt.NDArray[np.bool_],
    cells: Ids,
    owned: Ids,
    closest: Ids,
    squared: npt.NDArray[np.uint8],
    reach: int,
) -> None:
    """Find a new closest wall for every cell whose closest wall was `k`."""
    _, rows, cols = closest.shape
    layer, cy, cx = cells[k, 0], cells[k, 1], cells[k, 2]
    for iy in range(max(0, cy - reach), min(rows, cy + reach + 1)):
        for ix in range(max(0, cx - reach), min(cols, cx + reach + 1)):
            if closest[layer, iy, ix] != k:
                continue
            best, best_far = -1, reach * reach + 1
            for jy in range(max(0, iy - reach), min(rows, iy + reach + 1)):
                for jx in range(max(0, ix - reach), min(cols, ix + reach + 1)):
                    far = (iy - jy) * (iy - jy) + (ix - jx) * (ix - jx)
                    if (
                        far < best_far
                        and owned[layer, jy, jx] >= 0
                        and occupied[owned[layer, jy, jx]]
                    ):
                        best, best_far = owned[layer, jy, jx], far
            closest[layer, iy, ix] = best
            squared[layer, iy, ix] = best_far if best >= 0 else 255
