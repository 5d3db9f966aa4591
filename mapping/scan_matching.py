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

from mapping.correlative_search import SearchWindow, search
from mapping.geometry import Floats, Pose2, wrap_angle
from mapping.grid import OccupancyGrid
from mapping.newton_ascent import climb, evaluate, invert
from mapping.perceptual_model import PerceptionSettings
from mapping.search_image import SearchSettings
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
    iterations: int = 40
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
        known: number of end points that fall where the map is known, or behind its walls.
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


def matches(
    grid: OccupancyGrid,
    surfaces: SurfaceMap,
    points_base: Floats,
    T_map_guess: Pose2,
    prior_covariance: Floats,
    settings: MatchSettings,
    window: SearchWindow | None = None,
    laser_base: tuple[float, float] | None = None,
    T_map_prior: Pose2 | None = None,
) -> list[MatchResult]:
    """Return the poses at which a scan fits near a guess, the most likely first.

    Those that the search starts from lie apart; the ascents from two of them may end at the same.

    Args:
        grid: the map so far.
        surfaces: its walls.
        points_base: (N, 4) end points of the beams that hit [m] and the directions their
            surfaces face, see `scan_points`.
        T_map_guess: where to start.
        prior_covariance: (3, 3) of (x, y, theta) of the prior, map frame.
        settings: how to match.
        window: search this window exhaustively for starts; without it the ascent starts at the
            guess alone.
        laser_base: where the beams start (x, y) [m], base frame. If given, end points behind well
            known walls count against the fit.
        T_map_prior: mean of the prior, the odometry's word; without it the guess.
    """
    information = np.empty((3, 3))
    invert(prior_covariance, information)
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
        _ascend_from(
            grid,
            surfaces,
            points_base,
            start,
            T_map_prior or T_map_guess,
            information,
            settings,
            laser_base,
        )
        for start in starts
    ]
    return sorted(results, key=lambda result: -result.value)


def _ascend_from(
    grid: OccupancyGrid,
    surfaces: SurfaceMap,
    points_base: Floats,
    T_map_start: Pose2,
    T_map_prior: Pose2,
    information: Floats,
    settings: MatchSettings,
    laser_base: tuple[float, float] | None,
) -> MatchResult:
    """Ascend from one start and judge the result."""
    geometry, perception = grid.geometry, settings.perception
    pose = T_map_start.as_array()
    covariance = np.empty((3, 3))
    converged, iterations, value, known, explained = climb(
        points_base,
        pose,
        laser_base or (math.nan, math.nan),
        surfaces.closest,
        surfaces.surfels,
        grid.log_odds,
        (geometry.origin_x, geometry.origin_y, geometry.resolution),
        (perception.sigma, perception.outlier, perception.beam_weight),
        np.array(settings.widenings),
        (T_map_prior.x, T_map_prior.y, T_map_prior.theta),
        information,
        (settings.iterations, settings.tolerance, settings.lever),
        settings.search.known_above,
        covariance,
    )
    return MatchResult(
        T_map_base=Pose2(float(pose[0]), float(pose[1]), wrap_angle(float(pose[2]))),
        covariance=covariance,
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
    information = np.empty((3, 3))
    invert(prior_covariance, information)
    evaluate(
        points_base,
        np.ascontiguousarray(poses_map, dtype=np.float64),
        surfaces.closest,
        surfaces.surfels,
        (geometry.origin_x, geometry.origin_y, geometry.resolution),
        perception.sigma,
        perception.outlier,
        perception.beam_weight,
        (T_map_guess.x, T_map_guess.y, T_map_guess.theta),
        information,
        values,
    )
    return values
