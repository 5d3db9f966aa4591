"""Beams that hit teammates who do not know where they are: no beacon tells which they are."""

from __future__ import annotations

from collections.abc import Sequence

from mapping.disc_sighting import find_discs
from mapping.scan import LaserScan

_MARGIN = 0.1  # [m]


def without_discs(scan: LaserScan, radii: Sequence[float]) -> LaserScan:
    """Return the scan with all beams ignored that end at discs of the size of a teammate.

    Args:
        scan: as measured.
        radii: sizes of teammates that may stand anywhere near [m].
    """
    found = [(x, y, r + _MARGIN) for r in radii for x, y in find_discs(scan, r).tolist()]
    return scan.without_ends_in(found)
