"""The robot's copy of the team's map, and what path planning reads from it.

The server sends the whole map once and then numbered changes. Each change brings the derived grids
(classes, clearance, weights) up to date only where they can have changed.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.cell_box import EMPTY_BOX, CellBox, box_of
from mapping.changed_regions import changed_regions
from mapping.distance_field import reach_cells, truncated_distance, update_distance
from mapping.grid import CLEAR, OBSTACLE, UNKNOWN, GridGeometry, Padding, classify
from mapping.path_planning import traversal_weights
from protocol.map_cells import dequantise, unpack_cells
from protocol.messages import MapDelta, MapSnapshot
from robot_agent.navigation_settings import PlanningMapSettings

# A lattice is common to all maps of one resolution; sizes that differ by less are the same.
_SAME_RESOLUTION = 1e-9
# A gap exactly as wide as the body counts as wide enough, however its width was rounded [m].
_ROUNDING = 1e-4
# What the body has found out about a cell.
_PASSED, _TIGHT = 1, 2


class PlanningMap:
    """What the robot knows of the team's map.

    Attributes:
        number: number of the map held; 0 is the empty map every mission begins with.
        geometry: where the cells lie in the map frame; grows, so keep places in metres, not cells.
        cells: (rows, cols) int8, log-odds in steps of 1/20.
        classes: (rows, cols) uint8, UNKNOWN, CLEAR or OBSTACLE.
        clear: (rows, cols) bool, where `classes` is CLEAR.
        clearance: (rows, cols) float32 [m], distance to the nearest obstacle cell, truncated.
        weights: (rows, cols) uint8, see `mapping.path_planning.traversal_weights`.
    """

    def __init__(self, body_radius: float, settings: PlanningMapSettings) -> None:
        """Start with the empty map.

        Args:
            body_radius: radius of the robot [m].
            settings: thresholds and distances.
        """
        self._body_radius = body_radius
        self._settings = settings
        steps = np.arange(256, dtype=np.uint8).view(np.int8)
        self._class_of_byte = classify(dequantise(steps), settings.p_obstacle, settings.p_clear)
        self.number = 0
        self._changes: list[CellBox] | None = None
        self._start_empty(GridGeometry(settings.resolution_m, 0.0, 0.0, 1, 1))

    @property
    def reach(self) -> int:
        """How many cells beyond a change of `classes` clearance and weights may change."""
        return reach_cells(self._settings.clearance_limit_m, self.geometry.resolution)

    def apply_snapshot(self, message: MapSnapshot) -> CellBox:
        """Take over a whole map; return the box of all its cells, empty for an old snapshot.

        Raises:
            ValueError: the bytes do not hold the cells that the message announces, or these are
                more than `largest_cells`.
        """
        if message.number <= self.number and self.number > 0:
            return EMPTY_BOX
        if message.rows * message.cols > self._settings.largest_cells:
            raise ValueError(f"a map of {message.rows} x {message.cols} cells is too large")
        cells = unpack_cells(message.cells, message.rows, message.cols)
        resolution = message.resolution_m
        # Deltas are placed by whole cells of the lattice through (0, 0): so is the snapshot.
        lattice_x = round(message.origin_x_m / resolution)
        lattice_y = round(message.origin_y_m / resolution)
        self._start_empty(
            GridGeometry(
                resolution,
                lattice_x * resolution,
                lattice_y * resolution,
                message.rows,
                message.cols,
            )
        )
        self.number = message.number
        self._write(self.geometry.box, cells)
        return self.geometry.box

    def apply_delta(self, message: MapDelta) -> CellBox | None:
        """Apply one change.

        Returns:
            The box that was written, in cells of the present `geometry`; the empty box for a
            change already held; None if changes before it are missing (or it is of another
            resolution): then ask the server for the whole map.

        Raises:
            ValueError: the bytes do not hold the cells that the message announces.
        """
        if message.number <= self.number:
            return EMPTY_BOX
        if message.number != self.number + 1:
            return None
        cells = unpack_cells(message.cells, message.rows, message.cols)
        if abs(message.resolution_m - self.geometry.resolution) > _SAME_RESOLUTION:
            if self.number > 0:
                return None
            self._start_empty(GridGeometry(message.resolution_m, 0.0, 0.0, 1, 1))
        box = self._room_for(message.lattice_x, message.lattice_y, message.rows, message.cols)
        if box is None:
            return None
        self._write(box, cells)
        self.number = message.number
        return box

    def take_changes(self) -> list[CellBox] | None:
        """Return boxes that hold every cell which changed since the last call; None: all may have.

        What follows from clearance may differ up to `reach` cells beyond them.
        """
        changes, self._changes = self._changes, []
        return changes

    def passed(self, x: float, y: float) -> None:
        """Note that the body stands at (x, y) [m]: it fits there, and need not fear it did not."""
        box = self._box_of_disc(x, y, self.geometry.resolution)
        if (self._tried[box.slices] != _PASSED).any():
            self._note(box, np.True_, _PASSED)

    def refused(self, place_map: tuple[float, float], radius: float) -> None:
        """Note that the body does not get through a place although the map leaves it enough room.

        Within `radius` [m] of the place (x, y) [m] it counts as `tight_m` wider from now on, except
        where it has stood: no robot shuts itself in. A place that the map comes to show wider opens
        again.
        """
        x, y = place_map
        box = self._box_of_disc(x, y, radius)
        rows, cols = np.ogrid[box.iy0 : box.iy1, box.ix0 : box.ix1]
        iy, ix = self.geometry.cell_at(x, y)
        near = (rows - iy) ** 2 + (cols - ix) ** 2 <= (radius / self.geometry.resolution) ** 2
        self._note(box, near & (self._tried[box.slices] != _PASSED), _TIGHT)

    def _box_of_disc(self, x: float, y: float, radius: float) -> CellBox:
        return self.geometry.box_around(x - radius, y - radius, x + radius, y + radius)

    def _note(self, box: CellBox, where: npt.NDArray[np.bool_] | np.bool_, tried: int) -> None:
        """Write down what was tried at the cells `where` of a box."""
        was_tight = self._tried[box.slices] == _TIGHT
        self._tried[box.slices][where] = tried
        if ((self._tried[box.slices] == _TIGHT) != was_tight).any():
            self._weigh(box)
            if self._changes is not None:
                self._changes.append(box)

    def holds(self, x: float, y: float) -> bool:
        """Whether the point (x, y) [m] in the map frame lies in the map."""
        return self.geometry.holds(*self.geometry.cell_at(x, y))

    @property
    def clearance_least(self) -> float:
        """The least clearance [m] at which the body fits onto a cell."""
        # Clearance is to the middle of an obstacle's cell, whose edge is half a cell nearer.
        return self._body_radius + 0.5 * self.geometry.resolution - _ROUNDING

    @property
    def body_cells(self) -> int:
        """How far from an obstacle it decides whether the body fits onto a cell [cells]."""
        return math.ceil(self.clearance_least / self.geometry.resolution)

    def clearance_at(self, x: float, y: float) -> float:
        """Return the distance [m] from (x, y) to the nearest obstacle cell, 0 off the map."""
        iy, ix = self.geometry.cell_at(x, y)
        return float(self.clearance[iy, ix]) if self.geometry.holds(iy, ix) else 0.0

    def _start_empty(self, geometry: GridGeometry) -> None:
        """Take over `geometry` with all cells unknown."""
        limit = self._settings.clearance_limit_m
        self.geometry = geometry
        self.cells = np.zeros(geometry.shape, dtype=np.int8)
        self.classes = np.full(geometry.shape, UNKNOWN, dtype=np.uint8)
        self.clear = np.zeros(geometry.shape, dtype=np.bool_)
        self._solid = np.zeros(geometry.shape, dtype=np.bool_)
        self.clearance = np.full(geometry.shape, limit, dtype=np.float32)
        self._tried = np.zeros(geometry.shape, dtype=np.uint8)
        self.weights = np.empty(geometry.shape, dtype=np.uint8)
        self._weigh(geometry.box)
        self._changes = None

    def _room_for(self, lattice_x: int, lattice_y: int, rows: int, cols: int) -> CellBox | None:
        """Grow to hold a rectangle of the lattice; return its box, None if absurdly far away."""
        resolution = self.geometry.resolution
        row, col = self.geometry.lattice
        iy, ix = lattice_y - row, lattice_x - col
        larger, padding = self.geometry.grown(
            self.geometry.origin_x + (ix + 0.5) * resolution,
            self.geometry.origin_y + (iy + 0.5) * resolution,
            self.geometry.origin_x + (ix + cols - 0.5) * resolution,
            self.geometry.origin_y + (iy + rows - 0.5) * resolution,
        )
        if larger.rows * larger.cols > self._settings.largest_cells:
            return None
        if not padding.none:
            self._grow(larger, padding)
        iy, ix = iy + padding.below, ix + padding.left
        return CellBox(iy, ix, iy + rows, ix + cols)

    def _grow(self, larger: GridGeometry, padding: Padding) -> None:
        """Pad all grids; new cells are unknown and as far from obstacles as we look."""
        limit = self._settings.clearance_limit_m
        self.geometry = larger
        self.cells = padding.pad(self.cells, 0)
        self.classes = padding.pad(self.classes, UNKNOWN)
        self.clear = self.classes == CLEAR
        self._solid = self.classes == OBSTACLE
        # Obstacles near the old edge reach over it into the new cells.
        self.clearance = truncated_distance(self._solid, larger.resolution, limit)
        self._tried = padding.pad(self._tried, 0)
        self.weights = np.empty(larger.shape, dtype=np.uint8)
        self._weigh(larger.box)
        self._changes = None

    def _write(self, box: CellBox, cells: npt.NDArray[np.int8]) -> None:
        """Write `cells` at `box` and bring classes, clearance and weights up to date."""
        changes = changed_regions(self.cells[box.slices], cells, box)
        for change in changes:
            self._write_region(change, cells[change.shifted(-box.iy0, -box.ix0).slices])
        if self._changes is not None:
            self._changes += changes

    def _write_region(self, box: CellBox, cells: npt.NDArray[np.int8]) -> None:
        """Write `cells` at `box`, which is no larger than need be."""
        self.cells[box.slices] = cells
        after = self._class_of_byte[cells.view(np.uint8)]
        clear, solid = after == CLEAR, after == OBSTACLE
        solid_changed = box_of(self._solid[box.slices] != solid).shifted(box.iy0, box.ix0)
        clear_changed = box_of(self.clear[box.slices] != clear).shifted(box.iy0, box.ix0)
        changed = solid_changed.union(clear_changed)
        if changed.empty:
            return
        self.classes[box.slices] = after
        self.clear[box.slices] = clear
        touched = changed
        if not solid_changed.empty:
            self._solid[box.slices] = solid
            touched = changed.union(
                update_distance(
                    self.clearance,
                    self._solid,
                    solid_changed,
                    self.geometry.resolution,
                    self._settings.clearance_limit_m,
                )
            )
        self._weigh(touched)

    def _weigh(self, box: CellBox) -> None:
        """Bring the traversal weights of a part of the grid up to date."""
        settings, tight = self._settings, self._tried[box.slices] == _TIGHT
        clearance = self.clearance[box.slices]
        if tight.any():
            clearance = clearance - np.float32(settings.tight_m) * tight
        self.weights[box.slices] = traversal_weights(
            self.clear[box.slices],
            clearance,
            self.clearance_least,
            settings.comfort_m,
            settings.squeeze_m,
        )
