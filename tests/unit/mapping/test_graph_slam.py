"""Round a block and back: what scan matching lost on the way the graph puts right."""

from __future__ import annotations

import numpy as np
import pytest
from numba import config

from mapping.graph_slam import GraphSettings, GraphSlam
from mapping.incremental_slam import SlamSettings
from mapping.loop_settings import LoopSettings
from mapping.match_map import MapSettings
from tests.unit.tours import RESOLUTION, around

SETTINGS = SlamSettings(map=MapSettings(resolution=RESOLUTION))
SHORT = GraphSettings(loops=LoopSettings(submap_scans=6, settle_every=2))


@pytest.mark.skipif(config.DISABLE_JIT, reason="long drives take plain Python too long")
def test_where_the_robot_comes_back_its_way_is_put_right() -> None:
    tour = around(1.3, seed=2, bias=0.004)
    slam = GraphSlam(SETTINGS, graph=SHORT)
    ahead = [
        slam.step(move, scan).T_odom_base.as_tuple()
        for move, scan in zip(tour.moves, tour.scans, strict=True)
    ]
    slam.finish()
    assert slam.submaps.closed > 0
    errors = tour.errors(slam.trajectory())
    assert errors.max() < 0.15
    assert errors.mean() <= tour.errors(np.array(ahead)).mean() + 0.01


def test_the_pose_now_never_jumps_and_every_scan_has_its_place() -> None:
    tour = around(0.2, seed=4)
    slam = GraphSlam(SETTINGS, graph=SHORT)
    for move, scan in zip(tour.moves, tour.scans, strict=True):
        before = slam.T_odom_base
        estimate = slam.step(move, scan)
        assert before.distance_to(estimate.T_odom_base) < 0.25
    # Also the scans since the last node, which no graph holds yet.
    assert len(slam.trajectory()) == len(tour.scans)
    assert len(slam.pose_graph()) == len(slam.submaps.scans) > 3
    slam.finish()
    assert tour.errors(slam.trajectory()).max() < 0.15
