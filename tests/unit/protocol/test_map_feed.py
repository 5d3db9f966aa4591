from __future__ import annotations

import numpy as np
import numpy.typing as npt
from hypothesis import given
from hypothesis import strategies as st

from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.grid import GridGeometry
from protocol.map_cells import pack_cells, unpack_cells
from protocol.map_feed import MapFeed
from protocol.messages import MapDelta


class Sheet:
    """A map of 6 x 8 cells whose first cell is (-2, 3) on the lattice; squares of it change."""

    def __init__(self) -> None:
        self.geometry = GridGeometry(0.1, 0.3, -0.2, 6, 8)
        self.log_odds: npt.NDArray[np.float32] = np.zeros((6, 8), dtype=np.float32)
        self._changed = EMPTY_BOX

    def change(self, row: int, col: int, value: float) -> None:
        self.log_odds[row, col] = value
        self._changed = self._changed.union(CellBox(row, col, row + 1, col + 1))

    def take_changes(self) -> tuple[CellBox, npt.NDArray[np.float32]]:
        box, self._changed = self._changed, EMPTY_BOX
        return box.shifted(-2, 3), self.log_odds[box.slices]


def test_without_changes_nothing_is_told() -> None:
    feed = MapFeed(Sheet(), 0.5)
    assert feed.delta_due(0.0) is None
    assert feed.number == 0
    assert feed.due == 0.5


def test_changes_are_told_with_their_place_on_the_lattice_and_not_too_often() -> None:
    sheet = Sheet()
    feed = MapFeed(sheet, 0.5)
    sheet.change(1, 2, 3.0)
    sheet.change(2, 4, -3.0)
    told = feed.delta_due(1.0)
    assert told is not None
    assert (told.number, told.lattice_x, told.lattice_y) == (1, 5, -1)
    assert (told.rows, told.cols, told.resolution_m) == (2, 3, 0.1)
    sheet.change(0, 0, 1.0)
    assert feed.delta_due(1.4) is None
    again = feed.delta_due(1.5)
    assert again is not None and (again.number, again.rows, again.cols) == (2, 1, 1)


def test_a_snapshot_tells_the_whole_map_as_of_the_last_number() -> None:
    sheet = Sheet()
    feed = MapFeed(sheet, 0.0)
    sheet.change(1, 2, 3.0)
    feed.delta()
    told = feed.snapshot()
    assert (told.number, told.rows, told.cols) == (1, 6, 8)
    assert (told.origin_x_m, told.origin_y_m) == (0.3, -0.2)
    assert (unpack_cells(told.cells, 6, 8) != 0).sum() == 1


@given(
    st.lists(
        st.one_of(st.none(), st.tuples(st.integers(0, 5), st.integers(0, 7), st.integers(-4, 4))),
        max_size=30,
    )
)
def test_who_follows_the_changes_has_the_map(steps: list[tuple[int, int, int] | None]) -> None:
    sheet = Sheet()
    feed = MapFeed(sheet, 0.0)
    copy = np.zeros((6, 8), dtype=np.int8)
    numbers = []
    for step in [*steps, None]:
        if step is not None:
            sheet.change(*step[:2], float(step[2]))
        elif (told := feed.delta()) is not None:
            numbers.append(told.number)
            paste(copy, told)
    assert numbers == list(range(1, len(numbers) + 1))
    assert copy.tolist() == unpack_cells(pack_cells(sheet.log_odds), 6, 8).tolist()


def paste(copy: npt.NDArray[np.int8], told: MapDelta) -> None:
    row, col = told.lattice_y + 2, told.lattice_x - 3
    cells = unpack_cells(told.cells, told.rows, told.cols)
    copy[row : row + told.rows, col : col + told.cols] = cells


def test_another_map_takes_the_first_ones_place_as_a_whole() -> None:
    first, second = Sheet(), Sheet()
    feed = MapFeed(first, 0.0)
    first.change(1, 2, 3.0)
    feed.delta()
    second.change(4, 4, -2.0)
    told = feed.turn_to(second)
    assert told.number == 2
    cells = unpack_cells(told.cells, told.rows, told.cols)
    assert cells[4, 4] < 0 and cells[1, 2] == 0
    first.change(0, 0, 1.0)
    assert feed.delta() is None  # nothing of the second has changed since
    second.change(0, 1, 1.0)
    change = feed.delta()
    assert change is not None and change.number == 3
