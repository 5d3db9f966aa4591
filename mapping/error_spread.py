"""How far off a constraint may be that a pose graph does not hold yet, for what the graph knows.

The covariance of the constraint's error, predicted from all constraints that are in the graph, is
J A^-1 J^T with A the graph's information and J the error's derivatives by its two poses. With A
factored, L D L^T, it is Y^T D^-1 Y with L Y = J^T. J is zero but for two nodes, so that of Y, too,
only those rows matter that are on the ways from these nodes to the root of the elimination tree.

Source: Davis 2006, "Direct methods for sparse linear systems", sections 3.2 and 4.1 (which rows);
Kaess & Dellaert 2009, "Covariance recovery from a square root information matrix" (what for).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.constraints import Constraints, Flags, Indices, linearise
from mapping.geometry import Floats
from mapping.normal_equations import NormalEquations


def predicted_spread(system: NormalEquations, poses: Floats, asked: Constraints) -> Floats:
    """Return the covariance (E, 3, 3) that a graph predicts for the errors of other constraints.

    It is that of the poses alone; what the measurement itself is off by comes on top.

    Args:
        system: that of the graph, filled in at `poses`.
        poses: (N, 3) poses (x, y, theta) of its nodes, map frame.
        asked: E constraints that the graph does not hold.
    """
    below, diagonal, order = system.factors()
    places = np.empty(len(order), dtype=np.int64)
    places[order] = np.arange(len(order))
    firsts = np.minimum(below.indptr[:-1], max(below.nnz - 1, 0))
    is_root = np.diff(below.indptr) == 0
    parents = np.full(len(order), -1, dtype=np.int64)
    parents[~is_root] = below.indices[firsts[~is_root]]
    spread = np.zeros((len(asked), 3, 3))
    _spread(
        below.indptr, below.indices, below.data, diagonal, places, parents, poses, asked.ends,
        asked.measured, spread,
    )  # fmt: skip
    return spread


@compiled
def _spread(
    starts: npt.NDArray[np.int32],
    rows: npt.NDArray[np.int32],
    values: Floats,
    diagonal: Floats,
    places: Indices,
    parents: Indices,
    poses: Floats,
    ends: Indices,
    measured: Floats,
    spread: Floats,
) -> None:
    """Fill in the covariance of every constraint."""
    size = len(diagonal)
    y, reached = np.zeros((size, 3)), np.zeros(size, dtype=np.bool_)
    error, by_i, by_j = np.empty(3), np.zeros((3, 3)), np.zeros((3, 3))
    for e in range(len(ends)):
        i, j = ends[e, 0], ends[e, 1]
        linearise(poses[i], poses[j], measured[e], error, by_i, by_j)
        first = min(
            _put(by_i, i, places, parents, y, reached), _put(by_j, j, places, parents, y, reached)
        )
        for k in range(first, size):
            if reached[k]:
                for at in range(starts[k], starts[k + 1]):
                    for a in range(3):
                        y[rows[at], a] -= values[at] * y[k, a]
                for a in range(3):
                    for b in range(3):
                        spread[e, a, b] += y[k, a] * y[k, b] / diagonal[k]
                y[k] = 0.0
                reached[k] = False


@compiled
def _put(
    jacobian: Floats, node: int, places: Indices, parents: Indices, y: Floats, reached: Flags
) -> int:
    """Put a node's derivatives into `y`, mark all rows that they reach; return the first."""
    first = len(y)
    for axis in range(3):
        k = places[3 * node + axis]
        first = min(first, k)
        for a in range(3):
            y[k, a] += jacobian[a, axis]
        while k >= 0 and not reached[k]:
            reached[k] = True
            k = parents[k]
    return first
