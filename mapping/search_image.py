"""What an end point is worth in each cell of a map: the image that an exhaustive search reads.

Source: Olson 2009, "Real-time correlative scan matching".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.compiled import compiled
from mapping.grid import OccupancyGrid
from mapping.surface_map import FAR, LAYERS, SurfaceMap

Scores = npt.NDArray[np.uint8]


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
        bounded_from: blocks of poses are bounded where there are so many end points to look at for
            each cell of the image; to look at all poses of a smaller window takes less time.
    """

    sigma: float = 0.08
    outlier: float = 0.05
    unknown: float = 0.3
    known_above: float = 0.3
    beams: int = 90
    candidates: int = 3
    bounded_from: float = 4.0


def score_image(
    log_odds: npt.NDArray[np.float32],
    squared: npt.NDArray[np.uint8],
    resolution: float,
    settings: SearchSettings,
) -> tuple[Scores, float]:
    """Return the score of an end point per layer and cell, and what one unit of it is worth.

    Args:
        log_odds: (rows, cols), what is known.
        squared: (2, rows, cols), squared distances to the walls of each layer [cells^2].
        resolution: edge of a cell [m].
        settings: how end points score.

    Returns:
        image: (2, rows, cols) uint8.
        unit: log-likelihood of one unit of the image.
    """
    unit = -math.log(settings.outlier) / 255.0
    near = np.exp(-0.5 * np.arange(256) * (resolution / settings.sigma) ** 2)
    likelihood = (1.0 - settings.outlier) * near + settings.outlier
    likelihood[255] = settings.outlier
    table = np.round(255.0 + np.log(likelihood) / unit).clip(0, 255).astype(np.uint8)
    neutral = round(255.0 + math.log(settings.unknown) / unit)
    image = np.empty(squared.shape, dtype=np.uint8)
    _paint(log_odds, squared, table, neutral, settings.known_above, image)
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


def cut_image(
    grid: OccupancyGrid, surfaces: SurfaceMap, box: CellBox, settings: SearchSettings
) -> tuple[Scores, float]:
    """Return the score image of a box of cells, and its unit; beyond the grid all is unknown."""
    geometry = grid.geometry
    log_odds = np.zeros((box.iy1 - box.iy0, box.ix1 - box.ix0), dtype=np.float32)
    squared = np.full((LAYERS, *log_odds.shape), FAR, dtype=np.uint8)
    inside = box.clipped(geometry.shape)
    if not inside.empty:
        rows, cols = inside.shifted(-box.iy0, -box.ix0).slices
        log_odds[rows, cols] = grid.log_odds[inside.slices]
        squared[:, rows, cols] = surfaces.squared[:, *inside.slices]
    return score_image(log_odds, squared, geometry.resolution, settings)
