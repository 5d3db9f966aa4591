"""Walls at finer scale than cells: a piece of surface for every occupied cell.

Each cell keeps the mean of the end points whose solid it is. Around every occupied cell a line is
fitted to the means of the cells nearby; the cell then stands for a small piece of wall, a *surfel*:
a point and a matrix that measures how far a new end point lies off the wall. Every cell in reach
of a wall knows its closest occupied cell, so looking up a point's surfel is one array read.

Source: Biber & Strasser 2003 (normal distributions), Censi 2008 (distances point to line); the
lookup is the feature transform that goes with a truncated distance transform.

A thin wall has two faces, a few centimetres apart, seen from its two sides. They must not be
mistaken for each other, or every doorway bends the map. So there are three layers of surfels, and
an end point belongs to one of them by the direction its surface faces. With two, a wall that runs
along the line between the halves would have both its faces in both; with three the directions of
opposite faces would have to be off by 60 degrees together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.closest_walls import Ids, move_walls
from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import GridGeometry, OccupancyGrid, Padding
from mapping.surfel_fitting import refit_surfels

_Scalar = TypeVar("_Scalar", bound=np.generic)

# Each layer takes the surfaces that face one third of all directions. The lines between the thirds
# are askew, as most walls run along or across a robot's first pose.
LAYERS = 3
ASKEW_X, ASKEW_Y = math.cos(math.radians(15.0)), math.sin(math.radians(15.0))
TAN_30 = math.tan(math.radians(30.0))

# Distances are kept as squares in cells, one byte each; this byte says "no wall within reach".
FAR = 255

NO_SURFEL = -1


@dataclass(frozen=True, slots=True)
class SurfaceSettings:
    """How surfaces are made of end points.

    Attributes:
        occupied_above: a cell is part of a wall when its log-odds exceed this.
        reach: cells up to this far from a wall know their closest wall cell [cells], at most 15.
        fit_radius: the line through a wall cell is fitted to the cells up to this far [cells].
        memory: a cell's mean forgets older end points as if it only ever held this many.
        doubt: a wall that the last n scans saw counts n / (n + doubt) as much as one known since
            long: scans that lie close in time share the errors of their poses.
        line_below: ratio of widths (variance across / variance along) below which the wall counts
            as a line: no pull along it.
        blob_above: ratio above which it counts as a blob that pulls alike in all directions.
    """

    occupied_above: float = 0.4
    reach: int = 6
    fit_radius: int = 2
    memory: float = 1000.0
    doubt: float = 20.0
    line_below: float = 0.2
    blob_above: float = 0.5


class SurfaceMap:
    """The surfels of one occupancy grid, kept in step with it.

    Attributes:
        settings: how surfaces are made.
        closest: (3, rows, cols) int32, the surfel of the closest occupied cell in reach, else -1,
            by layer.
        squared: (3, rows, cols) uint8, squared distance to that cell [cells^2], else 255.
        owned: (3, rows, cols) int32, the surfel of the cell itself, -1 if no end point fell in.
        scans: number of scans taken in.
        count: number of surfels.
        cells: (capacity, 3) int32, their layers and cells (layer, iy, ix).
        sums: (capacity, 6), number of end points, sums of their x, y [m] and of the directions that
            their surfaces face, map frame, and the number of the scan the first one came with.
        surfels: (capacity, 6), point (x, y) [m], matrix (a_xx, a_xy, a_yy) and trust, see
            `perceptual_model`.
        occupied: (capacity,) bool, whether the cell is part of a wall now.
        dirty: (capacity,) bool, which cells got end points since the walls were up to date.
    """

    __slots__ = ("cells", "closest", "count", "dirty", "occupied", "owned", "scans", "settings",
                 "squared", "sums", "surfels")  # fmt: skip

    def __init__(self, shape: tuple[int, int], settings: SurfaceSettings | None = None) -> None:
        self.settings = settings or SurfaceSettings()
        self.closest: Ids = np.full((LAYERS, *shape), NO_SURFEL, dtype=np.int32)
        self.squared: npt.NDArray[np.uint8] = np.full((LAYERS, *shape), FAR, dtype=np.uint8)
        self.owned: Ids = np.full((LAYERS, *shape), NO_SURFEL, dtype=np.int32)
        self.count = 0
        self.scans = 0
        self.cells: Ids = np.zeros((256, 3), dtype=np.int32)
        self.sums: Floats = np.zeros((256, 6))
        self.surfels: Floats = np.zeros((256, 6))
        self.occupied: npt.NDArray[np.bool_] = np.zeros(256, dtype=np.bool_)
        self.dirty: npt.NDArray[np.bool_] = np.zeros(256, dtype=np.bool_)

    def grow(self, padding: Padding) -> None:
        """Follow the grid when it grows."""
        if padding.none:
            return
        self.closest = padding.pad(self.closest, NO_SURFEL)
        self.squared = padding.pad(self.squared, FAR)
        self.owned = padding.pad(self.owned, NO_SURFEL)
        self.cells[: self.count] += np.array([0, padding.below, padding.left], dtype=np.int32)

    def take(self, geometry: GridGeometry, points_map: Floats, depth: float = 0.0) -> None:
        """Take in the end points of one scan; `refresh` fits the walls to them.

        Args:
            geometry: of the occupancy grid that this map follows.
            points_map: (N, 4) end points (x, y) [m] and the directions their surfaces face.
            depth: an end point belongs to the cell this far behind its surface [m], as in the grid.
        """
        self._reserve(len(points_map))
        self.scans += 1
        lattice = (geometry.origin_x, geometry.origin_y, geometry.resolution)
        self.count = _add_hits(
            points_map, lattice, self.owned, self.cells, self.sums, self.count,
            self.settings.memory, float(self.scans), depth, self.dirty,
        )  # fmt: skip

    def refresh(self, grid: OccupancyGrid, box: CellBox) -> None:
        """Bring the walls up to date after scans were taken in, and fused into `grid`.

        Args:
            grid: the occupancy grid this map follows.
            box: the cells that may have changed since the walls were up to date.
        """
        settings = self.settings
        flips = _find_flips(
            grid.log_odds, (box.iy0, box.ix0, box.iy1, box.ix1), self.occupied,
            np.float32(settings.occupied_above), self.cells, self.count, self.dirty,
        )  # fmt: skip
        for cleared in (True, False):
            move_walls(
                flips, cleared, self.occupied, self.cells, self.owned, self.closest, self.squared,
                settings.reach,
            )  # fmt: skip
        refit_surfels(
            self.dirty[: self.count], self.owned, self.occupied, self.cells, self.sums,
            self.surfels, settings.fit_radius, settings.doubt, float(self.scans),
            (settings.line_below, settings.blob_above),
        )  # fmt: skip
        self.dirty[: self.count] = False

    def seal(self, box: CellBox) -> None:
        """Keep, of the cells of a box, what matching needs: no scan can be taken in any more.

        Follows `OccupancyGrid.crop`.
        """
        rows, cols = box.slices
        self.closest = self.closest[:, rows, cols].copy()
        self.squared = self.squared[:, rows, cols].copy()
        self.owned = np.zeros((LAYERS, 0, 0), dtype=np.int32)
        self.surfels = self.surfels[: self.count].copy()
        self.occupied = self.occupied[: self.count].copy()
        self.cells, self.sums = np.zeros((0, 3), dtype=np.int32), np.zeros((0, 6))
        self.dirty = np.zeros(0, dtype=np.bool_)

    def _reserve(self, more: int) -> None:
        """Make room for `more` surfels."""
        capacity = len(self.occupied)
        if self.count + more <= capacity:
            return
        larger = max(2 * capacity, self.count + more)
        self.cells = _enlarged(self.cells, larger)
        self.sums = _enlarged(self.sums, larger)
        self.surfels = _enlarged(self.surfels, larger)
        self.occupied = _enlarged(self.occupied, larger)
        self.dirty = _enlarged(self.dirty, larger)


def _enlarged(array: npt.NDArray[_Scalar], rows: int) -> npt.NDArray[_Scalar]:
    """Return `array` with zero rows added at its end."""
    grown = np.zeros((rows, *array.shape[1:]), dtype=array.dtype)
    grown[: len(array)] = array
    return grown


@compiled
def layer_of(nx: float, ny: float) -> int:
    """Return the layer of a surface that faces the direction (nx, ny)."""
    along, across = nx * ASKEW_X + ny * ASKEW_Y, ny * ASKEW_X - nx * ASKEW_Y
    if across >= 0.0:
        return 0 if along >= -across * TAN_30 else 1
    return 2 if along >= across * TAN_30 else 1


@compiled
def _add_hits(
    points: Floats,
    lattice: tuple[float, float, float],
    owned: Ids,
    cells: Ids,
    sums: Floats,
    count: int,
    memory: float,
    now: float,
    depth: float,
    dirty: npt.NDArray[np.bool_],
) -> int:
    """Add end points to their cells' means; return the new number of surfels."""
    _, rows, cols = owned.shape
    for i in range(points.shape[0]):
        iy = int(math.floor((points[i, 1] - depth * points[i, 3] - lattice[1]) / lattice[2]))
        ix = int(math.floor((points[i, 0] - depth * points[i, 2] - lattice[0]) / lattice[2]))
        if not (0 <= iy < rows and 0 <= ix < cols):
            continue
        layer = layer_of(points[i, 2], points[i, 3])
        k = owned[layer, iy, ix]
        if k < 0:
            k = count
            count += 1
            owned[layer, iy, ix] = k
            cells[k, 0] = layer
            cells[k, 1] = iy
            cells[k, 2] = ix
            sums[k, 5] = now
        if sums[k, 0] >= memory:
            keep = (memory - 1.0) / sums[k, 0]
            for j in range(5):
                sums[k, j] *= keep
        sums[k, 0] += 1.0
        for j in range(4):
            sums[k, j + 1] += points[i, j]
        dirty[k] = True
    return count


@compiled
def _find_flips(
    log_odds: npt.NDArray[np.float32],
    box: tuple[int, int, int, int],
    occupied: npt.NDArray[np.bool_],
    threshold: np.float32,
    cells: Ids,
    surfels: int,
    dirty: npt.NDArray[np.bool_],
) -> Ids:
    """Bring `occupied` up to date; return the surfels that became wall or stopped being one."""
    flips = np.empty(len(dirty), dtype=np.int32)
    count = 0
    for k in range(surfels):
        iy, ix = cells[k, 1], cells[k, 2]
        if not (box[0] <= iy < box[2] and box[1] <= ix < box[3]):
            continue
        if (log_odds[iy, ix] > threshold) != occupied[k]:
            occupied[k] = not occupied[k]
            dirty[k] = True
            flips[count] = k
            count += 1
    return flips[:count]
