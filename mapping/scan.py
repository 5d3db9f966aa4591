"""One sweep of a laser range finder."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from mapping.geometry import IDENTITY, Floats, Pose2


@dataclass(frozen=True, slots=True)
class LaserScan:
    """Ranges of one sweep, in the laser's frame.

    Attributes:
        ranges: (beams,) float32 [m]. A range of `range_max` or more is a beam without a return; a
            range of 0 is a beam to ignore (masked: a teammate, a damaged reading).
        bearing_start: bearing of the first beam [rad], counter-clockwise from laser +x.
        bearing_step: bearing from one beam to the next [rad].
        range_max: the sensor's reach [m].
        stamp: when it was measured [s], mission time.
        T_base_laser: where the laser sits on the robot.
    """

    ranges: npt.NDArray[np.float32]
    bearing_start: float
    bearing_step: float
    range_max: float
    stamp: float
    T_base_laser: Pose2 = IDENTITY
    # What `scan_points` found, once it was asked: one scan is matched with many maps.
    found_points: list[Floats] = field(default_factory=list, init=False, repr=False, compare=False)

    @property
    def bearings(self) -> Floats:
        """Bearings of all beams, (beams,) [rad], counter-clockwise from laser +x; read-only."""
        return _rays(len(self.ranges), self.bearing_start, self.bearing_step)[0]

    @property
    def hits(self) -> npt.NDArray[np.bool_]:
        """Which beams returned from an obstacle, (beams,) bool."""
        returned: npt.NDArray[np.bool_] = (self.ranges > 0.0) & (self.ranges < self.range_max)
        return returned

    def points_base(self) -> Floats:
        """Return the end points (N, 2) [m] of the beams that hit, in the robot's base frame."""
        hits = self.hits
        ranges = self.ranges[hits].astype(np.float64)
        directions = _rays(len(self.ranges), self.bearing_start, self.bearing_step)[1]
        points_laser = ranges[:, np.newaxis] * directions[hits]
        return (
            points_laser if self.T_base_laser is IDENTITY else self.T_base_laser.apply(points_laser)
        )

    def within(self, reach: float) -> LaserScan:
        """Return the scan as a laser would have made it that sees no farther than `reach` [m]."""
        if reach >= self.range_max:
            return self
        return LaserScan(
            self.ranges,
            self.bearing_start,
            self.bearing_step,
            reach,
            self.stamp,
            self.T_base_laser,
        )

    def without(self, masked: npt.NDArray[np.bool_]) -> LaserScan:
        """Return the scan with the beams in `masked` (beams,) set to be ignored."""
        if not masked.any():
            return self
        ranges = self.ranges.copy()
        ranges[masked] = 0.0
        return LaserScan(
            ranges,
            self.bearing_start,
            self.bearing_step,
            self.range_max,
            self.stamp,
            self.T_base_laser,
        )

    def without_ends_in(
        self, discs: Iterable[tuple[float, float, float]], T_frame_base: Pose2 = IDENTITY
    ) -> LaserScan:
        """Return the scan with all beams ignored that end in a disc: at a teammate, say.

        Args:
            discs: centre x, y and radius of each [m].
            T_frame_base: where the scan was taken, in the frame of the discs.
        """
        hits = np.flatnonzero(self.hits)
        points = T_frame_base.apply(self.points_base())
        masked = np.zeros(len(self.ranges), dtype=bool)
        for x, y, radius in discs:
            masked[hits[np.hypot(points[:, 0] - x, points[:, 1] - y) <= radius]] = True
        return self.without(masked)


@lru_cache(maxsize=64)
def _rays(beams: int, start: float, step: float) -> tuple[Floats, Floats]:
    """Return the bearings (beams,) [rad] of a laser and their directions (beams, 2), read-only."""
    bearings = start + step * np.arange(beams, dtype=np.float64)
    directions = np.column_stack((np.cos(bearings), np.sin(bearings)))
    bearings.flags.writeable = directions.flags.writeable = False
    return bearings, directions
