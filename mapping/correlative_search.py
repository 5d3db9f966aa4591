"""Exhaustive search for the pose at which a scan fits a map best, within a window.

Every pose of a lattice is considered; blocks of poses whose upper bound falls short of the best pose
so far are skipped, so the result is the best of all. End points are scored by reading an image; the
bound of a block reads the same image after a running maximum over the block, which covers blocks
across the image's edge as well.

Source: Olson 2009, "Real-time correlative scan matching".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2, pose_from
from mapping.grid import GridGeometry, OccupancyGrid
from mapping.surface_map import LAYERS, SurfaceMap, layer_of

Scores = npt.NDArray[np.uint8]

# Edge of a block of translations [cells]: a power of two, for the running maximum by doubling.
BLOCK = 8


@dataclass(frozen=True, slots=True)
class SearchWindow:
    """Which poses to consider around a guess.

    Attributes:
        reach: up to this far off in x and in y [m].
        turn: up to this much off in heading [rad].
        turn_step: lattice of headings [rad]; translations step by one cell.
    """

    reach: float = 1.0
    turn: float = math.radians(20.0)
    turn_step: float = math.radians(0.75)


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """How the search scores an end point.

    Attributes:
        sigma: width of the walls in the score [m]; wider than for fine matching, as the lattice
            never meets the true pose.
        outlier: weight of end points in free space.
        unknown: weight of end points where nothing is known: neither for nor against.
        known_above: a cell is known where its log-odds exceed this in size.
        beams: at most this many end points are used, evenly spread.
        candidates: how many separate maxima to return.
    """

    sigma: float = 0.08
    outlier: float = 0.05
    unknown: float = 0.3
    known_above: float = 0.3
    beams: int = 180
    candidates: int = 3


def score_image(
    grid: OccupancyGrid, surfaces: SurfaceMap, settings: SearchSettings
) -> tuple[Scores, float]:
    """Return the score of an end point per layer and cell (2, rows, cols) uint8, and its unit."""
    unit = -math.log(settings.outlier) / 255.0
    squared = np.arange(256) * grid.geometry.resolution**2
    near = np.exp(-0.5 * squared / settings.sigma**2)
    likelihood = (1.0 - settings.outlier) * near + settings.outlier
    likelihood[255] = settings.outlier
    table = np.round(255.0 + np.log(likelihood) / unit).clip(0, 255).astype(np.uint8)
    neutral = round(255.0 + math.log(settings.unknown) / unit)
    image = np.empty((LAYERS, *grid.geometry.shape), dtype=np.uint8)
    _paint(grid.log_odds, surfaces.squared, table, neutral, settings.known_above, image)
    return image, unit


@compiled
def _paint(
    log_odds: npt.NDArray[np.float32],
    squared: npt.NDArray[np.uint8],
    table: Scores,
    neutral: int,
    known_above: float,
    image: Scores,
) -> None:
    """Score each cell by its distance to walls; far from walls by whether it is known."""
    for layer in range(image.shape[0]):
        for iy in range(image.shape[1]):
            for ix in range(image.shape[2]):
                value = table[squared[layer, iy, ix]]
                if abs(log_odds[iy, ix]) <= known_above and value < neutral:
                    value = np.uint8(neutral)
                image[layer, iy, ix] = value


def search(
    grid: OccupancyGrid,
    surfaces: SurfaceMap,
    points_base: Floats,
    T_map_guess: Pose2,
    window: SearchWindow,
    prior_information: Floats,
    beam_weight: float,
    settings: SearchSettings,
) -> list[Pose2]:
    """Return the best poses of the window, best first, each a maximum of its own block.

    Args:
        grid: the map so far.
        surfaces: its walls.
        points_base: (N, 4) end points [m] and the directions their surfaces face.
        T_map_guess: centre of the window and of the prior.
        window: which poses to consider.
        prior_information: (3, 3) inverse covariance of the guess, map frame.
        beam_weight: weight of one end point's log-likelihood against the prior.
        settings: how end points score.
    """
    stride = -(-len(points_base) // settings.beams)
    points = points_base[:: max(stride, 1)]
    geometry = grid.geometry
    steps = math.ceil(window.reach / geometry.resolution)
    turns = math.ceil(window.turn / window.turn_step)
    margin = float(np.hypot(points[:, 0], points[:, 1]).max()) + (steps + 2 * BLOCK + 2) * (
        geometry.resolution
    )
    region, unit = _cut(grid, surfaces, T_map_guess, margin, settings)
    found = np.empty((settings.candidates, 4))
    count = _search(
        region.image,
        points * 1.0,
        (T_map_guess.x, T_map_guess.y, T_map_guess.theta),
        (region.x, region.y, geometry.resolution),
        steps,
        turns,
        window.turn_step,
        prior_information,
        unit * beam_weight * len(points_base) / len(points),
        found,
    )
    return [pose_from(row[:3]) for row in found[:count]]


@dataclass(frozen=True, slots=True)
class _Region:
    """A piece of the score image and the corner (x, y) [m] of its first cell."""

    image: Scores
    x: float
    y: float


def _cut(
    grid: OccupancyGrid,
    surfaces: SurfaceMap,
    T_map_guess: Pose2,
    margin: float,
    settings: SearchSettings,
) -> tuple[_Region, float]:
    """Return the score image of a square around the guess; beyond the grid all is unknown."""
    geometry = grid.geometry
    iy, ix = geometry.cell_at(T_map_guess.x, T_map_guess.y)
    half = math.ceil(margin / geometry.resolution)
    log_odds = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
    squared = np.full((LAYERS, *log_odds.shape), 255, dtype=np.uint8)
    box = geometry.box_around(
        *geometry.centre_of(iy - half, ix - half), *geometry.centre_of(iy + half, ix + half)
    )
    if not box.empty:
        there = box.shifted(half - iy, half - ix).slices
        log_odds[there] = grid.log_odds[box.slices]
        squared[:, *there] = surfaces.squared[:, *box.slices]
    corner_x = geometry.origin_x + (ix - half) * geometry.resolution
    corner_y = geometry.origin_y + (iy - half) * geometry.resolution
    local = GridGeometry(geometry.resolution, corner_x, corner_y, *log_odds.shape)
    piece = _Squares(squared)
    image, unit = score_image(OccupancyGrid(local, log_odds), piece, settings)  # type: ignore[arg-type]
    return _Region(image, corner_x, corner_y), unit


@dataclass(frozen=True, slots=True)
class _Squares:
    """Just the squared distances of a surface map."""

    squared: npt.NDArray[np.uint8]


@compiled
def _running_maximum(image: Scores, block: int) -> Scores:
    """Return for each cell the maximum over the block that starts there, by doubling."""
    layers, rows, cols = image.shape
    result = image.copy()
    width = 1
    while width < block:
        for k in range(layers):
            for iy in range(rows):
                for ix in range(cols - width):
                    result[k, iy, ix] = max(result[k, iy, ix], result[k, iy, ix + width])
            for iy in range(rows - width):
                for ix in range(cols):
                    result[k, iy, ix] = max(result[k, iy, ix], result[k, iy + width, ix])
        width *= 2
    return result


@compiled
def _search(
    image: Scores,
    points: Floats,
    guess: tuple[float, float, float],
    lattice: tuple[float, float, float],
    steps: int,
    turns: int,
    turn_step: float,
    information: Floats,
    unit: float,
    found: Floats,
) -> int:
    """Fill `found` with (x, y, theta, score) of the best poses; return how many."""
    block = 8
    coarse = _running_maximum(image, block)
    n = points.shape[0]
    resolution = lattice[2]
    per_axis = (2 * steps + block) // block
    total = (2 * turns + 1) * per_axis * per_axis
    bounds = np.empty(total)
    cells = np.empty((2 * turns + 1, n, 3), dtype=np.int32)
    b = 0
    for t in range(2 * turns + 1):
        dt = (t - turns) * turn_step
        c, s = math.cos(guess[2] + dt), math.sin(guess[2] + dt)
        for i in range(n):
            x = guess[0] + c * points[i, 0] - s * points[i, 1]
            y = guess[1] + s * points[i, 0] + c * points[i, 1]
            nx = c * points[i, 2] - s * points[i, 3]
            cells[t, i, 0] = layer_of(nx, s * points[i, 2] + c * points[i, 3])
            cells[t, i, 1] = int(math.floor((y - lattice[1]) / resolution))
            cells[t, i, 2] = int(math.floor((x - lattice[0]) / resolution))
        for by in range(per_axis):
            for bx in range(per_axis):
                oy, ox = by * block - steps, bx * block - steps
                score = 0
                for i in range(n):
                    score += coarse[cells[t, i, 0], cells[t, i, 1] + oy, cells[t, i, 2] + ox]
                bounds[b] = unit * score + _prior_bound(
                    information, ox * resolution, oy * resolution, dt, (block - 1) * resolution
                )
                b += 1
    order = np.argsort(-bounds)
    count = 0
    for b in order:
        if count == found.shape[0] and bounds[b] <= found[count - 1, 3]:
            break
        t = b // (per_axis * per_axis)
        by = b // per_axis % per_axis
        bx = b % per_axis
        dt = (t - turns) * turn_step
        best, best_x, best_y = -math.inf, 0.0, 0.0
        for oy in range(by * block - steps, min((by + 1) * block - steps, steps + 1)):
            for ox in range(bx * block - steps, min((bx + 1) * block - steps, steps + 1)):
                score = 0
                for i in range(n):
                    score += image[cells[t, i, 0], cells[t, i, 1] + oy, cells[t, i, 2] + ox]
                dx, dy = ox * resolution, oy * resolution
                value = unit * score + _log_prior(information, dx, dy, dt)
                if value > best:
                    best, best_x, best_y = value, dx, dy
        count = _keep(found, count, (guess[0] + best_x, guess[1] + best_y, guess[2] + dt, best))
    return count


@compiled
def _log_prior(information: Floats, dx: float, dy: float, dt: float) -> float:
    """Return the prior's log density at an offset, up to a constant."""
    return -0.5 * (
        information[0, 0] * dx * dx
        + information[1, 1] * dy * dy
        + information[2, 2] * dt * dt
        + 2.0 * information[0, 1] * dx * dy
        + 2.0 * information[0, 2] * dx * dt
        + 2.0 * information[1, 2] * dy * dt
    )


