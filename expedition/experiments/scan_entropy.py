"""How many bytes a run's scans take as they are coded, and how many their noise alone takes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from expedition.experiments.experiment import Row
from mapping.scan import LaserScan
from mapping.scan_coding import ScanCodingSettings, encode_scan


def noise_bytes(returns: int, noise: float, cell: float) -> float:
    """Return what so many readings take whose walls are known: the entropy of the noise.

    Args:
        returns: how many beams of a scan met something.
        noise: one standard deviation of a reading [m].
        cell: width of what readings are rounded to [m]; small against the noise.
    """
    return returns * math.log2(math.sqrt(2.0 * math.pi * math.e) * noise / cell) / 8.0


def scan_bytes(
    observations: Sequence[Mapping[str, Any]],
    noise: float,
    coding: ScanCodingSettings | None = None,
) -> Row:
    """Return the means of a run's scans: `scan` as coded [bytes], `entropy` of the noise [bytes].

    Args:
        observations: as in `map_updates`.
        noise: of the laser, one standard deviation [m].
        coding: as the scans were told with; the default error bound by default.
    """
    coding = coding or ScanCodingSettings()
    coded, least = [], []
    for told in observations:
        ranges = np.asarray(told["ranges"], dtype=np.float32)
        reach = float(told["range_max"])
        scan = LaserScan(
            ranges,
            float(told["bearing_start"]),
            float(told["bearing_step"]),
            reach,
            float(told["t_s"]),
        )
        coded.append(len(encode_scan(scan, coding)))
        returns = int(((ranges > 0.0) & (ranges < reach)).sum())
        least.append(noise_bytes(returns, noise, 2.0 * coding.error_bound_m))
    if not coded:
        return {"scan": None, "entropy": None}
    return {"scan": float(np.mean(coded)), "entropy": float(np.mean(least))}
