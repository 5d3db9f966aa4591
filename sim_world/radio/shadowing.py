"""Log-normal fading as a fixed property of places: the same at all times, for whoever is there.

Fading by what stands around is constant over a stretch of about a metre indoors and independent
beyond (Gudmundson 1991). So the plane is cut into cells, and each pair of cells has a value of its
own, computed from their numbers: nothing is stored, and no order of asking matters.
"""

from __future__ import annotations

import math

Place = tuple[float, float]

_MASK = (1 << 64) - 1


def shadowing(seed: int, a: Place, b: Place, cell: float) -> float:
    """Return the fading between two places, normal with variance 1, the same both ways.

    Args:
        seed: of the mission's radio.
        a: (x, y) [m], world frame.
        b: likewise.
        cell: edge of a cell [m].
    """
    state = seed & _MASK
    for ix, iy in sorted((math.floor(x / cell), math.floor(y / cell)) for x, y in (a, b)):
        state = _mix(state ^ (ix & _MASK))
        state = _mix(state ^ (iy & _MASK))
    # Box & Muller 1958, from two uniform numbers of 53 bits; the first is never 0.
    u = ((state >> 11) + 1) * 2.0**-53
    v = (_mix(state) >> 11) * 2.0**-53
    return math.sqrt(-2.0 * math.log(u)) * math.cos(2.0 * math.pi * v)


def _mix(state: int) -> int:
    """Return 64 bits that look unrelated to those given.

    Source: Steele, Lea & Flood 2014, SplitMix64.
    """
    z = (state + 0x9E3779B97F4A7C15) & _MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    return z ^ (z >> 31)