@compiled
def _prior_bound(information: Floats, dx: float, dy: float, dt: float, width: float) -> float:
    """Return an upper bound of the prior over a block of offsets: it lies below its tangents."""
    cx, cy = dx + 0.5 * width, dy + 0.5 * width
    gx = information[0, 0] * cx + information[0, 1] * cy + information[0, 2] * dt
    gy = information[0, 1] * cx + information[1, 1] * cy + information[1, 2] * dt
    bound = _log_prior(information, cx, cy, dt) + 0.5 * width * (abs(gx) + abs(gy))
    return min(0.0, bound)


@compiled
def _keep(found: Floats, count: int, candidate: tuple[float, float, float, float]) -> int:
    """Insert a candidate into the sorted list unless a better one lies close by."""
    apart_xy, apart_theta = 0.25, 0.07
    place = count
    for k in range(count - 1, -1, -1):
        close = (
            abs(found[k, 0] - candidate[0]) < apart_xy
            and abs(found[k, 1] - candidate[1]) < apart_xy
            and abs(found[k, 2] - candidate[2]) < apart_theta
        )
        if close and found[k, 3] >= candidate[3]:
            return count
        if close:
            for j in range(k, count - 1):
                found[j] = found[j + 1]
            count -= 1
    place = 0
    while place < count and found[place, 3] >= candidate[3]:
        place += 1
    if place >= found.shape[0]:
        return count
    last = min(count, found.shape[0] - 1)
    for j in range(last, place, -1):
        found[j] = found[j - 1]
    for j in range(4):
        found[place, j] = candidate[j]
    return min(count + 1, found.shape[0])
