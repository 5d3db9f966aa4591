"""Tours of a simulated robot: what its wheels and its laser say, and where it truly was."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.grid import GridGeometry
from mapping.scan import LaserScan
from sim_world.scene import GridScene
from tests.unit.rooms import BEAMS, RANGE_MAX, START, STEP

RESOLUTION = 0.1


@dataclass
class Tour:
    """One tour, stop by stop.

    Attributes:
        scans: what the laser saw, stamped 0, 1, 2, ... [s].
        moves: what the wheels say of the way to each stop from the one before.
        truth: where the robot was, seen from its first stop.
    """

    scans: list[LaserScan]
    moves: list[Pose2]
    truth: list[Pose2]

    def errors(self, poses: Floats) -> Floats:
        """How far (n,) [m] poses (n, 3) are from the truth."""
        true = np.array([pose.as_tuple() for pose in self.truth])
        apart: Floats = np.hypot(*(poses - true)[:, :2].T)
        return apart


def ring() -> GridScene:
    """A corridor 1.6 m wide around a block of 3 m by 2 m, with a niche and a pillar."""
    solid = np.zeros((56, 66), dtype=np.bool_)
    solid[[0, -1], :] = True
    solid[:, [0, -1]] = True
    solid[18:38, 18:48] = True
    solid[20:26, 18:22] = False
    solid[1:4, 30:34] = True
    return GridScene(solid, GridGeometry(RESOLUTION, 0.0, 0.0, *solid.shape))


def around(
    rounds: float,
    seed: int,
    sigma: float = 0.02,
    turn_sigma: float = 0.01,
    bias: float = 0.0,
    bearings: tuple[float, float, int] = (START, STEP, BEAMS),
) -> Tour:
    """Drive round and round the ring; wheels err by so much [m], [rad] a step of 0.1 m.

    `bearings` are of the first beam [rad], from one to the next, and how many.
    """
    rng, scene = np.random.default_rng(seed), ring()
    corners = [(0.9, 0.9), (5.7, 0.9), (5.7, 4.7), (0.9, 4.7)]
    T_world = [Pose2(0.9, 0.9, 0.0)]
    length = rounds * 2.0 * (4.8 + 3.8)
    goal, driven = 1, 0.0
    while driven < length:
        here, (x, y) = T_world[-1], corners[goal % 4]
        left, heading = math.hypot(x - here.x, y - here.y), math.atan2(y - here.y, x - here.x)
        turn = math.remainder(heading - here.theta, 2.0 * math.pi)
        if abs(turn) > 0.2:
            T_world.append(here @ Pose2(0.0, 0.0, math.copysign(0.2, turn)))
            continue
        step = min(0.1, left)
        T_world.append(here @ Pose2(step * math.cos(turn), step * math.sin(turn), turn))
        driven += step
        goal += left <= 0.1
    scans, moves, truth = [], [IDENTITY], []
    for k, T_world_base in enumerate(T_world):
        start, angle, beams = bearings
        ranges = scene.cast(T_world_base, start + angle * np.arange(beams), RANGE_MAX)
        noisy = (ranges + 0.02 * rng.standard_normal(beams)).astype(np.float32)
        scans.append(LaserScan(noisy, start, angle, RANGE_MAX, float(k)))
        truth.append(T_world[0].inverse() @ T_world_base)
        if k:
            move = T_world[k - 1].inverse() @ T_world_base
            x, y, theta = rng.standard_normal(3) * (sigma, 0.2 * sigma, turn_sigma)
            moves.append(Pose2(move.x + x, move.y + y, move.theta + theta + bias))
    return Tour(scans, moves, truth)
