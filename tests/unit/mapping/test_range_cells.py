from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.range_cells import NO_RETURN, TO_IGNORE, RangeCells, cells_for
from mapping.scan import LaserScan

REACHES = [0.5, 0.7, 7.999, 8.0, 10.1, 81.91]


def scan_of(ranges: object, range_max: float) -> LaserScan:
    return LaserScan(np.array(ranges, dtype=np.float32), 0.0, 0.01, range_max, 0.0)


@given(
    st.lists(st.floats(0.0, 90.0, width=32), min_size=1, max_size=30),
    st.sampled_from(REACHES),
    st.integers(7, 5000),
)
def test_every_range_comes_back_within_the_bound(ranges, range_max, bound):
    scan = scan_of(ranges, range_max)
    grid = cells_for(scan, bound / 10_000)
    back = scan_of(grid.ranges_of(grid.cells_of(scan)), grid.range_max)
    np.testing.assert_array_equal(back.hits, scan.hits)
    off = back.ranges.astype(np.float64) - scan.ranges.astype(np.float64)
    assert (np.abs(off[scan.hits]) <= bound / 10_000).all()


@pytest.mark.parametrize("range_max", REACHES)
def test_edges_of_cells_and_of_the_reach_come_back_within_the_bound(range_max):
    grid = cells_for(scan_of([1.0], range_max), 0.01)
    edges = (grid.width * np.arange(grid.count + 1)).astype(np.float32)
    around = np.concatenate(
        [edges, np.nextafter(edges, np.float32(0)), np.nextafter(edges, np.float32(np.inf))]
    )
    scan = scan_of(around[around >= 0], range_max)
    back = grid.ranges_of(grid.cells_of(scan)).astype(np.float64)
    assert (np.abs(back - scan.ranges)[scan.hits] <= 0.01).all()


@pytest.mark.parametrize("range_max", REACHES)
def test_special_readings_mean_the_same_when_they_come_back(range_max):
    reach = np.float32(range_max)
    scan = scan_of([np.inf, reach, 1e9, 0.0, -1.0, np.nan, -np.inf, 0.3], range_max)
    grid = cells_for(scan, 0.01)
    cells = grid.cells_of(scan)
    assert cells[:7].tolist() == [NO_RETURN] * 3 + [TO_IGNORE] * 4
    back = grid.ranges_of(cells)
    # Compiled code compares in float64, numpy in float32.
    assert (back[:3].astype(np.float64) >= grid.range_max).all()
    assert (back[:3] >= np.float32(grid.range_max)).all()
    assert (back[3:7] == 0.0).all()
    assert 0.0 < float(back[7]) < range_max


def test_a_reach_between_millimetres_is_rounded_up():
    scan = scan_of([8.0002, 8.0004], 8.0003)
    grid = cells_for(scan, 0.01)
    assert grid.range_max == 8.001
    back = scan_of(grid.ranges_of(grid.cells_of(scan)), grid.range_max)
    assert back.hits.tolist() == [True, False]


def test_the_bound_counts_in_whole_tenths_of_a_millimetre():
    scan = scan_of([1.0], 8.0)
    assert cells_for(scan, 0.01).bound_m == 0.01
    assert cells_for(scan, 0.01009).bound_m == 0.01


@pytest.mark.parametrize(
    ("bound", "reach", "says"),
    [
        (0, 8000, "0.1 mm to 1 m"),
        (10_001, 8000, "0.1 mm to 1 m"),
        (100, 0, "1 mm to 4000 m"),
        (100, 4_000_001, "1 mm to 4000 m"),
        (1, 80_000, "too fine"),
        (1, 4_000_000, "too fine"),
    ],
)
def test_there_are_no_such_cells(bound, reach, says):
    with pytest.raises(ValueError, match=says):
        RangeCells(bound, reach)


@pytest.mark.parametrize(("range_max", "bound"), [(np.inf, 0.01), (8.0, np.nan)])
def test_reach_and_bound_are_finite(range_max, bound):
    with pytest.raises(ValueError, match="finite"):
        cells_for(scan_of([1.0], range_max), bound)
