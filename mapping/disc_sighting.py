"""Discs of a known radius in a scan: that is how teammates look to each other's lasers.

A disc in front of the background is a run of neighbouring beams that ends on both sides with a step
outwards, as wide as the disc must look at its distance. Its bearing is the middle of the run; each
beam gives its distance, and they must agree.
"""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry import Floats
from mapping.scan import LaserScan

# The background must be this much farther away than the disc's edge [m].
_STEP = 0.15
# Fewer beams do not show a disc.
_BEAMS_LEAST = 5
# Beams this far out on the disc [in radii] are left out of its distance: they graze it.
_GRAZING = 0.8
# The distances that single beams give may scatter by so much [m]: range noise, and the error in
# the bearing.
_SCATTER = 0.06


def find_discs(scan: LaserScan, radius: float) -> Floats:
    """Return the centres (k, 2) [m] of discs of a radius [m] in a scan, base frame."""
    ranges = np.where(scan.ranges > 0.0, scan.ranges, scan.range_max).astype(np.float64)
    breaks = np.flatnonzero(np.abs(np.diff(ranges)) > _STEP) + 1
    centres = []
    for first, end in zip(breaks[:-1].tolist(), breaks[1:].tolist(), strict=True):
        if end - first < _BEAMS_LEAST or not scan.hits[first:end].all():
            continue
        if ranges[first - 1] < ranges[first] or ranges[end] < ranges[end - 1]:
            continue
        distance = _distance(ranges[first:end], scan.bearing_step, radius)
        if distance is not None:
            bearing = scan.bearing_start + scan.bearing_step * 0.5 * (first + end - 1)
            centres.append((distance * math.cos(bearing), distance * math.sin(bearing)))
    return scan.T_base_laser.apply(np.array(centres).reshape(-1, 2))


def _distance(ranges: Floats, step: float, radius: float) -> float | None:
    """Return how far away the centre of a disc is that a run of beams shows [m], or None."""
    count = len(ranges)
    off = step * (np.arange(count) - 0.5 * (count - 1))
    across = ranges * np.sin(off)
    inner = np.abs(across) <= _GRAZING * radius
    if inner.sum() < 3:
        return None
    along = ranges[inner] * np.cos(off[inner])
    distances = along + np.sqrt(radius**2 - across[inner] ** 2)
    distance = float(distances.mean())
    if distance <= radius or float(distances.std()) > _SCATTER:
        return None
    looks = 2.0 * math.asin(radius / distance) / abs(step)
    # The outermost beams may miss the disc's edge, or their step may be cut off.
    if not looks - 3.0 <= count <= looks + 1.5:
        return None
    return distance
