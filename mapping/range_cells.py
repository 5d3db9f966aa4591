"""Ranges rounded to cells such that each comes back within an exact bound."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.scan import LaserScan

NO_RETURN, TO_IGNORE = -1, -2
"""Stand for the cells of beams without a return, and of beams to ignore."""

CELLS_MOST = 1 << 16

_PARTS = 10_000  # of a metre: the bound is a whole number of 0.1 mm
_BOUND_MOST = 1.0
_REACH_MOST = 4000.0
# A float32 is rounded by 2**-24 of itself; as much again for the sums on the way.
_ROUNDING = 2.0**-23

Cells = npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class RangeCells:
    """Cells of equal width that fill a laser's reach.

    Attributes:
        bound: no range comes back farther off than this, in 0.1 mm.
        reach: the laser's, in mm.

    Raises:
        ValueError: there are no such cells, or too many.
    """

    bound: int
    reach: int

    def __post_init__(self) -> None:
        if not 1 <= self.bound <= _BOUND_MOST * _PARTS:
            raise ValueError(f"an error bound of {self.bound / 10} mm is not 0.1 mm to 1 m")
        if not 1 <= self.reach <= _REACH_MOST * 1000:
            raise ValueError(f"a reach of {self.reach / 1000} m is not 1 mm to {_REACH_MOST:g} m")
        if self.width <= 0.0 or self.count > CELLS_MOST:
            raise ValueError(
                f"an error bound of {self.bound / 10} mm is too fine for {self.reach / 1000} m"
            )

    @property
    def bound_m(self) -> float:
        """The bound [m]."""
        return self.bound / _PARTS

    @property
    def range_max(self) -> float:
        """The reach [m]."""
        return self.reach / 1000.0

    @property
    def width(self) -> float:
        """Width of a cell [m]: twice the bound, less what float32 rounds off."""
        return 2.0 * (self.bound_m - self.range_max * _ROUNDING)

    @property
    def count(self) -> int:
        """How many cells there are."""
        return math.ceil(self.range_max / self.width)

    def cells_of(self, scan: LaserScan) -> Cells:
        """Return the cells of a scan's ranges, (beams,) int32; its reach is at most this one's."""
        ranges = scan.ranges
        cells = np.full(len(ranges), TO_IGNORE, dtype=np.int32)
        cells[ranges >= scan.range_max] = NO_RETURN
        hits = scan.hits
        found = (ranges[hits].astype(np.float64) / self.width).astype(np.int32)
        cells[hits] = np.minimum(found, self.count - 1)
        return cells

    def ranges_of(self, cells: Cells) -> npt.NDArray[np.float32]:
        """Return the ranges in the middle of cells, (beams,) float32 [m].

        No return reads the reach, or the float32 next above it; to be ignored reads 0.
        """
        reach = np.float32(self.range_max)
        middles = ((cells.astype(np.float64) + 0.5) * self.width).astype(np.float32)
        ranges = np.minimum(middles, np.nextafter(reach, np.float32(0.0)))
        if float(reach) < self.range_max:
            reach = np.nextafter(reach, np.float32(np.inf))
        ranges[cells == NO_RETURN] = reach
        ranges[cells == TO_IGNORE] = 0.0
        return ranges


def cells_for(scan: LaserScan, bound_m: float) -> RangeCells:
    """Return the cells for a scan, at most as coarse as `bound_m` allows.

    A reach that is no whole number of millimetres is rounded up: no return becomes a reading.

    Raises:
        ValueError: there are no such cells.
    """
    if not (math.isfinite(scan.range_max) and math.isfinite(bound_m)):
        raise ValueError("the laser's reach and the error bound must be finite")
    # What is left of a thousandth after multiplying is rounding.
    return RangeCells(
        math.floor(bound_m * _PARTS + 1e-6), math.ceil(scan.range_max * 1000.0 - 1e-6)
    )
