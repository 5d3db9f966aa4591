"""The planning map in blocks of cells: what bids are worked out on, kept up to date with the map.

Whole maps are large and change in small places: after each change only the blocks there are made
anew.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.coarse_gain import CoarseClasses, coarsen_classes, refresh_classes
from mapping.coarse_weights import coarsen_weights, refresh_weights
from mapping.information_gain import entropy_weight, roomy_classes
from protocol.map_cells import dequantise
from robot_agent.planning_map import PlanningMap


class BlockMap:
    """Classes and weights of a planning map in blocks.

    Attributes:
        gains: classes in blocks of `gain_factor` cells, see `roomy_classes`, and what the unknown
            cells in them count.
        weights: (rows, cols) uint8, traversal weights of blocks of `cost_factor` cells.
    """

    def __init__(
        self,
        planning_map: PlanningMap,
        gain_factor: int,
        cost_factor: int,
        by_probability: bool,
    ) -> None:
        """Make the blocks of a map.

        Args:
            planning_map: the map to follow.
            gain_factor: cells along an edge of the blocks of `gains`.
            cost_factor: the same of `weights`.
            by_probability: whether an unknown cell counts by its entropy; else each counts 1.
        """
        self._map = planning_map
        self._gain_factor, self._cost_factor = gain_factor, cost_factor
        steps = np.arange(256, dtype=np.uint8).view(np.int8)
        self._weight_of_byte = entropy_weight(dequantise(steps)) if by_probability else None
        self._changed: list[CellBox] = []
        self._make()

    def changed(self, boxes: Iterable[CellBox]) -> None:
        """Note that cells of the map changed in `boxes`."""
        self._changed += boxes

    def refresh(self) -> None:
        """Bring the blocks up to date with all changes noted."""
        geometry = self._map.geometry
        if self._made_of is not self._map.classes:  # the map has grown or was replaced
            self._make()
        for box in joined(self._changed):
            if self._weight_of_byte is not None:
                self.gains.fine_weight[box.slices] = self._counts(box)
            around = box.dilated(self._map.body_cells, geometry.shape)
            self.gains.fine[around.slices] = self._roomy(around)
            refresh_classes(self.gains, around)
            around = box.dilated(self._map.reach, geometry.shape)
            refresh_weights(self.weights, self._map.weights, self._cost_factor, around)
        self._changed.clear()

    def _make(self) -> None:
        """Make all blocks anew."""
        self._changed.clear()
        self._made_of = self._map.classes
        whole = self._map.geometry.box
        counts = None if self._weight_of_byte is None else self._counts(whole)
        self.gains: CoarseClasses = coarsen_classes(self._roomy(whole), self._gain_factor, counts)
        self.weights = coarsen_weights(self._map.weights, self._cost_factor)

    def _roomy(self, box: CellBox) -> npt.NDArray[np.uint8]:
        """Return the classes of the cells of a box; floods do not pass where the body cannot."""
        return roomy_classes(
            np.ascontiguousarray(self._map.classes[box.slices]),
            np.ascontiguousarray(self._map.clearance[box.slices]),
            self._map.clearance_least,
        )

    def _counts(self, box: CellBox) -> npt.NDArray[np.float32]:
        """Return how much each cell of a box counts when it is unknown."""
        assert self._weight_of_byte is not None
        return self._weight_of_byte[self._map.cells[box.slices].view(np.uint8)]


def joined(boxes: Iterable[CellBox]) -> list[CellBox]:
    """Return boxes that hold the same cells; those that overlap are joined to one."""
    apart: list[CellBox] = []
    for box in boxes:
        while over := [other for other in apart if box.overlaps(other)]:
            apart = [other for other in apart if other not in over]
            for other in over:
                box = box.union(other)
        apart.append(box)
    return apart
