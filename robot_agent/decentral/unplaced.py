"""Beams that hit teammates who do not know where they are: no beacon tells which they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.disc_sighting import find_discs
from mapping.scan import LaserScan

_MARGIN = 0.1  # [m]


def without_discs(scan: LaserScan, radii: Sequence[float]) -> LaserScan:
    """Return the scan with all beams ignored that end at discs of the size of a teammate.

    Args:
        scan: as measured.
        radii: sizes of teammates that may stand anywhere near [m].
    """
    masked = np.zeros(len(scan.ranges), dtype=bool)
    hits, points = np.flatnonzero(scan.hits), scan.points_base()
    for radius in radii:
        for x, y in find_discs(scan, radius):
            near = np.hypot(points[:, 0] - x, points[:, 1] - y) <= radius + _MARGIN
            masked[hits[near]] = True
    return scan.without(masked) if masked.any() else scan
