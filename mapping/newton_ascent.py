"""The compiled core of scan matching: Newton ascent of prior times likelihood.

Source: Simmons et al. 2000, section "Coordinated Mapping": "search in the relative pose space of
the robot can be performed very efficiently using Newton's method"; damping after Levenberg 1944
and Marquardt 1963.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.perceptual_model import accumulate_information, accumulate_likelihood, best_trust

# Share of the strongest information [by eigenvalues] that may be an echo of the map's noise: that
# of a wall whose surfels' directions are off by seven degrees.
UNSEEN_SHARE = 0.015


@compiled
def evaluate(
    points: Floats,
    poses: Floats,
    closest: npt.NDArray[np.int32],
    surfels: Floats,
    lattice: tuple[float, float, float],
    sigma: float,
    outlier: float,
    beam_weight: float,
    prior: tuple[float, float, float],
    information: Floats,
    values: Floats,
) -> None:
    """Fill `values` with the objective at every pose."""
    gradient, hessian = np.empty(3), np.empty((3, 3))
    for i in range(poses.shape[0]):
        values[i] = _objective(
            points, poses[i], closest, surfels, lattice, sigma, outlier, beam_weight, prior,
            information, gradient, hessian,
        )  # fmt: skip


@compiled
def _objective(
    points: Floats,
    pose: Floats,
    closest: npt.NDArray[np.int32],
    surfels: Floats,
    lattice: tuple[float, float, float],
    sigma: float,
    outlier: float,
    beam_weight: float,
    prior: tuple[float, float, float],
    information: Floats,
    gradient: Floats,
    hessian: Floats,
) -> float:
    """Return prior plus weighted log-likelihood; fill gradient (3,) and Hessian (3, 3)."""
    packed = np.empty(9)
    value = beam_weight * accumulate_likelihood(
        points, (pose[0], pose[1], pose[2]), closest, surfels, lattice, sigma, outlier, packed
    )
    dx, dy, dt = pose[0] - prior[0], pose[1] - prior[1], pose[2] - prior[2]
    dt -= 2.0 * math.pi * math.floor(dt / (2.0 * math.pi) + 0.5)
    for i in range(3):
        pull = information[i, 0] * dx + information[i, 1] * dy + information[i, 2] * dt
        gradient[i] = beam_weight * packed[i] - pull
        value -= 0.5 * pull * (dx if i == 0 else dy if i == 1 else dt)
    k = 3
    for i in range(3):
        for j in range(i, 3):
            hessian[i, j] = beam_weight * packed[k] - information[i, j]
            hessian[j, i] = hessian[i, j]
            k += 1
    return value


@compiled
def _newton_step(gradient: Floats, hessian: Floats, damping: float, step: Floats) -> bool:
    """Solve (damping * D - H) step = g by Cholesky; False if that is not positive definite.

    D is the diagonal of |H|, so that metres and radians are damped alike.
    """
    a = damping * abs(hessian[0, 0]) - hessian[0, 0]
    if a <= 0.0:
        return False
    l00 = math.sqrt(a)
    l10 = -hessian[1, 0] / l00
    l20 = -hessian[2, 0] / l00
    b = damping * abs(hessian[1, 1]) - hessian[1, 1] - l10 * l10
    if b <= 0.0:
        return False
    l11 = math.sqrt(b)
    l21 = (-hessian[2, 1] - l20 * l10) / l11
    d = damping * abs(hessian[2, 2]) - hessian[2, 2] - l20 * l20 - l21 * l21
    if d <= 0.0:
        return False
    l22 = math.sqrt(d)
    z0 = gradient[0] / l00
    z1 = (gradient[1] - l10 * z0) / l11
    z2 = (gradient[2] - l20 * z0 - l21 * z1) / l22
    step[2] = z2 / l22
    step[1] = (z1 - l21 * step[2]) / l11
    step[0] = (z0 - l10 * step[1] - l20 * step[2]) / l00
    return True


@compiled
def ascend(
    points: Floats,
    pose: Floats,
    closest: npt.NDArray[np.int32],
    surfels: Floats,
    lattice: tuple[float, float, float],
    sigma: float,
    outlier: float,
    beam_weight: float,
    prior: tuple[float, float, float],
    information: Floats,
    iterations: int,
    tolerance: float,
    lever: float,
) -> tuple[bool, int, float]:
    """Climb to the nearest maximum; `pose` (3,) is start and result.

    Returns:
        Whether the ascent came to rest, evaluations made, and the value there.

    Source: Levenberg 1944 and Marquardt 1963 for the damping.
    """
    gradient, hessian = np.empty(3), np.empty((3, 3))
    new_gradient, new_hessian = np.empty(3), np.empty((3, 3))
    step = np.empty(3)
    trial = pose.copy()
    value = _objective(
        points, pose, closest, surfels, lattice, sigma, outlier, beam_weight, prior, information,
        gradient, hessian,
    )  # fmt: skip
    damping, refused = 0.0, False
    for taken in range(1, iterations + 1):
        while not _newton_step(gradient, hessian, damping, step):
            damping = max(10.0 * damping, 0.1)
            if damping > 1e6:
                return False, taken, value
        size = max(abs(step[0]), abs(step[1]), lever * abs(step[2]))
        if size > 0.3:
            step *= 0.3 / size
        trial[:] = pose + step
        new_value = _objective(
            points, trial, closest, surfels, lattice, sigma, outlier, beam_weight, prior,
            information, new_gradient, new_hessian,
        )  # fmt: skip
        if new_value > value:
            value = new_value
            pose[:] = trial
            gradient[:] = new_gradient
            hessian[:] = new_hessian
            # At a crease between two surfels steps would go to and fro: stay damped after one.
            if not refused:
                damping = 0.0 if damping < 0.1 else 0.1 * damping
            refused = False
        else:
            damping = max(10.0 * damping, 0.1)
            refused = True
        if size < tolerance:
            return True, taken, value
    return False, iterations, value


@compiled
def climb(
    points: Floats,
    pose: Floats,
    laser: tuple[float, float],
    closest: npt.NDArray[np.int32],
    surfels: Floats,
    log_odds: npt.NDArray[np.float32],
    lattice: tuple[float, float, float],
    perception: tuple[float, float, float],
    widenings: Floats,
    prior: tuple[float, float, float],
    information: Floats,
    limits: tuple[int, float, float],
    known_above: float,
    covariance: Floats,
) -> tuple[bool, int, float, int, int]:
    """Ascend once per widening and judge the pose reached; `pose` (3,) is start and result.

    Args:
        laser: where the beams start, see `accumulate_information`.
        perception: (sigma [m], outlier, beam_weight).
        limits: (iterations per widening, tolerance [m], lever [m]).
        covariance: (3, 3), filled with the inverse of prior plus scan information.

    Returns:
        Whether the last ascent came to rest, evaluations made in all, the value reached, and how
        many end points are known and explained there.
    """
    sigma, outlier, beam_weight = perception
    beam_weight /= best_trust(points, prior, closest, surfels, lattice)
    converged, total, value = True, 0, 0.0
    for widening in widenings:
        converged, steps, value = ascend(
            points, pose, closest, surfels, lattice, sigma * widening, outlier, beam_weight, prior,
            information, limits[0], limits[1], limits[2],
        )  # fmt: skip
        total += steps
    seen = np.zeros((3, 3))
    known, explained = accumulate_information(
        points, (pose[0], pose[1], pose[2]), laser, closest, surfels, log_odds, lattice, sigma,
        outlier, known_above, seen,
    )  # fmt: skip
    settle(pose, prior, information, beam_weight * seen, limits[2], covariance)
    return converged, total, value, known, explained


@compiled
def settle(
    pose: Floats,
    prior: tuple[float, float, float],
    information: Floats,
    seen: Floats,
    lever: float,
    covariance: Floats,
) -> None:
    """Take back what the scan seemed to say of directions of which it says nothing.

    Along a bare wall the directions of its surfels differ a little, by noise alone. Each scan would
    find a trace of a hold there, always the same one, and the sum of many scans a firm one: the
    pose would lag behind and its covariance would lie. So the information is lowered in all
    directions by a small share of the strongest, and `pose` moves to where the maximum lies then;
    `covariance` (3, 3) is filled with the inverse of what remains together with the prior.

    Args:
        information: (3, 3) of the prior.
        seen: (3, 3) of the scan, changed here.

    Source: Zhang, Kaess & Singh 2016, "On degeneracy of optimization-based state estimation
    problems", with a soft instead of a hard threshold.
    """
    scale = np.array([1.0, 1.0, lever])
    for i in range(3):
        for j in range(3):
            seen[i, j] /= scale[i] * scale[j]
    strengths, directions = np.linalg.eigh(seen)
    offset = np.array([pose[0] - prior[0], pose[1] - prior[1], pose[2] - prior[2]])
    offset[2] -= 2.0 * math.pi * math.floor(offset[2] / (2.0 * math.pi) + 0.5)
    taken = np.zeros(3)
    remaining = information.copy()
    for k in range(3):
        kept = max(0.0, strengths[k] - UNSEEN_SHARE * strengths[2])
        along = 0.0
        for i in range(3):
            for j in range(3):
                # At the maximum the scan's pull balances the prior's.
                along += directions[i, k] / scale[i] * information[i, j] * offset[j]
                remaining[i, j] += kept * directions[i, k] * directions[j, k] * scale[i] * scale[j]
        lost = 1.0 - kept / strengths[k] if strengths[k] > 0.0 else 1.0
        for i in range(3):
            taken[i] += lost * along * directions[i, k] * scale[i]
    invert(remaining, covariance)
    for i in range(3):
        for j in range(3):
            pose[i] -= covariance[i, j] * taken[j]


@compiled
def invert(matrix: Floats, inverse: Floats) -> None:
    """Fill `inverse` with the inverse of a symmetric positive definite (3, 3) matrix.

    Rows and columns are scaled to a unit diagonal first: metres and radians, certain and uncertain
    directions may differ by many orders of magnitude.
    """
    scale = np.empty(3)
    for i in range(3):
        scale[i] = 1.0 / math.sqrt(matrix[i, i])
    a = matrix[0, 1] * scale[0] * scale[1]
    b = matrix[0, 2] * scale[0] * scale[2]
    c = matrix[1, 2] * scale[1] * scale[2]
    determinant = 1.0 + 2.0 * a * b * c - a * a - b * b - c * c
    inverse[0, 0] = (1.0 - c * c) / determinant
    inverse[1, 1] = (1.0 - b * b) / determinant
    inverse[2, 2] = (1.0 - a * a) / determinant
    inverse[0, 1] = (b * c - a) / determinant
    inverse[0, 2] = (a * c - b) / determinant
    inverse[1, 2] = (a * b - c) / determinant
    for i in range(3):
        for j in range(i, 3):
            inverse[i, j] *= scale[i] * scale[j]
            inverse[j, i] = inverse[i, j]
