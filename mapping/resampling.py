"""Weights of particles, and when and how to draw them anew.

Source: Grisetti, Stachniss & Burgard 2007, "Improved techniques for grid mapping with
Rao-Blackwellized particle filters", section III-B.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.geometry import Floats


def normalized(log_weights: Floats) -> Floats:
    """Return the weights (N,) that belong to `log_weights` (N,), up to a constant; sum is 1."""
    weights = np.exp(log_weights - log_weights.max())
    shares: Floats = weights / weights.sum()
    return shares


def effective_sample_size(weights: Floats) -> float:
    """Return how many equally weighted particles tell as much as these: between 1 and N.

    Args:
        weights: (N,), sum 1.

    Source: Grisetti, Stachniss & Burgard 2007, section III-B, after Doucet et al. 2001.
    """
    return 1.0 / float(np.square(weights).sum())


def systematic_resample(weights: Floats, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """Draw N particles with one random number; return whom each new one is a copy of, (N,) int64.

    A particle of weight w gets floor(N w) or ceil(N w) copies, N w on average. Those that survive
    keep their places, their further copies take those of the others.

    Args:
        weights: (N,), sum 1.
        rng: source of the one number.

    Source: Kitagawa 1996, as in Thrun, Burgard & Fox 2005, Table 4.4.
    """
    count = len(weights)
    marks = (rng.random() + np.arange(count)) / count
    drawn = np.minimum(np.searchsorted(np.cumsum(weights), marks, side="right"), count - 1)
    copies = np.bincount(drawn, minlength=count)
    parents = np.arange(count)
    parents[copies == 0] = np.repeat(parents, np.maximum(copies - 1, 0))
    return parents
