"""The bytes of map updates, counted by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from expedition.experiments.map_updates import MapUpdate
from expedition.experiments.update_sizes import (
    METHODS,
    best_grid_bytes,
    bounding_box_bytes,
    cell_list_bytes,
    pose_graph_bytes,
    update_sizes,
)
from mapping.geometry import Pose2
from mapping.scan import LaserScan

HERE = Pose2(0.05, 0.05, 0.0)


def beam(reach: float, range_max: float = 20.0) -> LaserScan:
    """Return a scan of one beam along x."""
    return LaserScan(np.array([reach], dtype=np.float32), 0.0, 0.1, range_max, 0.0)


def test_sizes_of_the_paper():
    # "Concretely, the CellList message would transmit 3 numbers".
    assert cell_list_bytes(1) == 3 * 4
    # "it fits into a 20m x 40m axis aligned box, the BoundingBox message would transmit 20004".
    assert bounding_box_bytes(100 * 200) == 20004 * 4
    assert (20004 - 364) == 19640
    assert pose_graph_bytes(181, 0) == 736
    assert pose_graph_bytes(361, 0) == 1456
    assert pose_graph_bytes(361, 10) == (3 + 361 + 30) * 4
    assert pose_graph_bytes(0, 10) == 120
    assert best_grid_bytes(1, 1) == 12
    assert best_grid_bytes(100, 100) == 416
    assert best_grid_bytes(0, 0) == 0


def test_a_half_circle_of_free_space_fills_the_box_of_the_paper():
    """The second corner case, drawn: 361 beams of 20 m without a return, cells of 0.2 m."""
    ranges = np.full(361, 20.0, dtype=np.float32)
    scan = LaserScan(ranges, -0.5 * math.pi, math.pi / 360.0, 20.0, 0.0)
    found = update_sizes([MapUpdate(0.0, scan, Pose2(0.1, 0.1, 0.0))], resolution=0.2)
    # The laser stands in the middle of a cell: 20 m to one side, 20 m up and 20 m down.
    assert found.totals["bounding_box"] == (4 + 101 * 201) * 4
    assert found.totals["pose_graph"] == 1456
    assert found.totals["best_grid"] == found.totals["bounding_box"]


def test_a_beam_changes_the_cells_it_passes_and_the_one_behind_its_end():
    # From the middle of cell 0 to 1.03 m: passes cells 0 to 9, and what lies behind is cell 10.
    updates = [MapUpdate(2.0, beam(0.98), HERE)]
    found = update_sizes(updates)
    assert found.changed == found.boxed == 11
    assert found.totals == {
        "cell_list": 11 * 12,
        "bounding_box": 16 + 11 * 4,
        "best_grid": 16 + 11 * 4,
        "pose_graph": 16,
    }
    assert found.stamps.tolist() == [2.0]


def test_what_is_known_already_is_discarded():
    scan = beam(0.98)
    twice = [MapUpdate(0.0, scan, HERE), MapUpdate(1.0, scan, HERE)]
    shares = update_sizes(twice, value="share")
    assert (shares.discarded, len(shares.stamps)) == (1, 1)
    # As log-odds, the same scan goes on to say something until all cells are sure.
    always = [MapUpdate(float(k), scan, HERE) for k in range(10)]
    summed = update_sizes(always)
    # 0.6 against 4.0: seven misses; 0.9 against 4.0: five hits. From the sixth on ten cells change.
    assert summed.sizes["cell_list"].tolist() == [132] * 5 + [120] * 2
    assert summed.discarded == 3


def test_a_single_cell_that_changes_is_the_grids_best_case():
    # A wall comes to stand one cell nearer: the cell that was free is now hit every second time.
    updates = [MapUpdate(0.0, beam(0.98), HERE), MapUpdate(1.0, beam(0.88), HERE)]
    shares = update_sizes(updates, value="share")
    assert shares.sizes["cell_list"].tolist() == [132, 12]
    assert shares.sizes["best_grid"].tolist() == [60, 12]
    assert shares.sizes["pose_graph"].tolist() == [16, 16]
    assert update_sizes(updates, value="known").sizes["cell_list"].tolist() == [132, 12]
    third = [*updates, MapUpdate(2.0, beam(0.88), HERE)]
    assert update_sizes(third, value="known").discarded == 1
    assert update_sizes(third, value="share").discarded == 0  # from a half to two thirds


def test_new_poses_of_earlier_scans_redraw_the_grid():
    there = Pose2(0.05, 0.25, 0.0)
    updates = [
        MapUpdate(0.0, beam(0.98), HERE),
        MapUpdate(1.0, beam(0.98), HERE),  # discarded, so its pose is never told
        MapUpdate(2.0, beam(0.48), Pose2(0.05, 1.05, 0.0), {0: there, 1: there}),
        MapUpdate(3.0, None, None, {0: there}),
        MapUpdate(4.0, None, None, {1: there}),
    ]
    found = update_sizes(updates, value="share")
    # Eleven cells become unknown, eleven others known, and the scan's own six are new.
    assert found.sizes["cell_list"].tolist() == [132, (11 + 11 + 6) * 12, 0]
    # From row 0 to row 10, from column 0 to column 10.
    assert found.sizes["bounding_box"].tolist() == [60, 16 + 11 * 11 * 4, 0]
    assert found.sizes["pose_graph"].tolist() == [16, 16 + 12, 12]
    assert found.discarded == 1


def test_nothing_to_send():
    empty = update_sizes([])
    assert empty.totals == dict.fromkeys(METHODS, 0)
    blind = update_sizes([MapUpdate(0.0, beam(0.0), HERE)])
    assert (len(blind.stamps), blind.discarded) == (0, 1)
    with pytest.raises(IndexError):
        update_sizes([MapUpdate(0.0, None, None, {0: HERE})])


def test_numbers_of_all_cells_add_up_over_a_map_that_grows_to_all_sides():
    places = [
        Pose2(x, y, t) for x, y, t in ((-30.0, 3.0, 1.0), (25.0, -40.0, 2.0), (0.0, 9.0, 4.0))
    ]
    found = update_sizes([MapUpdate(0.0, beam(0.98), place) for place in places])
    alone = [update_sizes([MapUpdate(0.0, beam(0.98), place)]).changed for place in places]
    assert found.changed == sum(alone)
    moved = update_sizes(
        [
            *(MapUpdate(0.0, beam(0.98), place) for place in places),
            MapUpdate(1.0, None, None, dict(enumerate(places[::-1]))),
        ]
    )
    # The first and the last change places; the one between stays.
    assert moved.sizes["pose_graph"].tolist() == [16, 16, 16, 36]
    assert moved.sizes["cell_list"][3] == 0
