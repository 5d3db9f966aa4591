"""Where the robot may be after a motion: the probability P(s | s', a) of wheel odometry.

An odometry increment `T_before_after` is what the wheels say of the motion between two moments. Its
errors are Wiener processes along the way: variances grow with the distance travelled and the angle
turned, so cutting a way into more steps changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

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
        length = math.hypot(T_before_after.x, T_before_after.y)
        way = length + self.still_distance
        turn = abs(wrap_angle(T_before_after.theta))
        drift = self.drift_sigma**2
        spin = self.rotation_sigma**2 * turn
        side_side = drift * way**3 / 3.0 + spin * length**2 / 3.0 + self.slip_sigma**2 * way
        side_heading = drift * way**2 / 2.0 + spin * length / 2.0
        heading = drift * way + spin
        c, s = (
            (T_before_after.x / length, T_before_after.y / length) if length > 0.0 else (1.0, 0.0)
        )
        along = self.distance_sigma**2 * way
        xx = c * c * along + s * s * side_side
        xy = c * s * (along - side_side)
        yy = s * s * along + c * c * side_side
        xt, yt = -s * side_heading, c * side_heading
        return np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, heading]])

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
        shift = np.eye(3)
        shift[0, 2] = -(T_map_after.y - T_map_before.y)
        shift[1, 2] = T_map_after.x - T_map_before.x
        turn = _turn(T_map_before.theta)
        grown = shift @ covariance @ shift.T + turn @ self.covariance(T_before_after) @ turn.T
        symmetric: Floats = 0.5 * (grown + grown.T)
        return T_map_after, symmetric

    def log_density(self, T_map_after: Pose2, T_map_before: Pose2, T_before_after: Pose2) -> float:
        """Return log P(s | s', a): s = `T_map_after`, s' = `T_map_before`, a = the increment."""
        return self.log_density_gradient(T_map_after, T_map_before, T_before_after)[0]

    def log_density_gradient(
        self, T_map_after: Pose2, T_map_before: Pose2, T_before_after: Pose2
    ) -> tuple[float, Floats]:
        """Return log P(s | s', a) and its gradient (3,) in (x, y, theta) of s, map frame."""
        mean = self.mean(T_map_before, T_before_after)
        turn = _turn(T_map_before.theta)
        covariance = turn @ self.covariance(T_before_after) @ turn.T
        return gaussian_log_density(T_map_after, mean, covariance)

    def sample(
        self, poses_map: Floats, T_before_after: Pose2, rng: np.random.Generator
    ) -> Floats:
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
        for T_map_a, T_map_b in zip(path[:-1], path[1:], strict=True):
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


def _turn(theta: float) -> Floats:
    """Return the (3, 3) matrix that turns (x, y, theta) covariances into a frame."""
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
