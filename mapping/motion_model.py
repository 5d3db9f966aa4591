"""Where the robot may be after a motion: the probability P(s | s', a) of wheel odometry.

An odometry increment `T_before_after` is what the wheels say of the motion between two moments. Its
errors are Wiener processes along the way: variances grow with the distance travelled and the angle
turned, so cutting a way into more steps changes nothing.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2, wrap_angle
from mapping.grid import GridGeometry


@dataclass(frozen=True, slots=True)
class MotionModel:
    """Noise of wheel odometry.

    Attributes:
        distance_sigma: error of the distance after one metre [m].
        drift_sigma: error of the heading after one metre [rad].
        rotation_sigma: error of the heading after turning by one radian [rad].
        slip_sigma: error across the direction of motion after one metre [m], over and above what
            the heading's drift explains.
        still_distance: a robot at rest may still have crept this far [m]; keeps the density proper.

    Source: Simmons et al. 2000, section "Coordinated Mapping", P(s | s', a) of Figure 1.
    """

    distance_sigma: float = 0.05
    drift_sigma: float = math.radians(2.0)
    rotation_sigma: float = 0.05
    slip_sigma: float = 0.01
    still_distance: float = 1e-4

    def covariance(self, T_before_after: Pose2) -> Floats:
        """Return the covariance (3, 3) of (x, y, theta) after one increment, in the frame before.

        The heading drifts all along the way, so it is correlated with the offset to the side:
        over a length L with drift q, var(theta) = q L, cov(side, theta) = q L^2 / 2 and
        var(side) = q L^3 / 3. The increment is taken as straight along its chord.
        """
        covariance = np.empty((3, 3))
        _increment_covariance(
            T_before_after.x, T_before_after.y, T_before_after.theta, self._noise(), 0.0, covariance
        )
        return covariance

    def _noise(self) -> tuple[float, float, float, float, float]:
        """Return all settings as plain numbers, for compiled code."""
        return (
            self.distance_sigma,
            self.drift_sigma,
            self.rotation_sigma,
            self.slip_sigma,
            self.still_distance,
        )

    def mean(self, T_map_before: Pose2, T_before_after: Pose2) -> Pose2:
        """Return the most likely pose `T_map_after`."""
        return T_map_before @ T_before_after

    def propagate(
        self, T_map_before: Pose2, covariance: Floats, T_before_after: Pose2
    ) -> tuple[Pose2, Floats]:
        """Return pose and covariance (3, 3) after an increment, both in the map frame.

        Args:
            T_map_before: mean pose before.
            covariance: (3, 3) of (x, y, theta) before, map frame.
            T_before_after: what the wheels say.
        """
        T_map_after = T_map_before @ T_before_after
        grown = np.empty((3, 3))
        _increment_covariance(
            T_before_after.x,
            T_before_after.y,
            T_before_after.theta,
            self._noise(),
            T_map_before.theta,
            grown,
        )
        _add_carried(
            covariance, T_map_after.x - T_map_before.x, T_map_after.y - T_map_before.y, grown
        )
        return T_map_after, grown

    def log_density(self, T_map_after: Pose2, T_map_before: Pose2, T_before_after: Pose2) -> float:
        """Return log P(s | s', a): s = `T_map_after`, s' = `T_map_before`, a = the increment."""
        return self.log_density_gradient(T_map_after, T_map_before, T_before_after)[0]

    def log_density_gradient(
        self, T_map_after: Pose2, T_map_before: Pose2, T_before_after: Pose2
    ) -> tuple[float, Floats]:
        """Return log P(s | s', a) and its gradient (3,) in (x, y, theta) of s, map frame."""
        covariance = np.empty((3, 3))
        _increment_covariance(
            T_before_after.x,
            T_before_after.y,
            T_before_after.theta,
            self._noise(),
            T_map_before.theta,
            covariance,
        )
        return gaussian_log_density(
            T_map_after, self.mean(T_map_before, T_before_after), covariance
        )

    def sample(self, poses_map: Floats, T_before_after: Pose2, rng: np.random.Generator) -> Floats:
        """Return one drawn pose after the increment for each pose before, (N, 3) as (x, y, theta).

        Args:
            poses_map: (N, 3) poses before, map frame.
            T_before_after: what the wheels say.
            rng: source of the noise.
        """
        factor = np.linalg.cholesky(self.covariance(T_before_after))
        moves = T_before_after.as_array() + rng.standard_normal((len(poses_map), 3)) @ factor.T
        c, s = np.cos(poses_map[:, 2]), np.sin(poses_map[:, 2])
        after = np.empty_like(poses_map)
        after[:, 0] = poses_map[:, 0] + c * moves[:, 0] - s * moves[:, 1]
        after[:, 1] = poses_map[:, 1] + s * moves[:, 0] + c * moves[:, 1]
        turned = poses_map[:, 2] + moves[:, 2]
        after[:, 2] = np.arctan2(np.sin(turned), np.cos(turned))
        return after

    def posterior_after(
        self,
        path: Sequence[Pose2],
        rng: np.random.Generator,
        samples: int = 10_000,
        step: float = 0.25,
    ) -> Floats:
        """Return poses (samples, 3) drawn from where the robot may be after following `path`.

        Args:
            path: poses in the map frame that the robot believes to pass, the first one certain.
                Between two of them it drives straight and turns evenly.
            rng: source of the noise.
            samples: how many poses to draw.
            step: longest piece of way drawn at once [m] (and [rad]); short pieces bend the cloud
                into the banana that one Gaussian cannot show.

        Source: Simmons et al. 2000, Figure 1.
        """
        poses = np.tile(path[0].as_array(), (samples, 1))
        for T_map_a, T_map_b in itertools.pairwise(path):
            increment = T_map_a.inverse() @ T_map_b
            size = max(math.hypot(increment.x, increment.y), abs(increment.theta))
            pieces = max(1, math.ceil(size / step))
            for piece in _split(increment, pieces):
                poses = self.sample(poses, piece, rng)
        return poses


def gaussian_log_density(pose: Pose2, mean: Pose2, covariance: Floats) -> tuple[float, Floats]:
    """Return the log density of a Gaussian over poses, and its gradient (3,) at `pose`.

    Args:
        pose: where to evaluate.
        mean: centre, same frame.
        covariance: (3, 3) of (x, y, theta), same frame, positive definite.
    """
    error = np.array([pose.x - mean.x, pose.y - mean.y, wrap_angle(pose.theta - mean.theta)])
    pull = np.linalg.solve(covariance, error)
    _, log_volume = np.linalg.slogdet(2.0 * math.pi * covariance)
    return float(-0.5 * error @ pull - 0.5 * log_volume), -pull


def position_density(poses_map: Floats, geometry: GridGeometry) -> Floats:
    """Return the share of `poses_map` (N, 3) per square metre in each cell, (rows, cols) [1/m2]."""
    cells = geometry.cells_at(poses_map[:, :2])
    inside = cells[geometry.contains(cells)]
    density = np.zeros(geometry.shape)
    np.add.at(density, (inside[:, 0], inside[:, 1]), 1.0)
    scaled: Floats = density / (len(poses_map) * geometry.resolution**2)
    return scaled


def _split(increment: Pose2, pieces: int) -> list[Pose2]:
    """Return `pieces` equal steps that compose to `increment`: equal arcs of one circle."""
    turn = increment.theta / pieces
    # A chain of equal steps (d, turn) has its chord turned by the sum of half turns; invert that.
    chord = complex(increment.x, increment.y)
    total = sum(complex(math.cos(k * turn), math.sin(k * turn)) for k in range(pieces))
    step = chord / total if abs(total) > 1e-9 else chord / pieces
    return [Pose2(step.real, step.imag, turn)] * pieces


@compiled
def _increment_covariance(
    dx: float,
    dy: float,
    turn: float,
    noise: tuple[float, float, float, float, float],
    theta: float,
    covariance: Floats,
) -> None:
    """Fill `covariance` (3, 3) of an increment, in a frame in which it begins with heading theta.

    Args:
        noise: distance, drift, rotation and slip sigmas and the still distance, see `MotionModel`.
    """
    length = math.sqrt(dx * dx + dy * dy)
    way = length + noise[4]
    drift = noise[1] * noise[1]
    spin = noise[2] * noise[2] * abs(turn)
    along = noise[0] * noise[0] * way
    side = drift * way**3 / 3.0 + spin * length * length / 3.0 + noise[3] * noise[3] * way
    side_heading = drift * way * way / 2.0 + spin * length / 2.0
    direction = theta + (math.atan2(dy, dx) if length > 0.0 else 0.0)
    c, s = math.cos(direction), math.sin(direction)
    covariance[0, 0] = c * c * along + s * s * side
    covariance[0, 1] = c * s * (along - side)
    covariance[1, 1] = s * s * along + c * c * side
    covariance[0, 2] = -s * side_heading
    covariance[1, 2] = c * side_heading
    covariance[2, 2] = drift * way + spin
    covariance[1, 0], covariance[2, 0] = covariance[0, 1], covariance[0, 2]
    covariance[2, 1] = covariance[1, 2]


@compiled
def _add_carried(before: Floats, dx: float, dy: float, grown: Floats) -> None:
    """Add to `grown` the covariance before an offset (dx, dy) [m], carried along by it.

    A heading off by e moves the end of the offset by (-dy, dx) e.
    """
    xt = before[0, 2] - dy * before[2, 2]
    yt = before[1, 2] + dx * before[2, 2]
    grown[0, 0] += before[0, 0] - dy * (before[0, 2] + xt)
    grown[0, 1] += before[0, 1] + dx * before[0, 2] - dy * yt
    grown[1, 1] += before[1, 1] + dx * (before[1, 2] + yt)
    grown[0, 2] += xt
    grown[1, 2] += yt
    grown[2, 2] += before[2, 2]
    grown[1, 0], grown[2, 0], grown[2, 1] = grown[0, 1], grown[0, 2], grown[1, 2]
