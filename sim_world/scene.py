"""What is solid: walls or a grid of solid cells, behind one small interface."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.grid import GridGeometry, geometry_around
from sim_world import walls as wall_index
from sim_world.raycast import cast_grid, cast_segments, clear_rings_of
from sim_world.wall_crossings import count_solid_runs, count_walls
from sim_world.walls import Walls

Solid = npt.NDArray[np.bool_]

# Edge of a truth cell [m] where the world itself has none.
TRUTH_RESOLUTION = 0.05


class Scene(Protocol):
    """Everything in the world that stops light and bodies, apart from the robots."""

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """(x_min, y_min, x_max, y_max) [m] of the world; all outside is solid to a body."""

    def cast(self, T_world_laser: Pose2, bearings: Floats, range_max: float) -> Floats:
        """Return the exact range (beams,) [m] along each bearing (beams,) [rad] of the laser."""

    def clearance(self, x: float, y: float, limit: float) -> float:
        """Return the distance [m] to the nearest solid point, at most `limit`; 0 inside one."""

    def collides(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc at (x, y) [m] overlaps anything solid; touching is not overlapping."""

    def walls_between(self, x1: float, y1: float, x2: float, y2: float) -> int:
        """Return how many solid things the straight line between two points [m] crosses."""

    def free_truth(self, resolution: float = TRUTH_RESOLUTION) -> tuple[Solid, GridGeometry]:
        """Return the solid cells (rows, cols) bool of the whole world, for judging maps.

        A world that is a grid already answers with its own cells, whatever `resolution` [m] says.
        """


