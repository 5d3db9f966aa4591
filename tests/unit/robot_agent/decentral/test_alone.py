"""What a robot drives by that does not know where it is."""

from __future__ import annotations

import numpy as np

from mapping.geometry import Pose2
from mapping.team_map import TeamMap
from protocol.reported_scan import scan_of
from robot_agent.decentral.alone import OwnMap
from tests.unit.robot_agent.decentral.peer_rig import ROOM
from tests.unit.robot_agent.decentral.test_tying import report

THOUGHT = Pose2(0.3, -0.2, 0.5)


def test_it_draws_what_it_saw_where_it_thinks_it_was() -> None:
    like = TeamMap[tuple[str, int]](0.1, largest_cells=10_000)
    looks = [report(k + 1, ROOM, Pose2(0.2 * k, 0.0, 0.3 * k), THOUGHT) for k in range(3)]
    own = OwnMap(THOUGHT, looks[:2], like)
    box, _ = own.view.take_changes()
    assert not box.empty
    own.observe(looks[2])
    whole = TeamMap[tuple[str, int]](0.1, largest_cells=10_000)
    for k, look in enumerate(looks):
        whole.observe(("x", 0), k, scan_of(look), THOUGHT @ look.T_odom_base)
    own.view.take_changes()
    assert own.view.geometry == whole.grid().geometry
    np.testing.assert_array_equal(own.view.log_odds, whole.grid().log_odds)
