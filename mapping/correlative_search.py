"""Exhaustive search for the pose at which a scan fits a map best, within a window.

Every pose of a lattice is considered; blocks of poses whose upper bound falls short of the best
pose so far are skipped, so the result is the best of all. End points are scored by reading an
image; the bound of a block reads the same image after a running maximum over the block, which
covers blocks across the image's edge as well.

Source: Olson 2009, "Real-time correlative scan matching".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2, pose_from
from mapping.grid import OccupancyGrid
from mapping.search_image import Scores, SearchSettings, cut_image
from mapping.surface_map import SurfaceMap, layer_of

# Edge of a block of translations [cells]: a power of two, for the running maximum by doubling.
BLOCK = 8

# Poses closer than this to a better one are not worth a start of their own [m], [rad].
APART = 0.25
APART_TURN = 0.07


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
    stride = max(-(-len(points_base) // settings.beams), 1)
    points = np.ascontiguousarray(points_base[::stride])
    geometry = grid.geometry
    steps = math.ceil(window.reach / geometry.resolution)
    guess = (T_map_guess.x, T_map_guess.y, T_map_guess.theta)
    turning = (math.ceil(window.turn / window.turn_step), window.turn_step)
    cells = _project(
        points, guess, (geometry.origin_x, geometry.origin_y, geometry.resolution), *turning
    )
    low = cells[:, :, 1:].min(axis=(0, 1)) - steps
    high = cells[:, :, 1:].max(axis=(0, 1)) + steps + 2 * BLOCK
    cells[:, :, 1:] -= low
    image, unit = cut_image(grid, surfaces, CellBox(*low.tolist(), *high.tolist()), settings)
    per_axis = (2 * steps + BLOCK) // BLOCK
    lattice = (steps, per_axis, geometry.resolution)
    worth = unit * beam_weight * len(points_base) / len(points)
    if cells.size * (2 * steps + 1) ** 2 < settings.bounded_from * image.size:
        bounds = np.full(len(cells) * per_axis**2, math.inf)
    else:
        coarse = running_maximum(image, BLOCK)
        bounds = _bounds(coarse, cells, *lattice, turning, prior_information, worth)
    found = np.empty((settings.candidates, 4))
    count = _search(
        image, cells, bounds, guess, lattice, turning, prior_information, worth, found
    )  # fmt: skip
    return [pose_from(row[:3]) for row in found[:count]]


def running_maximum(image: Scores, block: int) -> Scores:
    """Return for each cell the maximum over the block (a power of two) that starts there."""
    result = image.copy()
    width = 1
    while width < block:
        np.maximum(result[:, :, :-width], result[:, :, width:], out=result[:, :, :-width])
        np.maximum(result[:, :-width], result[:, width:], out=result[:, :-width])
        width *= 2
    return result


@compiled
def _search(
    image: Scores,
    cells: npt.NDArray[np.int32],
    bounds: Floats,
    guess: tuple[float, float, float],
    lattice: tuple[int, int, float],
    turning: tuple[int, float],
    information: Floats,
    unit: float,
    found: Floats,
) -> int:
    """Fill `found` with (x, y, theta, score) of the best poses; return how many.

    Args:
        cells: (headings, N, 3) layer, row and column of each end point for each heading.
        bounds: no pose of a block scores more, by headings, rows and columns of blocks.
        lattice: translations up to this many cells to each side, how many blocks they make along
            each axis, and the edge of a cell [m].
        turning: headings up to this many steps to each side, and one step [rad].
        unit: log-likelihood of one unit of the image.
    """
    steps, per_axis, resolution = lattice
    count = 0
    for b in np.argsort(-bounds):
        if count == found.shape[0] and bounds[b] <= found[count - 1, 3]:
            break
        t = b // (per_axis * per_axis)
        dt = (t - turning[0]) * turning[1]
        score, dx, dy = _best_of_block(
            image, cells[t], (b // per_axis) % per_axis, b % per_axis, steps, resolution, dt,
            information, unit,
        )  # fmt: skip
        count = _keep(found, count, (guess[0] + dx, guess[1] + dy, guess[2] + dt, score))
    return count


@compiled
def _project(
    points: Floats,
    guess: tuple[float, float, float],
    lattice: tuple[float, float, float],
    turns: int,
    turn_step: float,
) -> npt.NDArray[np.int32]:
    """Return layer, row and column of each end point for each heading, (headings, N, 3)."""
    cells = np.empty((2 * turns + 1, points.shape[0], 3), dtype=np.int32)
    for t in range(2 * turns + 1):
        theta = guess[2] + (t - turns) * turn_step
        c, s = math.cos(theta), math.sin(theta)
        for i in range(points.shape[0]):
            x = guess[0] + c * points[i, 0] - s * points[i, 1]
            y = guess[1] + s * points[i, 0] + c * points[i, 1]
            nx = c * points[i, 2] - s * points[i, 3]
            cells[t, i, 0] = layer_of(nx, s * points[i, 2] + c * points[i, 3])
            cells[t, i, 1] = int(math.floor((y - lattice[1]) / lattice[2]))
            cells[t, i, 2] = int(math.floor((x - lattice[0]) / lattice[2]))
    return cells


@compiled
def _bounds(
    coarse: Scores,
    cells: npt.NDArray[np.int32],
    steps: int,
    per_axis: int,
    resolution: float,
    turning: tuple[int, float],
    information: Floats,
    unit: float,
) -> Floats:
    """Return an upper bound of the score of every block, headings first, then rows."""
    bounds = np.empty(cells.shape[0] * per_axis * per_axis)
    b = 0
    for t in range(cells.shape[0]):
        dt = (t - turning[0]) * turning[1]
        for by in range(per_axis):
            for bx in range(per_axis):
                oy, ox = by * BLOCK - steps, bx * BLOCK - steps
                score = 0
                for i in range(cells.shape[1]):
                    score += int(coarse[cells[t, i, 0], cells[t, i, 1] + oy, cells[t, i, 2] + ox])
                bounds[b] = unit * score + _prior_bound(
                    information, ox * resolution, oy * resolution, dt, (BLOCK - 1) * resolution
                )
                b += 1
    return bounds


@compiled
def _best_of_block(
    image: Scores,
    cells: npt.NDArray[np.int32],
    by: int,
    bx: int,
    steps: int,
    resolution: float,
    dt: float,
    information: Floats,
    unit: float,
) -> tuple[float, float, float]:
    """Return score and offset (x, y) [m] of the best pose of one block; headings are off by dt."""
    best, best_x, best_y = -math.inf, 0.0, 0.0
    for oy in range(by * BLOCK - steps, min((by + 1) * BLOCK - steps, steps + 1)):
        for ox in range(bx * BLOCK - steps, min((bx + 1) * BLOCK - steps, steps + 1)):
            score = 0
            for i in range(cells.shape[0]):
                score += int(image[cells[i, 0], cells[i, 1] + oy, cells[i, 2] + ox])
            dx, dy = ox * resolution, oy * resolution
            value = unit * score + _log_prior(information, dx, dy, dt)
            if value > best:
                best, best_x, best_y = value, dx, dy
    return best, best_x, best_y


@compiled
def _log_prior(information: Floats, dx: float, dy: float, dt: float) -> float:
    """Return the prior's log density at an offset, up to a constant."""
    value: float = -0.5 * (
        information[0, 0] * dx * dx
        + information[1, 1] * dy * dy
        + information[2, 2] * dt * dt
        + 2.0 * information[0, 1] * dx * dy
        + 2.0 * information[0, 2] * dx * dt
        + 2.0 * information[1, 2] * dy * dt
    )
    return value


@compiled
def _prior_bound(information: Floats, dx: float, dy: float, dt: float, width: float) -> float:
    """Return an upper bound of the prior over a block of offsets: it lies below its tangents."""
    cx, cy = dx + 0.5 * width, dy + 0.5 * width
    gx = information[0, 0] * cx + information[0, 1] * cy + information[0, 2] * dt
    gy = information[0, 1] * cx + information[1, 1] * cy + information[1, 2] * dt
    bound: float = _log_prior(information, cx, cy, dt) + 0.5 * width * (abs(gx) + abs(gy))
    return min(0.0, bound)


@compiled
def _keep(found: Floats, count: int, candidate: tuple[float, float, float, float]) -> int:
    """Insert a candidate into the sorted list unless a better one lies close by."""
    for k in range(count - 1, -1, -1):
        close = (
            abs(found[k, 0] - candidate[0]) < APART
            and abs(found[k, 1] - candidate[1]) < APART
            and abs(found[k, 2] - candidate[2]) < APART_TURN
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
    longer: int = min(count + 1, found.shape[0])
    return longer
