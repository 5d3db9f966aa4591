"""What the central mapper keeps of robots and of their scans."""

from __future__ import annotations

import numpy as np

from mapping.geometry import Pose2
from mapping.motion_model import MotionModel
from mapping.scan import LaserScan
from protocol.body import Drive
from server.placing import Node, motion_of

SCAN = LaserScan(np.full(10, 8.0, np.float32), 0.0, 0.1, 8.0, 0.0)
WHEELS = MotionModel()
SURE = np.diag([1e-6, 1e-6, 1e-8])


def test_a_node_knows_where_the_local_map_lay() -> None:
    node = Node("a", SCAN, Pose2(2.0, 1.0, 0.5), Pose2(1.0, 1.0, 0.0))
    assert (node.T_map_odom @ node.T_odom_base).distance_to(node.T_map_base) < 1e-12


def test_perfect_wheels_are_not_believed_to_be_perfect() -> None:
    motion = motion_of(Drive(noise_distance=0.0, noise_turn=0.0, noise_heading_deg_m=0.0))
    assert min(motion.distance_sigma, motion.drift_sigma, motion.rotation_sigma) > 0.0
    assert motion_of(Drive()).distance_sigma == 0.05
