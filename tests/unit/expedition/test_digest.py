import copy
import hashlib
import struct

import numpy as np

from expedition.results.digest import run_digest
from expedition.results.record import RobotRecord
from mapping.grid import GridGeometry, OccupancyGrid
from tests.unit.expedition.records import full_record


def test_the_byte_layout_is_the_documented_one() -> None:
    grid = OccupancyGrid(GridGeometry(0.5, 1.0, -2.0, 1, 2), np.array([[0.5, -9]], np.float32))
    robots = [RobotRecord("é", track_map=np.array([[1.0, -0.0, 2.0, 3.0]]))]
    expected = (
        b"expedition run 1\n"
        + b"map"
        + struct.pack("<dddqq", 0.5, 1.0, -2.0, 1, 2)
        + bytes([10, 256 - 127])
        + b"track"
        + struct.pack("<q", 2)
        + "é".encode()
        + struct.pack("<q", 1)
        + struct.pack("<dddd", 1.0, 0.0, 2.0, 3.0)
    )
    assert run_digest(grid, robots) == hashlib.sha256(expected).hexdigest()


def test_equal_runs_have_equal_digests_whatever_the_order_of_robots() -> None:
    a, b = full_record(), full_record()
    b.robots.reverse()
    assert run_digest(a.grid, a.robots) == run_digest(b.grid, b.robots)


def test_any_change_shows() -> None:
    record = full_record()
    assert record.grid is not None
    digests = {run_digest(record.grid, record.robots), run_digest(None, record.robots)}
    moved = copy.deepcopy(record.robots)
    moved[0].track_map[2, 1] += 1e-12
    digests.add(run_digest(record.grid, moved))
    renamed = copy.deepcopy(record.robots)
    renamed[0].id = "bo"
    digests.add(run_digest(record.grid, renamed))
    cells = record.grid.log_odds.copy()
    cells[3, 4] += 0.1
    digests.add(run_digest(OccupancyGrid(record.grid.geometry, cells), record.robots))
    assert len(digests) == 5