class WallScene:
    """A world of walls, boxes and pillars given as line segments."""

    def __init__(self, walls: Walls) -> None:
        self.walls = walls
        self.extent = walls.extent
        self._truth: dict[float, tuple[Solid, GridGeometry]] = {}

    def cast(self, T_world_laser: Pose2, bearings: Floats, range_max: float) -> Floats:
        """Return the exact range (beams,) [m] along each bearing (beams,) [rad] of the laser."""
        return cast_segments(self.walls, T_world_laser, bearings, range_max)

    def clearance(self, x: float, y: float, limit: float) -> float:
        """Return the distance [m] to the nearest wall, at most `limit`; 0 in one or outside."""
        x_min, y_min, x_max, y_max = self.extent
        if not (x_min <= x <= x_max and y_min <= y <= y_max):
            return 0.0
        return wall_index.clearance(self.walls, x, y, limit)

    def collides(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc at (x, y) [m] overlaps anything solid."""
        return self.clearance(x, y, radius) < radius

    def walls_between(self, x1: float, y1: float, x2: float, y2: float) -> int:
        """Return how many walls the straight line between two points [m] crosses."""
        return count_walls(self.walls, x1, y1, x2, y2)

    def free_truth(self, resolution: float = TRUTH_RESOLUTION) -> tuple[Solid, GridGeometry]:
        """Return the solid cells, with a closed rim around the whole world.

        A cell is solid when its centre lies in a solid, or when a wall thinner than two cells
        passes through it, so that no thin wall lets the flood of reachable cells through.
        """
        if resolution not in self._truth:
            x_min, y_min, x_max, y_max = self.extent
            geometry = geometry_around(
                x_min - resolution,
                y_min - resolution,
                x_max + resolution,
                y_max + resolution,
                resolution,
            )
            self._truth[resolution] = (rasterise(self.walls, geometry), geometry)
        return self._truth[resolution]


class GridScene:
    """A world of solid square cells, such as a map some robot made; all outside is solid."""

    def __init__(self, solid: Solid, geometry: GridGeometry) -> None:
        self.solid = np.ascontiguousarray(solid)
        self.geometry = geometry
        self.clear_rings = clear_rings_of(self.solid)
        self.extent = (
            geometry.origin_x,
            geometry.origin_y,
            geometry.origin_x + geometry.cols * geometry.resolution,
            geometry.origin_y + geometry.rows * geometry.resolution,
        )

    def cast(self, T_world_laser: Pose2, bearings: Floats, range_max: float) -> Floats:
        """Return the exact range (beams,) [m] along each bearing (beams,) [rad] of the laser."""
        return cast_grid(self.clear_rings, self.geometry, T_world_laser, bearings, range_max)

    def clearance(self, x: float, y: float, limit: float) -> float:
        """Return the distance [m] to the nearest solid cell, at most `limit`; 0 inside one."""
        g = self.geometry
        found: float = _grid_clearance(
            self.clear_rings,
            (x - g.origin_x) / g.resolution,
            (y - g.origin_y) / g.resolution,
            limit / g.resolution,
        )
        return min(found * g.resolution, limit)

    def collides(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc at (x, y) [m] overlaps anything solid."""
        return self.clearance(x, y, radius) < radius

    def walls_between(self, x1: float, y1: float, x2: float, y2: float) -> int:
        """Return how many runs of solid cells the straight line between two points [m] crosses."""
        return count_solid_runs(self.clear_rings, self.geometry, x1, y1, x2, y2)

    def free_truth(self, resolution: float = TRUTH_RESOLUTION) -> tuple[Solid, GridGeometry]:
        """Return the grid's own solid cells; `resolution` is not used."""
        return self.solid, self.geometry


@compiled
def _grid_clearance(clear_rings: npt.NDArray[np.uint8], x: float, y: float, limit: float) -> float:
    """Return the distance from (x, y) to the nearest solid cell, all in cells."""
    rows, cols = clear_rings.shape
    here_x, here_y = math.floor(x), math.floor(y)
    if 0 <= here_x < cols and 0 <= here_y < rows and clear_rings[here_y, here_x] > limit + 1.0:
        return limit
    nearest = limit * limit
    for iy in range(math.floor(y - limit), math.floor(y + limit) + 1):
        off_y = max(iy - y, y - (iy + 1), 0.0)
        for ix in range(math.floor(x - limit), math.floor(x + limit) + 1):
            inside = 0 <= iy < rows and 0 <= ix < cols
            if inside and clear_rings[iy, ix] > 0:
                continue
            off_x = max(ix - x, x - (ix + 1), 0.0)
            nearest = min(nearest, off_x * off_x + off_y * off_y)
    return math.sqrt(nearest)


def rasterise(walls: Walls, geometry: GridGeometry) -> Solid:
    """Return which cells of `geometry` the walls make solid, (rows, cols) bool.

    All cells beyond the outermost walls are solid.
    """
    x_min, y_min, x_max, y_max = walls.extent
    solid = np.ones(geometry.shape, dtype=np.bool_)
    inner = geometry.box_around(x_min + 1e-9, y_min + 1e-9, x_max - 1e-9, y_max - 1e-9)
    solid[inner.slices] = False
    for k in range(walls.solid_count):
        draw_solid(solid, geometry, walls.solid(k))
    _trace(solid, geometry, walls.bare)
    return solid


def draw_solid(solid: Solid, geometry: GridGeometry, corners: Floats) -> None:
    """Mark, in place, the cells (rows, cols) that a convex polygon makes solid.

    Args:
        solid: cells of `geometry`.
        geometry: where they are; the polygon may lie outside.
        corners: (K, 2) [m], counter-clockwise.
    """
    _fill(solid, geometry, corners)
    if _width(corners) < 2.0 * geometry.resolution:
        _trace(solid, geometry, np.hstack((corners, np.roll(corners, -1, axis=0))))


def _width(corners: Floats) -> float:
    """Return the least width [m] of a convex polygon (K, 2), counter-clockwise."""
    along = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(along[:, 0], along[:, 1])
    inward = np.column_stack((-along[:, 1], along[:, 0])) / np.maximum(lengths, 1e-12)[:, None]
    heights = ((corners[None, :, :] - corners[:, None, :]) * inward[:, None, :]).sum(axis=2)
    return float(heights.max(axis=1).min())


def _fill(solid: Solid, geometry: GridGeometry, corners: Floats) -> None:
    """Mark, in place, the cells whose centre lies in a convex polygon (K, 2)."""
    (x_min, y_min), (x_max, y_max) = corners.min(axis=0), corners.max(axis=0)
    box = geometry.box_around(float(x_min), float(y_min), float(x_max), float(y_max))
    if box.empty:
        return
    xs = geometry.origin_x + (np.arange(box.ix0, box.ix1) + 0.5) * geometry.resolution
    ys = geometry.origin_y + (np.arange(box.iy0, box.iy1) + 0.5) * geometry.resolution
    inside = np.ones((len(ys), len(xs)), dtype=np.bool_)
    for (x1, y1), (x2, y2) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        # A hair of slack: a wall whose face runs through cell centres is solid on both faces.
        inside &= (x2 - x1) * (ys[:, None] - y1) - (y2 - y1) * (xs[None, :] - x1) >= -1e-9
    solid[box.slices] |= inside


def _trace(solid: Solid, geometry: GridGeometry, segments: Floats) -> None:
    """Mark, in place, every cell that a segment of (B, 4) [m] touches."""
    half = 0.5 * geometry.resolution
    for x1, y1, x2, y2 in segments.tolist():
        box = geometry.box_around(min(x1, x2), min(y1, y2), max(x1, x2), max(y1, y2))
        if box.empty:
            continue
        xs = geometry.origin_x + (np.arange(box.ix0, box.ix1) + 0.5) * geometry.resolution
        ys = geometry.origin_y + (np.arange(box.iy0, box.iy1) + 0.5) * geometry.resolution
        normal_x, normal_y = y1 - y2, x2 - x1
        offsets = normal_x * (xs[None, :] - x1) + normal_y * (ys[:, None] - y1)
        solid[box.slices] |= np.abs(offsets) <= half * (abs(normal_x) + abs(normal_y)) + 1e-9
