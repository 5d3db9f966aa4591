"""Boxes of cells, held against the cells they hold."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mapping.cell_box import EMPTY_BOX, CellBox, box_of
from mapping.grid import GridGeometry

SHAPE = (7, 9)
ends = st.integers(-12, 20)
boxes = st.builds(CellBox, ends, ends, ends, ends)


def marked(box: CellBox) -> set[tuple[int, int]]:
    """Return the cells of a box, wherever they lie."""
    return {(iy, ix) for iy in range(box.iy0, box.iy1) for ix in range(box.ix0, box.ix1)}


def cut_out(box: CellBox) -> set[tuple[int, int]]:
    """Return the cells that a box cuts out of a grid."""
    cells = np.zeros(SHAPE, dtype=np.bool_)
    cells[box.slices] = True
    return {(int(iy), int(ix)) for iy, ix in np.argwhere(cells)}


def inside(cells: set[tuple[int, int]]) -> set[tuple[int, int]]:
    return {(iy, ix) for iy, ix in cells if 0 <= iy < SHAPE[0] and 0 <= ix < SHAPE[1]}


@given(boxes)
def test_a_clipped_box_cuts_out_what_of_it_lies_in_the_grid(box: CellBox) -> None:
    assert cut_out(box.clipped(SHAPE)) == inside(marked(box))


@given(boxes, st.integers(0, 3))
def test_a_box_grows_to_all_sides_and_an_empty_one_stays_empty(box: CellBox, by: int) -> None:
    steps = range(-by, by + 1)
    grown = {(iy + dy, ix + dx) for iy, ix in marked(box) for dy in steps for dx in steps}
    assert cut_out(box.dilated(by, SHAPE)) == inside(grown)


@given(boxes, boxes)
def test_two_boxes_share_what_both_hold(one: CellBox, other: CellBox) -> None:
    both = one.intersection(other)
    assert both.empty == (not marked(one) & marked(other))
    assert marked(both) == marked(one) & marked(other)
    assert marked(one) | marked(other) <= marked(one.union(other))


def test_the_smallest_box_around_some_cells() -> None:
    cells = np.zeros(SHAPE)
    assert box_of(cells) == EMPTY_BOX
    cells[2, 3] = cells[5, 4] = 1.0
    assert box_of(cells) == CellBox(2, 3, 6, 5)


@given(*(st.floats(-30.0, 30.0) for _ in range(4)))
def test_a_rectangle_anywhere_cuts_out_the_cells_it_touches(
    x: float, y: float, width: float, height: float
) -> None:
    geometry = GridGeometry(1.0, -2.0, 1.0, *SHAPE)
    x1, y1 = x + abs(width), y + abs(height)
    (iy0, ix0), (iy1, ix1) = geometry.cell_at(x, y), geometry.cell_at(x1, y1)
    touched = marked(CellBox(iy0, ix0, iy1 + 1, ix1 + 1))
    assert cut_out(geometry.box_around(x, y, x1, y1)) == inside(touched)
