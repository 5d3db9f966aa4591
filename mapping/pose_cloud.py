"""Many poses at once: what particles do with theirs."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry import Floats


def composed(poses: Floats, moves: Floats) -> Floats:
    """Return poses (n, 3) after moves (n, 3) or (3,), each in the frame of its pose."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    after = np.empty_like(poses)
    after[:, 0] = poses[:, 0] + c * moves[..., 0] - s * moves[..., 1]
    after[:, 1] = poses[:, 1] + s * moves[..., 0] + c * moves[..., 1]
    after[:, 2] = poses[:, 2] + moves[..., 2]
    return wrapped(after)


def drawn(means: Floats, covariances: Floats, rng: np.random.Generator) -> Floats:
    """Return one pose (n, 3) drawn from each Gaussian.

    Args:
        means: (n, 3) of x, y [m], theta [rad].
        covariances: (n, 3, 3), positive definite.
        rng: source of the noise.
    """
    noise = rng.standard_normal(means.shape)
    return wrapped(means + np.einsum("nij,nj->ni", np.linalg.cholesky(covariances), noise))


def wrapped(poses: Floats) -> Floats:
    """Return `poses` (n, 3), their angles wrapped in place."""
    poses[:, 2] = np.arctan2(np.sin(poses[:, 2]), np.cos(poses[:, 2]))
    return poses


def turned(covariance: Floats, theta: float) -> Floats:
    """Return a covariance (3, 3) of (x, y, theta) in the frame in which its own is turned."""
    c, s = math.cos(theta), math.sin(theta)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    result: Floats = turn @ covariance @ turn.T
    return result
