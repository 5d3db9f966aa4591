from __future__ import annotations

import numpy as np

from mapping.geometry import Pose2
from protocol.map_cells import quantise, unpack_cells
from server.map_publisher import MapPublisher
from tests.unit.server.master_rig import Rig, begun


def publisher_of(rig: Rig) -> MapPublisher:
    return MapPublisher(rig.master.merger, rig.master.settings.map)


def test_changes_are_numbered_and_come_when_due() -> None:
    rig = Rig()
    rig.hello("robot1", start=[0.0, 0.0, 0.0])
    made = publisher_of(rig)
    assert made.map.delta_due(0.0) is None and made.map.number == 0
    rig.report("robot1", 1)
    assert made.map.delta_due(0.1) is None  # not yet
    delta = made.map.delta_due(0.5)
    assert delta is not None and delta.number == made.map.number == 1
    assert made.map.delta() is None
    assert made.next_deadline() == 0.0  # poses were never told


def test_a_change_and_the_whole_map_agree() -> None:
    rig = begun()
    rig.report("robot1", 2, Pose2(0.2, 0.1, 0.1))
    made = publisher_of(rig)
    made.map.number = 1
    delta = made.map.delta()
    assert delta is not None
    whole = made.map.snapshot()
    assert whole.number == delta.number == 2
    cells = unpack_cells(whole.cells, whole.rows, whole.cols)
    assert np.array_equal(cells, quantise(rig.master.merger.log_odds))
    iy = delta.lattice_y - round(whole.origin_y_m / whole.resolution_m)
    ix = delta.lattice_x - round(whole.origin_x_m / whole.resolution_m)
    part = unpack_cells(delta.cells, delta.rows, delta.cols)
    assert np.array_equal(cells[iy : iy + delta.rows, ix : ix + delta.cols], part)


def test_poses_come_when_due_and_anybody_told() -> None:
    rig = Rig()
    rig.hello("robot1", start=[1.0, 0.0, 0.0])
    made, master = publisher_of(rig), rig.master
    assert made.poses_due(master.roster, master.executive, 0.0) is None
    rig.beat("robot1")
    assert made.poses_due(master.roster, master.executive, 0.1) is None
    poses = made.poses_due(master.roster, master.executive, 0.6)
    assert poses is not None and poses.robots == ("robot1",)
    assert poses.poses_map[0, 1:].tolist() == [1.0, 0.0, 0.0]
