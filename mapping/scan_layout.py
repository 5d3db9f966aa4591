"""Which way the beams of a laser look: the part of a scan that is the same in all of them.

Bytes name a layout by its number in a table that writer and reader share; one that is not in the
table is written in full.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan

BEAMS_MOST = 4096
"""No scan has more beams."""

_FULL = struct.Struct("<Hddddd")
_SAME = 1e-9  # bearings that differ by less [rad] are one: 0.1 micrometre at 100 m


@dataclass(frozen=True, slots=True)
class SensorLayout:
    """How a laser's beams lie.

    Attributes:
        beams: number of beams, 1 .. `BEAMS_MOST`.
        bearing_start: bearing of the first one [rad], from laser +x.
        bearing_step: bearing from one to the next [rad], at most a full turn.
        T_base_laser: where the laser sits on the robot.

    Raises:
        ValueError: there is no such laser.
    """

    beams: int
    bearing_start: float
    bearing_step: float
    T_base_laser: Pose2 = IDENTITY

    def __post_init__(self) -> None:
        if not 1 <= self.beams <= BEAMS_MOST:
            raise ValueError(f"{self.beams} beams are not 1 to {BEAMS_MOST}")
        if not all(map(math.isfinite, (self.bearing_start, *self.T_base_laser.as_tuple()))):
            raise ValueError("a bearing or the laser's place is not finite")
        if not abs(self.bearing_step) <= 2.0 * math.pi:
            raise ValueError(f"beams {self.bearing_step} rad apart go around more than once each")

    def fits(self, other: SensorLayout) -> bool:
        """Return whether both are the same but for rounding."""
        return (
            self.beams == other.beams
            and self.T_base_laser == other.T_base_laser
            and abs(self.bearing_start - other.bearing_start) < _SAME
            and abs(self.bearing_step - other.bearing_step) * self.beams < _SAME
        )


def layout_of(scan: LaserScan) -> SensorLayout:
    """Return the layout of the laser that made a scan.

    Raises:
        ValueError: no laser makes such a scan.
    """
    return SensorLayout(len(scan.ranges), scan.bearing_start, scan.bearing_step, scan.T_base_laser)


def _degrees(beams: int, start: float, step: float) -> SensorLayout:
    return SensorLayout(beams, math.radians(start), math.radians(step))


KNOWN_LAYOUTS = (
    _degrees(180, -90.0, 1.0),
    _degrees(181, -90.0, 1.0),
    _degrees(360, -90.0, 0.5),
    _degrees(361, -90.0, 0.5),
    _degrees(721, -90.0, 0.25),
    _degrees(360, -180.0, 1.0),
    _degrees(720, -180.0, 0.5),
    _degrees(180, -90.0, 180.0 / 179.0),
    _degrees(360, -90.0, 180.0 / 359.0),
    _degrees(541, -135.0, 0.5),
    _degrees(1081, -135.0, 0.25),
)
"""Common lasers on the middle of a robot. The numbers are part of the format: only append."""

IN_FULL = 15
"""Stands where the number of a layout stands, when it is written in full."""


def number_of(layout: SensorLayout, table: tuple[SensorLayout, ...]) -> int:
    """Return the number of a layout in a table, `IN_FULL` if it is not there."""
    for number, known in enumerate(table):
        if known.fits(layout):
            return number
    return IN_FULL


def pack_layout(layout: SensorLayout) -> bytes:
    """Return a layout in full, as `unpack_layout` reads it."""
    mounting = layout.T_base_laser.as_tuple()
    return _FULL.pack(layout.beams, layout.bearing_start, layout.bearing_step, *mounting)


def unpack_layout(data: bytes, at: int) -> tuple[SensorLayout, int]:
    """Return the layout written in full at a place, and where it ends.

    Raises:
        ValueError: there is none.
    """
    if len(data) < at + _FULL.size:
        raise ValueError("the bytes end within the layout of the laser")
    beams, start, step, x, y, theta = _FULL.unpack_from(data, at)
    mounting = Pose2(x, y, theta)
    mounting = IDENTITY if mounting == IDENTITY else mounting
    return SensorLayout(beams, start, step, mounting), at + _FULL.size
