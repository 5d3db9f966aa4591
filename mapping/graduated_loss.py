"""Which of some doubted constraints hold together: truncated least squares, step by step.

An error counts by its square up to a limit, and beyond it all errors count alike, so a constraint
that is far off pulls no more and is left out. As that has many local optima, the loss begins nearly
convex, and turns into the truncated one by degrees while the poses follow.

Source: Yang, Antonante, Tzoumas & Carlone 2020, "Graduated non-convexity for robust spatial
perception", equation 14 (weights) and remark 5 (where to begin, and how fast to go on).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.batch_optimisation import system_of
from mapping.constraints import Constraints, Flags
from mapping.geometry import Floats
from mapping.normal_equations import HELD

# By which the loss comes closer to the truncated one with each step.
_GROWTH = 1.4
_MOST_STEPS = 100
# A weight above counts as one; none but zero counts as zero, as early on all of them are small.
_DECIDED = 0.999
# Squared errors of less than this share of the limit are as good as none; their inverse is finite.
_TINY = 1e-15


@dataclass(frozen=True, slots=True)
class Selection:
    """Which constraints were found to hold together.

    Attributes:
        poses: (N, 3) poses (x, y, theta) of the nodes by those, map frame.
        kept: (E,) which constraints they are, the trusted ones among them.
        iterations: linear systems solved.
    """

    poses: Floats
    kept: Flags
    iterations: int


def select(
    poses: Floats, constraints: Constraints, trusted: Flags, limit: float, held: Floats
) -> Selection:
    """Find the constraints that hold together with those that are trusted.

    Args:
        poses: (N, 3) poses (x, y, theta) to begin with, map frame.
        constraints: all, E.
        trusted: (E,) those that always count in full.
        limit: the squared Mahalanobis error from which a doubted one counts no more.
        held: (N,) which nodes stay; see `batch_optimisation.held_nodes`.
    """
    system = system_of(len(poses), constraints, held)
    free = (held < HELD)[:, None]
    squared = constraints.squared_errors(poses)
    worst = float(squared[~trusted].max(initial=0.0))
    # The paper's control parameter mu; so small, the loss is convex for all errors.
    convexity = limit / max(2.0 * worst - limit, limit)
    steps = 0
    while steps < _MOST_STEPS:
        weights = np.where(trusted, 1.0, truncated_weights(squared, limit, convexity))
        system.fill_weighed(poses, weights)
        poses = poses + system.step() * free
        squared = constraints.squared_errors(poses)
        convexity *= _GROWTH
        steps += 1
        if np.all((weights == 0.0) | (weights > _DECIDED)):
            break
    return Selection(poses, weights > 0.5, steps)


def truncated_weights(squared: Floats, limit: float, convexity: float) -> Floats:
    """Return the weights (E,) in [0, 1] of squared errors (E,) (Yang et al. 2020, equation 14)."""
    shares = np.maximum(squared / limit, _TINY)
    between = np.sqrt(convexity * (convexity + 1.0) / shares)
    weights: Floats = np.clip(between - convexity, 0.0, 1.0)
    return weights
