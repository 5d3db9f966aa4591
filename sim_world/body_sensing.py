"""What a body senses at one instant: its wheels, its bumper, and now and then a sweep."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from mapping.geometry import Floats
from protocol.fields import NO_NUMBERS, NO_POINTS
from protocol.world_messages import BodyFrame
from sim_world.lidar import measure
from sim_world.robot_body import RobotBody
from sim_world.scene import Scene
from sim_world.victim_detector import detect


def sense(robot: RobotBody, now: float) -> BodyFrame:
    """Return what a body senses between two sweeps."""
    return _frame(robot, now, NO_NUMBERS, NO_POINTS)


def sense_and_sweep(
    robot: RobotBody, now: float, scene: Scene, team: Iterable[RobotBody], victims_world: Floats
) -> BodyFrame:
    """Return what a body senses when its laser sweeps and its detector looks for victims.

    Args:
        robot: whose body.
        now: mission time [s].
        scene: what is solid.
        team: all robots; the others are solid, too.
        victims_world: (N, 2) where victims lie [m].
    """
    found = NO_POINTS
    if robot.detector is not None:
        T_world_base = robot.motion.T_world_base
        found = detect(T_world_base, scene, victims_world, robot.detector, robot.detector_rng)
    return _frame(robot, now, _sweep(robot, scene, team), found)


def _frame(
    robot: RobotBody,
    now: float,
    ranges: npt.NDArray[np.float32],
    victims_base: npt.NDArray[np.float32],
) -> BodyFrame:
    return BodyFrame(
        stamp_s=now,
        T_wheel_base=robot.T_wheel_base,
        bumped=robot.bumped,
        ranges=ranges,
        victims_base=victims_base,
    )


def _sweep(robot: RobotBody, scene: Scene, team: Iterable[RobotBody]) -> npt.NDArray[np.float32]:
    """Return one sweep of a robot's laser, (beams,) [m]; the other robots are solid."""
    others = [
        (other.motion.T_world_base.x, other.motion.T_world_base.y, other.limits.radius)
        for other in team
        if other is not robot
    ]
    ranges = measure(
        robot.motion.T_world_base @ robot.laser.T_base_laser,
        scene,
        np.array(others, dtype=np.float64).reshape(-1, 3),
        robot.laser,
        robot.rng,
    )
    return np.asarray(ranges, dtype=np.float32).reshape(-1)
