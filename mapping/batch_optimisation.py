"""The likeliest poses of a whole pose graph, from a first guess, as far as it can be driven.

Gauss-Newton as long as each step lowers the sum of squared errors, which near the optimum it does
fast; where a step does not, it is damped until it does.

Source: Grisetti, Kuemmerle, Stachniss & Burgard 2010, "A tutorial on graph-based SLAM", algorithm
1; the damping is Marquardt's (1963).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from mapping.constraints import Constraints
from mapping.geometry import Floats
from mapping.normal_equations import HELD, LOOSE, NormalEquations

# Converged once a step lowers the sum of squares by no more than this share of it.
TOLERANCE = 1e-6
# Sums of squares below so little are rounding errors of a graph without any error.
_NOTHING = 1e-12
_MOST_STEPS = 100
# A step that fails is damped at least so much, then ten times more each time, up to the last.
_LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e8


@dataclass(frozen=True, slots=True)
class Optimum:
    """Where a graph came to rest.

    Attributes:
        poses: (N, 3) poses (x, y, theta) of all nodes, map frame; theta wrapped.
        chi2: sum of squared weighed errors there.
        iterations: linear systems solved.
    """

    poses: Floats
    chi2: float
    iterations: int


def optimise(
    poses: Floats,
    constraints: Constraints,
    held: Floats,
    tolerance: float = TOLERANCE,
    most_steps: int = _MOST_STEPS,
) -> Optimum:
    """Move the nodes of a graph to its optimum.

    Args:
        poses: (N, 3) a first guess of the poses (x, y, theta), map frame.
        constraints: between them; at least one.
        held: (N,) which nodes stay; see `held_nodes`.
        tolerance: least share of the sum of squares by which a step must lower it to go on.
        most_steps: after which it ends anyway.
    """
    system = system_of(len(poses), constraints, held)
    weights, free = np.ones(len(constraints)), (held < HELD)[:, None]
    here, chi2, damping, steps = poses, float(constraints.squared_errors(poses).sum()), 0.0, 0
    while steps < most_steps and damping <= _MOST_DAMPING:
        system.fill_weighed(here, weights, damping)
        there = here + system.step() * free
        reached = float(constraints.squared_errors(there).sum())
        steps += 1
        gain = chi2 - reached
        settled = abs(gain) <= tolerance * chi2 + _NOTHING and damping == 0.0
        if gain >= 0.0:
            here, chi2 = there, reached
            damping = 0.1 * damping if damping > _LEAST_DAMPING else 0.0
        else:
            damping = max(10.0 * damping, _LEAST_DAMPING)
        if settled:
            break
    wrapped = here.copy()
    wrapped[:, 2] = np.arctan2(np.sin(here[:, 2]), np.cos(here[:, 2]))
    return Optimum(np.where(free, wrapped, poses), chi2, steps)


def covariances(
    poses: Floats, constraints: Constraints, held: Floats, nodes: Sequence[int]
) -> Floats:
    """Return the covariance (n, 3, 3) of some nodes against those that are held, map frame.

    Args:
        poses: (N, 3) the poses (x, y, theta) of all nodes at the optimum, map frame.
        constraints: between them; at least one.
        held: (N,) which nodes stay; see `held_nodes`.
        nodes: those asked for.
    """
    system = system_of(len(poses), constraints, held)
    system.fill_weighed(poses, np.ones(len(constraints)))
    return system.covariances(nodes)


def system_of(nodes: int, constraints: Constraints, held: Floats) -> NormalEquations:
    """Return the linear system of some constraints between so many nodes; `held` as above."""
    plain = np.zeros(len(constraints), dtype=bool)
    return NormalEquations(
        nodes, constraints.ends, constraints.measured, constraints.information, plain, held
    )


def held_nodes(nodes: int, constraints: Constraints, fixed: Sequence[int]) -> Floats:
    """Return how firmly each node (N,) is held so that the optimum is one.

    Those that are fixed stay, and where a connected part of the graph has none of them, its first
    node does. All others are held so little that it only counts where nothing is known of them.
    """
    scale = max(1.0, float(np.abs(constraints.information).max(initial=0.0)))
    ones = np.ones(len(constraints))
    links = coo_matrix((ones, (constraints.ends[:, 0], constraints.ends[:, 1])), (nodes, nodes))
    parts, part_of = connected_components(links, directed=False)
    gauges = np.zeros(nodes, dtype=bool)
    gauges[list(fixed)] = True
    without = np.setdiff1d(np.arange(parts), part_of[gauges])
    gauges[np.unique(part_of, return_index=True)[1][without]] = True
    return np.where(gauges, scale * HELD, scale * LOOSE)
