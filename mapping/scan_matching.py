"""Scan matching: the pose that maximises motion model times perceptual model.

Newton ascent with analytic gradient and Hessian from the odometry's guess, damped wherever the
Hessian is not negative definite; where the guess is too uncertain, an exhaustive search over a
window gives the starts.

Source: Simmons et al. 2000, section "Coordinated Mapping"; the search follows Olson 2009.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.correlative_search import SearchSettings, SearchWindow, search
from mapping.geometry import Floats, Pose2, wrap_angle
from mapping.grid import OccupancyGrid
from mapping.perceptual_model import (
    PerceptionSettings,
    accumulate_information,
    accumulate_likelihood,
)
from mapping.surface_map import SurfaceMap


@dataclass(frozen=True, slots=True)
class MatchSettings:
    """How scans are matched.

    Attributes:
        perception: shape of the likelihood.
        search: how the exhaustive search scores.
        widenings: the ascent runs first with the walls blurred by these factors of sigma, which
            widens the basin of attraction.
        iterations: most Newton steps per widening.
        tolerance: a step shorter than this [m, and rad per metre of `lever`] ends the ascent.
        lever: distance at which a turn counts like a shift [m].
    """

    perception: PerceptionSettings = field(default_factory=PerceptionSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    widenings: tuple[float, ...] = (3.0, 1.0)
    iterations: int = 15
    tolerance: float = 1e-4
    lever: float = 3.0


@dataclass(frozen=True, slots=True)
class MatchResult:
    """Outcome of matching one scan.

    Attributes:
        T_map_base: the pose found.
        covariance: (3, 3) of (x, y, theta), map frame: inverse of prior plus scan information.
            In a corridor the direction along it keeps the prior's variance.
        fit: share of the known end points that walls explain; 0 if none is known.
        known: number of end points that fall where the map is known.
        explained: number of end points that lie at walls.
        value: log of prior times likelihood, up to a constant; compares poses of one scan.
        converged: whether the ascent came to rest.
        iterations: Newton steps taken in all.
    """

    T_map_base: Pose2
    covariance: Floats
    fit: float
    known: int
    explained: int
    value: float
    converged: bool
    iterations: int


def match(
    grid: OccupancyGrid,
    surfaces: SurfaceMap,
    points_base: Floats,
    T_map_guess: Pose2,
    prior_covariance: Floats,
    settings: MatchSettings,
    window: SearchWindow | None = None,
) -> MatchResult:
    """Return the most likely pose of a scan near a guess.

    Args:
        grid: the map so far.
        surfaces: its walls.
        points_base: (N, 4) end points of the beams that hit [m] and the directions their surfaces face,
            see `scan_points`.
        T_map_guess: mean of the prior, the odometry's word.
        prior_covariance: (3, 3) of (x, y, theta) of the guess, map frame.
        settings: how to match.
        window: search this window exhaustively for starts; without it the ascent starts at the
            guess alone.
    """
    information = np.linalg.inv(prior_covariance)
    starts = [T_map_guess]
    if window is not None and len(points_base):
        starts += search(
            grid,
            surfaces,
            points_base,
            T_map_guess,
            window,
            information,
            settings.perception.beam_weight,
            settings.search,
        )
    results = [
        _ascend_from(grid, surfaces, points_base, start, T_map_guess, information, settings)
        for start in starts
    ]
    return max(results, key=lambda result: result.value)


def _ascend_from(
    grid: OccupancyGrid,
    surfaces: SurfaceMap,
    points_base: Floats,
    T_map_start: Pose2,
    T_map_prior: Pose2,
    information: Floats,
    settings: MatchSettings,
) -> MatchResult:
    """Ascend from one start and judge the result."""
    geometry, perception = grid.geometry, settings.perception
    lattice = (geometry.origin_x, geometry.origin_y, geometry.resolution)
    prior = (T_map_prior.x, T_map_prior.y, T_map_prior.theta)
    pose = np.array([T_map_start.x, T_map_start.y, T_map_start.theta])
    converged, iterations, value = True, 0, 0.0
    for widening in settings.widenings:
        converged, steps, value = ascend(
            points_base, pose, surfaces.closest, surfaces.surfels, lattice,
            perception.sigma * widening, perception.outlier, perception.beam_weight,
            prior, information, settings.iterations, settings.tolerance, settings.lever,
        )  # fmt: skip
        iterations += steps
    seen = np.zeros((3, 3))
    known, explained = accumulate_information(
        points_base, (pose[0], pose[1], pose[2]), surfaces.closest, surfaces.surfels,
        grid.log_odds, lattice, perception.sigma, perception.outlier,
        settings.search.known_above, seen,
    )  # fmt: skip
    covariance = np.linalg.inv(information + perception.beam_weight * seen)
    return MatchResult(
        T_map_base=Pose2(float(pose[0]), float(pose[1]), wrap_angle(float(pose[2]))),
        covariance=0.5 * (covariance + covariance.T),
        fit=explained / known if known else 0.0,
        known=known,
        explained=explained,
        value=value,
        converged=converged,
        iterations=iterations,
    )


def posterior_density(
    grid: OccupancyGrid,
    surfaces: SurfaceMap,
    points_base: Floats,
    poses_map: Floats,
    T_map_guess: Pose2,
    prior_covariance: Floats,
    settings: MatchSettings,
) -> Floats:
    """Return the log of prior times likelihood at each of `poses_map`, up to a constant, (N,).

    Args:
        grid: the map so far.
        surfaces: its walls.
        points_base: (N, 4), as for `match`.
        poses_map: (N, 3) poses (x, y, theta) to judge, for example a lattice.
        T_map_guess: mean of the prior.
        prior_covariance: (3, 3), map frame.
        settings: how to match.
    """
    geometry, perception = grid.geometry, settings.perception
    values = np.empty(len(poses_map))
    _evaluate(
        points_base,
        np.ascontiguousarray(poses_map, dtype=np.float64),
        surfaces.closest,
        surfaces.surfels,
        (geometry.origin_x, geometry.origin_y, geometry.resolution),
        perception.sigma,
        perception.outlier,
        perception.beam_weight,
        (T_map_guess.x, T_map_guess.y, T_map_guess.theta),
        np.linalg.inv(prior_covariance),
        values,
    )
    return values


@compiled
def _evaluate(
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
    damping = 0.0
    for taken in range(1, iterations + 1):
        while not _newton_step(gradient, hessian, damping, step):
            damping = max(4.0 * damping, 0.1)
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
            damping = 0.0 if damping < 0.1 else 0.25 * damping
        else:
            damping = max(4.0 * damping, 0.1)
        if size < tolerance:
            return True, taken, value
    return False, iterations, value
