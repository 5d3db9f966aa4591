"""A normal distribution with a slightly wide foot, as a table that is the same on every machine.

Whoever decodes must find the very numbers the encoder worked with. `exp` and `erf` differ in their
last bits from one library to the next; sums, products, quotients and square roots of float64 do not
(IEEE 754 rounds them in one way only, and the compiler may not reorder them: no fastmath, and no
fused multiply-add unless asked for). So all here is made of those four.
"""

from __future__ import annotations

import numpy as np

from mapping.compiled import compiled
from mapping.geometry import Floats

_PER_SIGMA = 128
_REACH = 12
_END = _PER_SIGMA * _REACH
# A share of the readings scatters wider: edges, glass, dark things.
_WIDE_SHARE = 0.01
_WIDE = 3


def small_exp(x: float) -> float:
    """Return exp(x) for |x| <= 1, by its series."""
    term = total = 1.0
    for n in range(1, 24):
        term = term * x / n
        total = total + term
    return total


def _bell(steps: int, per_sigma: int) -> list[float]:
    """Return exp(-x*x/2) at x = 0, 1, ... `steps` parts of 1 / `per_sigma`, without `exp`."""
    # exp(-(x + h)**2 / 2) = exp(-x*x/2) * exp(-x*h) * exp(-h*h/2), and so on for the second factor.
    square = 1.0 / (per_sigma * per_sigma)
    ratio, shrink = small_exp(-0.5 * square), small_exp(-square)
    values = [1.0]
    for _ in range(steps):
        values.append(values[-1] * ratio)
        ratio = ratio * shrink
    return values


def _cumulative() -> Floats:
    """Return the distribution's cumulated shares at all steps from -_REACH to _REACH sigma."""
    narrow, wide = _bell(_END, _PER_SIGMA), _bell(_END, _PER_SIGMA * _WIDE)
    density = [
        (1.0 - _WIDE_SHARE) * a + _WIDE_SHARE * b / _WIDE for a, b in zip(narrow, wide, strict=True)
    ]
    sums = [0.0]
    for j in range(2 * _END):
        sums.append(sums[-1] + density[abs(j - _END)] + density[abs(j + 1 - _END)])
    return np.array([value / sums[-1] for value in sums])


SHARES = _cumulative()
"""Share below each multiple of 1/128 sigma, from -12 to 12 sigma."""


@compiled
def share_below(x: float) -> float:
    """Return which share of the distribution lies below `x` [sigma]; never falls as x grows."""
    if not x > -_REACH:  # so written that no number at all has no place in the table either
        return 0.0
    if x >= _REACH:
        return 1.0
    at = (x + _REACH) * _PER_SIGMA
    j = min(int(at), 2 * _END - 1)
    return float(SHARES[j] + (at - j) * (SHARES[j + 1] - SHARES[j]))
