"""A map as a snapshot and numbered changes, for whoever follows it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from mapping.cell_box import CellBox
from mapping.grid import GridGeometry
from protocol.map_cells import pack_cells
from protocol.messages import MapDelta, MapSnapshot

_EPSILON = 1e-9


class MapSource(Protocol):
    """A map that knows what has changed in it."""

    @property
    def geometry(self) -> GridGeometry:
        """Where the map lies, map frame."""
        ...

    @property
    def log_odds(self) -> npt.NDArray[np.float32]:
        """The map, (rows, cols) float32."""
        ...

    def take_changes(self) -> tuple[CellBox, npt.NDArray[np.float32]]:
        """Return the box that changed since the last call, and its log-odds.

        The box counts on the lattice of cells through (0, 0); empty if nothing changed.
        """
        ...


class MapFeed:
    """Numbers the changes of a map and makes the messages that tell them.

    Args:
        source: the map.
        period: changes are told at most once in this time [s].

    Attributes:
        number: of the map as told last; 0 is the empty map every mission begins with.
        due: when the next change may be told [s].
    """

    def __init__(self, source: MapSource, period: float) -> None:
        self.number = 0
        self.due = 0.0
        self._source = source
        self._period = period

    def delta_due(self, now: float) -> MapDelta | None:
        """Return the rectangle of the map that changed, if it is time and there is one."""
        if now < self.due - _EPSILON:
            return None
        self.due = now + self._period
        return self.delta()

    def delta(self) -> MapDelta | None:
        """Return the rectangle of the map that changed since the last one, None if nothing did."""
        box, log_odds = self._source.take_changes()
        if box.empty:
            return None
        self.number += 1
        return MapDelta(
            number=self.number,
            resolution_m=self._source.geometry.resolution,
            lattice_x=box.ix0,
            lattice_y=box.iy0,
            rows=box.iy1 - box.iy0,
            cols=box.ix1 - box.ix0,
            cells=pack_cells(log_odds),
        )

    def turn_to(self, source: MapSource) -> MapSnapshot:
        """Tell another map from now on; return the whole of it, in place of the one before."""
        self._source = source
        source.take_changes()
        self.number += 1
        return self.snapshot()

    def snapshot(self) -> MapSnapshot:
        """Return the whole map as told so far and the changes since."""
        geometry = self._source.geometry
        return MapSnapshot(
            number=self.number,
            resolution_m=geometry.resolution,
            origin_x_m=geometry.origin_x,
            origin_y_m=geometry.origin_y,
            rows=geometry.rows,
            cols=geometry.cols,
            cells=pack_cells(self._source.log_odds),
        )
