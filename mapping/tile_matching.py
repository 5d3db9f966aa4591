"""Matching a scan to one of many maps that share their tiles.

The objective is that of `scan_matching`: motion model times perceptual model. Here it is climbed by
expectation and maximisation: which piece of wall each end point belongs to, and how likely it
belongs to any, is settled at the pose so far; then one weighted least-squares step is taken.

A second map can take part, of what others saw. What an end point says of each of the two counts by
itself: walls that both know pull to the middle between them.

Source: Simmons et al. 2000, section "Coordinated Mapping", for the objective; Dempster, Laird &
Rubin 1977 for the ascent.
"""

from __future__ import annotations

import math

import numpy as np

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.newton_ascent import invert, settle
from mapping.shared_tiles import Ids, Shorts
from mapping.wall_tiles import find_surfels

# Of the others' walls no number of a scan is known: by this, only end points count for trust.
_LONG_AGO = 1e9


@compiled
def match_tiles(
    points: Floats,
    pose: Floats,
    lattice: tuple[float, float, float],
    depth: float,
    table: Ids,
    pool: Shorts,
    walls: tuple[int, int, float, float, float, float],
    perception: tuple[float, float, float],
    widenings: Floats,
    limits: tuple[int, float, float],
    prior: tuple[float, float, float],
    information: Floats,
    covariance: Floats,
    others: tuple[tuple[float, float, float], Ids, Shorts],
) -> tuple[float, int]:
    """Move a pose to where a scan fits one map best; `pose` (3,) is start and result.

    Args:
        points: (N, 4) end points [m] and the directions their surfaces face, base frame.
        pose: (3,) of the base, map frame, changed here.
        lattice: (corner x, corner y, resolution) [m], map frame.
        depth: an end point belongs to the cell this far behind its surface [m].
        table: (layers, rows, cols) int32 of the map.
        pool: its tiles.
        walls: (reach, radius, doubt, now, line_below, blob_above), see `find_surfels`.
        perception: (sigma [m], outlier, beam_weight).
        widenings: factors of sigma, one after the other.
        limits: (steps per widening, tolerance [m], lever [m]).
        prior: (x, y, theta), mean of the motion model, map frame.
        information: (3, 3), inverse of its covariance.
        covariance: (3, 3), filled with the inverse of prior plus scan information.
        others: lattice, table and pool of a second map in the same frame; a table (layers, 0, 0)
            for none.

    Returns:
        Log of prior times likelihood at the result, up to a constant, and how many end points lie
        within 3 sigma of a wall of the first map there.
    """
    reach, radius, doubt, now, line_below, blob_above = walls
    sigma, outlier, beam_weight = perception
    steps, tolerance, lever = limits
    cells = np.full((points.shape[0], 3), -1, dtype=np.int32)
    surfels = np.empty((points.shape[0], 6))
    their_lattice, their_table, their_pool = others
    together = their_table.shape[1] > 0
    their_cells, theirs = cells.copy(), surfels.copy()
    seen, pull = np.empty((3, 3)), np.empty(3)
    total, spread = np.empty((3, 3)), np.empty((3, 3))
    value, explained = 0.0, 0
    for widening in widenings:
        for _ in range(steps + 1):
            find_surfels(
                points, pose, lattice, depth, table, pool, reach, radius, doubt, now,
                (line_below, blob_above), cells, surfels,
            )  # fmt: skip
            seen[:] = 0.0
            pull[:] = 0.0
            value, explained, best = _weigh_points(
                points, pose, surfels, sigma * widening, outlier, seen, pull
            )
            if together:
                find_surfels(
                    points, pose, their_lattice, depth, their_table, their_pool, reach, radius,
                    doubt, _LONG_AGO, (line_below, blob_above), their_cells, theirs,
                )  # fmt: skip
                more, _, their_best = _weigh_points(
                    points, pose, theirs, sigma * widening, outlier, seen, pull
                )
                value += more
                best = max(best, their_best)
            if best > 0.0:
                # Weights count by comparison: where all walls are young, they are all there is to
                # go by.
                seen /= best
                pull /= best
            seen[1, 0], seen[2, 0], seen[2, 1] = seen[0, 1], seen[0, 2], seen[1, 2]
            _add_prior(pose, prior, information, beam_weight, seen, pull, total)
            invert(total, spread)
            size = _step(spread, pull, lever, pose)
            if size < tolerance:
                break
    offset = _offset(pose, prior)
    value = beam_weight * value
    for i in range(3):
        for j in range(3):
            value -= 0.5 * offset[i] * information[i, j] * offset[j]
            seen[i, j] *= beam_weight
    settle(pose, prior, information, seen, lever, covariance)
    return value, explained


