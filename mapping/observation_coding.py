"""One observation as bytes: a coded scan and the victims seen with it.

Every member of a team draws what these bytes say, their author included: so all draw the same.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Floats
from mapping.scan import LaserScan
from mapping.scan_coding import DamagedScanError, ScanCodingSettings, decode_scan, encode_scan
from mapping.scan_layout import KNOWN_LAYOUTS, SensorLayout

_VICTIMS_MOST = 255
_STEPS_PER_METRE = 100.0


class ObservationError(ValueError):
    """Bytes that hold no observation."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """What a robot saw from one place.

    Attributes:
        scan: the sweep of its laser, stamp in mission seconds.
        victims_base: (k, 2) [m] where it saw victims, base frame.
    """

    scan: LaserScan
    victims_base: Floats


def encode_observation(observation: Observation, settings: ScanCodingSettings) -> bytes:
    """Return the bytes of an observation; victims beyond 255 are left out."""
    victims = observation.victims_base[:_VICTIMS_MOST]
    steps = np.rint(np.clip(victims * _STEPS_PER_METRE, -32767, 32767)).astype("<i2")
    head = struct.pack("<B", len(victims)) + steps.tobytes()
    return head + encode_scan(observation.scan, settings)


def decode_observation(
    data: bytes, layouts: tuple[SensorLayout, ...] = KNOWN_LAYOUTS
) -> Observation:
    """Return the observation that bytes hold.

    Args:
        data: from `encode_observation`, possibly damaged or forged on its way.
        layouts: as in the settings that they were coded with.

    Raises:
        ObservationError: they hold none.
    """
    if not data or len(data) < 1 + 4 * data[0]:
        raise ObservationError("an observation cut short")
    end = 1 + 4 * data[0]
    steps = np.frombuffer(data[1:end], dtype="<i2").reshape(-1, 2)
    try:
        scan = decode_scan(data[end:], layouts)
    except DamagedScanError as error:
        raise ObservationError(str(error)) from None
    return Observation(scan, steps / _STEPS_PER_METRE)
