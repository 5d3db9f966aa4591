"""Grids that scans can be taken out of again: how many scans hit each cell, and how many passed it.

What one scan says of a cell does not depend on what others said of it. So a map whose scans have
moved is made right by taking those scans out where they were and putting them in where they are.
Cells lie on the lattice through (0, 0) that all maps of one resolution share.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from mapping.cell_box import EMPTY_BOX, CellBox, box_of
from mapping.geometry import Pose2
from mapping.grid import GridGeometry, OccupancyGrid, geometry_around
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings, integrate_scan, scan_extent

CellValue = Literal["share", "log_odds", "known"]
NEVER_SEEN = -1.0
# One scan's word on a cell as a single vote, for or against.
_VOTES = IntegrationSettings(hit=1.0, miss=-1.0, lowest=-1.0, highest=1.0)
_SPEECH = IntegrationSettings()
_CHUNK = 128


@dataclass(frozen=True, slots=True)
class Votes:
    """What one scan says of the cells it saw.

    Attributes:
        box: which cells of the lattice, counted from (0, 0); empty if it saw none.
        votes: (rows, cols) int8 of that box: 1 hit, -1 passed, 0 not seen.
    """

    box: CellBox
    votes: npt.NDArray[np.int8]


def votes_of(scan: LaserScan, T_map_laser: Pose2, resolution: float) -> Votes:
    """Return what a scan says of the cells around it.

    Args:
        scan: without a `T_base_laser` of its own.
        T_map_laser: where it was taken.
        resolution: edge of a cell [m].
    """
    extent = scan_extent(scan, T_map_laser, _VOTES.depth * resolution)
    grid = OccupancyGrid.unknown(geometry_around(*extent, resolution))
    integrate_scan(grid, scan, T_map_laser, _VOTES)
    box = box_of(grid.log_odds)
    row, col = _lattice_corner(grid.geometry)
    votes = grid.log_odds[box.slices].astype(np.int8)
    return Votes(EMPTY_BOX if box.empty else box.shifted(row, col), votes)


class VoteCounts:
    """How many scans hit each cell, and how many saw it; what the map is drawn from.

    Args:
        resolution: edge of a cell [m].
    """

    def __init__(self, resolution: float) -> None:
        self._geometry = GridGeometry(resolution, 0.0, 0.0, 1, 1)
        self._hits = np.zeros((1, 1), dtype=np.int32)
        self._seen = np.zeros((1, 1), dtype=np.int32)

    def add(self, votes: Votes) -> None:
        """Put a scan in."""
        self._count(votes, 1)

    def remove(self, votes: Votes) -> None:
        """Take a scan out that was put in with the same votes."""
        self._count(votes, -1)

    def values(self, box: CellBox, value: CellValue) -> npt.NDArray[np.float32]:
        """Return the values of the cells of a box of the lattice, (rows, cols) float32.

        Args:
            box: may reach beyond what was seen.
            value: which number stands for a cell.
                `share`: which part of the scans that saw it hit it; `NEVER_SEEN` before the first.
                `log_odds`: what as many hits and misses add up to, with the strengths and the
                clamps of `IntegrationSettings`; 0 before the first.
                `known`: 1 if at least half of them hit it, 0 if fewer; `NEVER_SEEN` before.
        """
        self._cover(box)
        own = self._own(box).slices
        hits, seen = self._hits[own].astype(np.float64), self._seen[own].astype(np.float64)
        if value == "log_odds":
            summed = _SPEECH.hit * hits + _SPEECH.miss * (seen - hits)
            return np.clip(summed, _SPEECH.lowest, _SPEECH.highest).astype(np.float32)
        share = np.where(seen > 0, hits / np.maximum(seen, 1.0), NEVER_SEEN)
        if value == "known":
            share = np.where(seen > 0, (share >= 0.5).astype(np.float64), NEVER_SEEN)
        return share.astype(np.float32)

    def _count(self, votes: Votes, sign: int) -> None:
        if votes.box.empty:
            return
        self._cover(votes.box)
        own = self._own(votes.box).slices
        self._hits[own] += sign * (votes.votes > 0)
        self._seen[own] += sign * (votes.votes != 0)

    def _cover(self, box: CellBox) -> None:
        """Grow until a box of the lattice lies inside."""
        edge = self._geometry.resolution
        geometry, padding = self._geometry.grown(
            (box.ix0 + 0.5) * edge,
            (box.iy0 + 0.5) * edge,
            (box.ix1 - 0.5) * edge,
            (box.iy1 - 0.5) * edge,
            _CHUNK,
        )
        if not padding.none:
            self._geometry = geometry
            self._hits, self._seen = padding.pad(self._hits, 0), padding.pad(self._seen, 0)

    def _own(self, box: CellBox) -> CellBox:
        """Return a box of the lattice in cells of the arrays."""
        row, col = _lattice_corner(self._geometry)
        return box.shifted(-row, -col)


def _lattice_corner(geometry: GridGeometry) -> tuple[int, int]:
    """Return which cell (iy, ix) of the lattice is a grid's cell (0, 0)."""
    return (
        round(geometry.origin_y / geometry.resolution),
        round(geometry.origin_x / geometry.resolution),
    )
