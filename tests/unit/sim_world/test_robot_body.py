from __future__ import annotations

import math

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from protocol.body import Body, Drive, Lidar
from sim_world.robot_body import RobotSpec, robot_body


def test_a_body_begins_at_its_true_start_with_the_limits_of_its_description() -> None:
    body = Body(
        radius_m=0.3, lidar=Lidar(beams=9, range_max_m=5.0), drive=Drive(noise_heading_deg_m=2.0)
    )
    spec = RobotSpec("robot1", body, Pose2(1.0, 2.0, 0.5), IDENTITY)
    made = robot_body(spec, np.random.default_rng(1))
    assert made.motion.T_world_base == Pose2(1.0, 2.0, 0.5)
    assert (made.limits.radius, made.laser.beams, made.laser.range_max) == (0.3, 9, 5.0)
    assert math.isclose(made.limits.noise.heading_per_metre, math.radians(2.0))
    assert not made.connected and made.track == []
