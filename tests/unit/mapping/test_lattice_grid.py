from __future__ import annotations

import math

import numpy as np

from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.lattice_grid import LatticeGrid, changed_box, lattice_box, lattice_geometry


def test_a_grid_grows_and_keeps_its_cells():
    cells = LatticeGrid(0.1)
    cells.grow(CellBox(5, -3, 8, 4))
    assert cells.box == CellBox(0, -128, 128, 128)
    cells.part(CellBox(5, -3, 6, -2))[:] = 1.0
    cells.grow(CellBox(-1, 0, 0, 1), CellBox(-50, -200, 200, 200))
    assert cells.box == CellBox(-50, -128, 128, 128) and cells.log_odds.shape == cells.box.shape
    assert cells.known().box == CellBox(5, -3, 6, -2)
    assert cells.occupancy().log_odds[cells.occupancy().geometry.cell_at(-0.25, 0.55)] == 1.0


def test_a_grid_that_holds_a_box_stays_as_it_is():
    cells = LatticeGrid(0.1)
    cells.grow(EMPTY_BOX)
    assert cells.box.empty
    cells.grow(CellBox(0, 0, 1, 1))
    held = cells.log_odds
    cells.grow(CellBox(3, 3, 5, 5))
    assert cells.log_odds is held


def test_where_the_lattice_lies():
    geometry = lattice_geometry(CellBox(-2, 3, 4, 5), 0.5)
    assert (geometry.origin_x, geometry.origin_y, geometry.shape) == (1.5, -1.0, (6, 2))
    assert lattice_box((1.6, -0.9, 2.4, 1.9), 0.5) == CellBox(-2, 3, 4, 5)
    assert lattice_box((1.6, -0.9, 2.4, 1.9), 0.5, margin=1) == CellBox(-3, 2, 5, 6)
    assert lattice_box((1.6, math.nan, 2.4, 1.9), 0.5).empty
    assert lattice_box((1.6, 0.0, math.inf, 1.9), 0.5).empty


def test_changes_are_found_across_growth():
    before, after = LatticeGrid(0.1), LatticeGrid(0.1)
    before.grow(CellBox(0, 0, 4, 4))
    after.grow(CellBox(0, 0, 4, 4))
    assert changed_box(before, after).empty
    after.grow(CellBox(-4, 0, 0, 4))
    after.part(CellBox(-3, 1, -2, 2))[:] = 0.5
    assert changed_box(before, after) == CellBox(-3, 1, -2, 2)
    assert np.all(before.log_odds == 0.0)
