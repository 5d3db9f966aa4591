"""The grid that a sequence of map updates draws, and which of its cells each update changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from expedition.experiments.map_updates import MapUpdate
from expedition.experiments.vote_counts import CellValue, VoteCounts, Votes, votes_of
from mapping.cell_box import EMPTY_BOX, CellBox, box_of
from mapping.geometry import Pose2
from mapping.scan import LaserScan


@dataclass(frozen=True, slots=True)
class MapChange:
    """What one update changed.

    Attributes:
        cells: how many cells have another value than before it.
        boxed: how many cells the smallest box around them holds.
        beams: of its scan; 0 without one, or if it was discarded.
        earlier: of how many scans that came before, and were not discarded, it told new poses.
        discarded: whether it had a scan that changed no cell.
    """

    cells: int
    boxed: int
    beams: int
    earlier: int
    discarded: bool


@dataclass(frozen=True, slots=True)
class _Placed:
    """A scan, where it was put, and what it says of the cells there."""

    scan: LaserScan
    T_map_laser: Pose2
    votes: Votes


class DrawnMap:
    """The grid as all updates taken so far draw it.

    Args:
        resolution: edge of a cell [m].
        value: which number stands for a cell; it changes when this does.
    """

    def __init__(self, resolution: float, value: CellValue) -> None:
        self._resolution = resolution
        self._value: CellValue = value
        self._counts = VoteCounts(resolution)
        self._placed: list[_Placed | None] = []  # None: discarded

    def take(self, update: MapUpdate) -> MapChange:
        """Draw an update into the map; return what that changed.

        A scan that changes no cell, beyond those that the new poses of earlier ones change, is
        discarded completely: it leaves no trace in the map.

        Raises:
            IndexError: the update moves a scan that has not come yet.
        """
        told = {n: pose for n, pose in update.moved.items() if self._placed[n] is not None}
        moves = self._moves(told)
        new = None
        if update.scan is not None and update.T_map_laser is not None:
            new = self._place(update.scan, update.T_map_laser)
        box = new.votes.box if new else EMPTY_BOX
        for old, moved in moves.values():
            box = box.union(old.votes.box).union(moved.votes.box)
        before = self._values(box)
        self._move(moves)
        kept = new is not None and self._keeps(new)
        if new is not None:
            self._placed.append(new if kept else None)
        changed = before != self._values(box)
        around = box_of(changed)
        return MapChange(
            int(np.count_nonzero(changed)),
            (around.iy1 - around.iy0) * (around.ix1 - around.ix0),
            len(new.scan.ranges) if new is not None and kept else 0,
            len(told),
            new is not None and not kept,
        )

    def _place(self, scan: LaserScan, T_map_laser: Pose2) -> _Placed:
        return _Placed(scan, T_map_laser, votes_of(scan, T_map_laser, self._resolution))

    def _moves(self, told: Mapping[int, Pose2]) -> dict[int, tuple[_Placed, _Placed]]:
        """Return those scans that really move, as they lie and as they will, by their numbers."""
        moves = {}
        for number, pose in told.items():
            old = self._placed[number]
            if old is None or old.T_map_laser == pose:
                continue
            moves[number] = old, self._place(old.scan, pose)
        return moves

    def _move(self, moves: Mapping[int, tuple[_Placed, _Placed]]) -> None:
        for number, (old, moved) in moves.items():
            self._counts.remove(old.votes)
            self._counts.add(moved.votes)
            self._placed[number] = moved

    def _keeps(self, new: _Placed) -> bool:
        """Put a scan in if that changes a cell; return whether it does."""
        before = self._values(new.votes.box)
        self._counts.add(new.votes)
        if (before != self._values(new.votes.box)).any():
            return True
        self._counts.remove(new.votes)
        return False

    def _values(self, box: CellBox) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
        if box.empty:
            return np.zeros((0, 0), dtype=np.float32)
        return self._counts.values(box, self._value)