@compiled
def _offset(pose: Floats, prior: tuple[float, float, float]) -> Floats:
    """Return how far a pose lies off the prior's mean, (3,), its angle wrapped."""
    offset = np.array([pose[0] - prior[0], pose[1] - prior[1], pose[2] - prior[2]])
    offset[2] -= 2.0 * math.pi * math.floor(offset[2] / (2.0 * math.pi) + 0.5)
    return offset


@compiled
def _weigh_points(
    points: Floats,
    pose: Floats,
    surfels: Floats,
    sigma: float,
    outlier: float,
    seen: Floats,
    pull: Floats,
) -> tuple[float, int, float]:
    """Sum up what end points say, each as far as it belongs to its piece of wall.

    Adds their information to the upper half of `seen` (3, 3), and the gradient by the pose to
    `pull` (3,).

    Returns:
        The log-likelihood, 0 where no wall is, how many end points lie within 3 sigma of one, and
        the largest trust in a wall.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    inverse = 1.0 / (sigma * sigma)
    flat = math.log(outlier)
    value, explained, best = 0.0, 0, 0.0
    for i in range(points.shape[0]):
        trust = surfels[i, 5]
        if trust < 0.0:
            continue
        best = max(best, trust)
        rx = c * points[i, 0] - s * points[i, 1]
        ry = s * points[i, 0] + c * points[i, 1]
        ex, ey = pose[0] + rx - surfels[i, 0], pose[1] + ry - surfels[i, 1]
        axx, axy, ayy = surfels[i, 2], surfels[i, 3], surfels[i, 4]
        # u = A e is half the gradient of the squared distance by (x, y).
        ux, uy = axx * ex + axy * ey, axy * ex + ayy * ey
        squared = inverse * (ex * ux + ey * uy)
        near = (1.0 - outlier) * math.exp(-0.5 * squared)
        value += trust * (math.log(near + outlier) - flat)
        explained += squared < 9.0
        w = trust * near / (near + outlier) * inverse
        # The derivative of the end point by theta is (-ry, rx).
        axt, ayt = -ry * axx + rx * axy, -ry * axy + rx * ayy
        pull[0] -= w * ux
        pull[1] -= w * uy
        pull[2] -= w * (-ry * ux + rx * uy)
        seen[0, 0] += w * axx
        seen[0, 1] += w * axy
        seen[0, 2] += w * axt
        seen[1, 1] += w * ayy
        seen[1, 2] += w * ayt
        seen[2, 2] += w * (-ry * axt + rx * ayt)
    return value, explained, best


@compiled
def _add_prior(
    pose: Floats,
    prior: tuple[float, float, float],
    information: Floats,
    beam_weight: float,
    seen: Floats,
    pull: Floats,
    total: Floats,
) -> None:
    """Fill `total` (3, 3) with the information of prior and scan; add the prior to `pull` (3,)."""
    offset = _offset(pose, prior)
    for i in range(3):
        pull[i] *= beam_weight
        for j in range(3):
            pull[i] -= information[i, j] * offset[j]
            total[i, j] = information[i, j] + beam_weight * seen[i, j]


@compiled
def _step(spread: Floats, pull: Floats, lever: float, pose: Floats) -> float:
    """Move `pose` (3,) by a least-squares step; return its size [m]."""
    dx = spread[0, 0] * pull[0] + spread[0, 1] * pull[1] + spread[0, 2] * pull[2]
    dy = spread[1, 0] * pull[0] + spread[1, 1] * pull[1] + spread[1, 2] * pull[2]
    dt = spread[2, 0] * pull[0] + spread[2, 1] * pull[1] + spread[2, 2] * pull[2]
    size: float = max(abs(dx), abs(dy), lever * abs(dt))
    scale = 0.3 / size if size > 0.3 else 1.0
    pose[0] += scale * dx
    pose[1] += scale * dy
    pose[2] += scale * dt
    return size
