"""A robot's body in the world: where it truly is, what it measures with, what it was commanded."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from protocol import body as description
from sim_world import kinematics
from sim_world.lidar import LaserSpec
from sim_world.victim_detector import DetectorSpec, detector_of


@dataclass(frozen=True, slots=True)
class RobotSpec:
    """A robot as the world makes it: name, body, true start, and the start it is told."""

    name: str
    body: description.Body
    T_world_start: Pose2
    T_map_start: Pose2


@dataclass(slots=True)
class RobotBody:
    """One body and its state.

    Attributes:
        spec: as the team's settings have it.
        limits: of its motion.
        laser: what it measures with.
        motion: true pose and speed, world frame.
        rng: source of its laser's noise.
        detector: what it makes out victims with, if anything.
        detector_rng: source of the detector's noise, so that it leaves the laser's as it is.
        T_wheel_base: pose that the wheels counted since the software joined.
        command: (speed [m/s], turn rate [rad/s]) wanted.
        command_stamp: when it was commanded [s].
        next_sweep: when the laser sweeps next [s].
        connected: whether its software is there.
        bumped: whether it hit something in the last instant.
        path: way driven [m].
        bumps: instants in which it hit something.
        track: true poses at each sweep, (stamp, x, y, theta).
    """

    spec: RobotSpec
    limits: kinematics.Body
    laser: LaserSpec
    motion: kinematics.Motion
    rng: np.random.Generator
    detector: DetectorSpec | None
    detector_rng: np.random.Generator
    T_wheel_base: Pose2 = IDENTITY
    command: tuple[float, float] = (0.0, 0.0)
    command_stamp: float = -math.inf
    next_sweep: float = 0.0
    connected: bool = False
    bumped: bool = False
    path: float = 0.0
    bumps: int = 0
    track: list[tuple[float, float, float, float]] = field(default_factory=list)


def robot_body(spec: RobotSpec, rng: np.random.Generator) -> RobotBody:
    """Put a robot's body at its start."""
    drive, lidar = spec.body.drive, spec.body.lidar
    limits = kinematics.Body(
        radius=spec.body.radius_m,
        speed_max=drive.speed_max_m_s,
        turn_rate_max=drive.turn_rate_max_rad_s,
        acceleration_max=drive.acceleration_max_m_s2,
        turn_acceleration_max=drive.turn_acceleration_max_rad_s2,
        noise=kinematics.OdometryNoise(
            drive.noise_distance, math.radians(drive.noise_heading_deg_m), drive.noise_turn
        ),
    )
    laser = LaserSpec(
        lidar.beams, lidar.bearing_start, lidar.bearing_step, lidar.range_max_m, lidar.noise_m
    )
    detector = detector_of(spec.body.victim_detector)
    motion = kinematics.Motion(spec.T_world_start)
    return RobotBody(spec, limits, laser, motion, rng, detector, rng.spawn(1)[0])
