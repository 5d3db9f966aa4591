"""Fitting pieces of wall to the end points in the cells around.

Source: Biber & Strasser 2003 (normal distributions), Censi 2008 (distances point to line).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.closest_walls import Ids
from mapping.compiled import compiled
from mapping.geometry import Floats

# Fewer cells than this, hit fewer times than that, do not tell which way a surface runs. At the far
# ends of a corridor single beams meet the walls at a slant, a good way apart: taken for posts they
# would hold a robot back, as every scan has them at the same distances.
FEW_CELLS, FEW_HITS = 3, 5.0


@compiled
def refit_surfels(
    dirty: npt.NDArray[np.bool_],
    owned: Ids,
    occupied: npt.NDArray[np.bool_],
    cells: Ids,
    sums: Floats,
    surfels: Floats,
    radius: int,
    doubt: float,
    now: float,
    ratios: tuple[float, float],
) -> None:
    """Fit the surfels anew, in place, in whose neighbourhood something changed.

    The arrays are those of `SurfaceMap`, of all surfels up to its count; `surfels` is changed.

    Args:
        dirty: (n,) bool, around which to fit.
        owned: (layers, rows, cols) int32.
        occupied: (capacity,) bool.
        cells: (capacity, 3) int32.
        sums: (capacity, 6).
        surfels: (capacity, 6).
        radius: `SurfaceSettings.fit_radius` [cells].
        doubt: `SurfaceSettings.doubt`.
        now: number of scans taken in.
        ratios: `SurfaceSettings.line_below` and `blob_above`.
    """
    _, rows, cols = owned.shape
    again = np.zeros(len(dirty), dtype=np.bool_)
    for k in range(len(dirty)):
        if not dirty[k]:
            continue
        layer = cells[k, 0]
        for iy in range(max(0, cells[k, 1] - radius), min(rows, cells[k, 1] + radius + 1)):
            for ix in range(max(0, cells[k, 2] - radius), min(cols, cells[k, 2] + radius + 1)):
                j = owned[layer, iy, ix]
                if j >= 0 and occupied[j] and not again[j]:
                    again[j] = True
                    _fit_surfel(
                        j, owned, occupied, cells, sums, surfels, radius, doubt, now, ratios
                    )


@compiled
def _fit_surfel(
    k: int,
    owned: Ids,
    occupied: npt.NDArray[np.bool_],
    cells: Ids,
    sums: Floats,
    surfels: Floats,
    radius: int,
    doubt: float,
    now: float,
    ratios: tuple[float, float],
) -> None:
    """Fit a line to the end points around surfel `k`; how much it is a line shapes its matrix."""
    _, rows, cols = owned.shape
    layer = cells[k, 0]
    x0, y0 = sums[k, 1] / sums[k, 0], sums[k, 2] / sums[k, 0]
    neighbours = 0
    n = sx = sy = sxx = sxy = syy = 0.0
    first = now
    for iy in range(max(0, cells[k, 1] - radius), min(rows, cells[k, 1] + radius + 1)):
        for ix in range(max(0, cells[k, 2] - radius), min(cols, cells[k, 2] + radius + 1)):
            j = owned[layer, iy, ix]
            if j < 0:
                continue
            # Around a corner the other wall must not bend the line: it counts less.
            agree = (sums[k, 3] * sums[j, 3] + sums[k, 4] * sums[j, 4]) / (sums[k, 0] * sums[j, 0])
            if agree <= 0.0:
                continue
            w = sums[j, 0] * agree * agree
            neighbours += 1
            first = min(first, sums[j, 5])
            x = sums[j, 1] / sums[j, 0] - x0
            y = sums[j, 2] / sums[j, 0] - y0
            n += w
            sx += w * x
            sy += w * y
            sxx += w * x * x
            sxy += w * x * y
            syy += w * y * y
    surfel = surfels[k]
    shape_surfel((n, sx, sy, sxx, sxy, syy), (neighbours, first), now, doubt, ratios, surfel)
    surfel[0] += x0
    surfel[1] += y0


@compiled
def shape_surfel(
    moments: tuple[float, float, float, float, float, float],
    seen_from: tuple[int, float],
    now: float,
    doubt: float,
    ratios: tuple[float, float],
    surfel: Floats,
) -> None:
    """Fill a surfel (6,) by the end points around its own cell's mean, which is its origin here.

    Args:
        moments: weights of the end points, summed: 1, x, y, x x, x y, y y [m].
        seen_from: in how many cells they lie, and with which scan the first of them came.
        now: number of scans taken in.
        doubt: `SurfaceSettings.doubt`.
        ratios: `SurfaceSettings.line_below` and `blob_above`.
        surfel: filled.
    """
    n, sx, sy, sxx, sxy, syy = moments
    neighbours, first = seen_from
    mx, my = sx / n, sy / n
    cxx, cxy, cyy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
    half = 0.5 * (cxx - cyy)
    spread = math.sqrt(half * half + cxy * cxy)
    middle = 0.5 * (cxx + cyy)
    ratio = (middle - spread) / (middle + spread) if middle + spread > 1e-9 else 1.0
    blob = min(1.0, max(0.0, (ratio - ratios[0]) / (ratios[1] - ratios[0])))
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
    nx, ny = -math.sin(angle), math.cos(angle)
    # A blob sits at its own cell's mean, a line passes through the mean of all.
    surfel[0] = (1.0 - blob) * mx
    surfel[1] = (1.0 - blob) * my
    surfel[2] = nx * nx + blob * ny * ny
    surfel[3] = nx * ny * (1.0 - blob)
    surfel[4] = ny * ny + blob * nx * nx
    seen = min(n, now - first + 1.0)
    surfel[5] = 0.0 if neighbours < FEW_CELLS and n < FEW_HITS else seen / (seen + doubt)
