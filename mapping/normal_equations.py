"""The linear system of one Gauss-Newton step on a pose graph, sparse.

Which entries it has depends on which nodes the edges connect, and on nothing else: the order of
elimination is found once, and every step only fills in new numbers. The matrix is made of 3 x 3
blocks, one for each node and one for each connected pair; its upper half is kept by columns.

Source: Grisetti, Kuemmerle, Stachniss & Burgard 2010, "A tutorial on graph-based SLAM"; the factors
are those of QDLDL (Stellato et al. 2020) after an approximate minimum degree ordering.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import qdldl
from scipy.sparse import csc_matrix

from mapping.compiled import compiled
from mapping.constraints import Flags, Indices, linearise, squared_error
from mapping.geometry import Floats

# How firmly the first node is held: it is the gauge of all others.
HELD = 1e9
# So little holds every node, so that one without edges does not make the system singular.
LOOSE = 1e-9


def only_first_held(nodes: int) -> Floats:
    """Return how firmly each node (N,) is held when the first is the gauge of all others."""
    held = np.full(nodes, LOOSE)
    held[0] = HELD
    return held


class NormalEquations:
    """The system of a graph whose edges stay as they are, for poses that change.

    Attributes:
        errors: (E, 3) of all edges at the poses last given, each in the frame of its j.
        matrix: (3 N, 3 N), the upper half, sparse by columns.
    """

    def __init__(
        self,
        nodes: int,
        ends: Indices,
        measured: Floats,
        information: Floats,
        robust: Flags,
        held: Floats | None = None,
    ) -> None:
        """Find out which entries the system has.

        Args:
            nodes: number of nodes N, at least one.
            ends: (E, 2) the nodes i and j of each edge.
            measured: (E, 3) poses (x, y, theta) of j in i, as measured.
            information: (E, 3, 3) of their errors, in the frame of j.
            robust: (E,) which edges may be wrong.
            held: (N,) how firmly each node is held where it is, at least `HELD` for those that
                shall not move; by default the first node alone.
        """
        self._ends, self._measured = ends, measured
        self._information, self._robust = information, robust
        self._whole: Floats = np.ones(len(ends))
        self._held: Floats = only_first_held(nodes) if held is None else held
        self.errors: Floats = np.zeros((len(ends), 3))
        self._gradient: Floats = np.zeros((nodes, 3))
        low, high = ends.min(axis=1), ends.max(axis=1)
        # Pairs by column (the later node) and within it by row; edges of one pair share a block.
        pairs, self._pair_of = np.unique(high * nodes + low, return_inverse=True)
        rows, cols = pairs % nodes, pairs // nodes
        above = np.bincount(cols, minlength=nodes)
        self._starts = np.concatenate(([0], np.cumsum(9 * above + 6)))
        self._above = above
        self._ranks = np.arange(len(pairs)) - (np.cumsum(above) - above)[cols]
        size = self._starts[-1]
        indptr = (self._starts[:-1, None] + 3 * above[:, None] * [0, 1, 2] + [0, 1, 3]).ravel()
        indices = np.empty(size, dtype=np.int32)
        _place_rows(rows, cols, self._starts, above, self._ranks, indices)
        shape = (3 * nodes, 3 * nodes)
        self.matrix = csc_matrix((np.ones(size), indices, np.append(indptr, size)), shape=shape)
        self._solver: qdldl.Solver | None = None

    def fill(self, poses: Floats, from_sigmas: float, power: int) -> None:
        """Work the system out at some poses.

        Args:
            poses: (N, 3) poses (x, y, theta) of the nodes, map frame.
            from_sigmas: a robust edge whose error exceeds so many standard deviations counts less,
            power: by the ratio of the two to this power.
        """
        self._fill(poses, self._whole, (from_sigmas, power), 0.0)

    def fill_weighed(self, poses: Floats, weights: Floats, damping: float = 0.0) -> None:
        """Work the system out at some poses, with given weights.

        Args:
            poses: (N, 3) poses (x, y, theta) of the nodes, map frame.
            weights: (E,) by which the information of each edge is multiplied, from zero on; those
                of edges that may be wrong besides what their errors make of them.
            damping: share of itself that is added to each entry of the diagonal (Marquardt 1963).
        """
        self._fill(poses, weights, (math.inf, 1), damping)

    def _fill(
        self, poses: Floats, weights: Floats, robustness: tuple[float, int], damping: float
    ) -> None:
        """Fill in all numbers, and factor the matrix."""
        _fill(
            poses, self._ends, self._measured, self._information, self._robust, self._pair_of,
            self._starts, self._above, self._ranks, self._held, weights, robustness,
            self.errors, self._gradient, self.matrix.data,
        )  # fmt: skip
        if damping > 0.0:
            self.matrix.data[self.matrix.indptr[1:] - 1] *= 1.0 + damping
        if self._solver is None:
            self._solver = qdldl.Solver(self.matrix, upper=True)
        else:
            self._solver.update(self.matrix, upper=True)

    def step(self) -> Floats:
        """Return what to add to the poses, (N, 3), to come to the optimum of what was filled in."""
        assert self._solver is not None, "fill the system in first"
        step: Floats = -self._solver.solve(self._gradient.ravel()).reshape(-1, 3)
        return step

    def covariances(self, nodes: Sequence[int]) -> Floats:
        """Return the diagonal blocks (n, 3, 3) of the inverse that belong to some nodes."""
        found = np.empty((len(nodes), 3, 3))
        for block, node in zip(found, nodes, strict=True):
            block[:] = self._columns(node)[:, 3 * node : 3 * node + 3]
        return found

    def joint_covariance(self, nodes: Sequence[int]) -> Floats:
        """Return the part (3 n, 3 n) of the inverse that belongs to some nodes together."""
        kept = (3 * np.array(nodes, dtype=np.int64)[:, None] + np.arange(3)).ravel()
        return np.concatenate(
            [np.zeros((0, len(kept))), *(self._columns(k)[:, kept] for k in nodes)]
        )

    def factors(self) -> tuple[csc_matrix, Floats, Indices]:
        """Return the factors L, D of what was filled in, and the order of its rows.

        With P the identity's rows in that order, (L + 1) D (L + 1)^T = P A P^T.

        Returns:
            L (3 N, 3 N), strictly below the diagonal, sparse by columns with rising rows;
            D (3 N,); the order (3 N,).
        """
        assert self._solver is not None, "fill the system in first"
        below, diagonal, order = self._solver.factors()
        below.sort_indices()
        return below, np.asarray(diagonal), np.asarray(order, dtype=np.int64)

    def _columns(self, node: int) -> Floats:
        """Return the three columns (3, 3 N) of the inverse that belong to a node."""
        assert self._solver is not None, "fill the system in first"
        unit = np.zeros(3 * len(self._gradient))
        columns = np.empty((3, len(unit)))
        for axis in range(3):
            unit[3 * node + axis] = 1.0
            columns[axis] = self._solver.solve(unit)
            unit[3 * node + axis] = 0.0
        return columns


@compiled
def _place_rows(
    rows: Indices,
    cols: Indices,
    starts: Indices,
    above: Indices,
    ranks: Indices,
    indices: npt.NDArray[np.int32],
) -> None:
    """Fill in the row of every entry, `indices`; see `_entry` for the order."""
    for p in range(len(rows)):
        for k in range(3):
            at = _entry(starts[cols[p]], above[cols[p]], k) + 3 * ranks[p]
            for r in range(3):
                indices[at + r] = 3 * rows[p] + r
    for node in range(len(above)):
        for k in range(3):
            at = _entry(starts[node], above[node], k) + 3 * above[node]
            for r in range(k + 1):
                indices[at + r] = 3 * node + r


@compiled
def _entry(start: int, above: int, k: int) -> int:
    """Return where column k of a node begins: each holds three entries for each block above.

    Below those come the entries of the node's own block, down to the diagonal: one, two, three.
    """
    return start + 3 * above * k + k * (k + 1) // 2


@compiled
def _fill(
    poses: Floats,
    ends: Indices,
    measured: Floats,
    information: Floats,
    robust: Flags,
    pair_of: Indices,
    starts: Indices,
    above: Indices,
    ranks: Indices,
    held: Floats,
    weights: Floats,
    robustness: tuple[float, int],
    errors: Floats,
    gradient: Floats,
    values: Floats,
) -> None:
    """Fill in errors, gradient and the matrix's values, summed over all edges."""
    values[:] = 0.0
    gradient[:] = 0.0
    for node in range(len(above)):
        for k in range(3):
            values[_entry(starts[node], above[node], k) + 3 * above[node] + k] = held[node]
    by_i, by_j = np.zeros((3, 3)), np.zeros((3, 3))
    weighed, pulled = np.empty((3, 3)), np.empty((3, 3))
    for e in range(len(ends)):
        i, j = ends[e, 0], ends[e, 1]
        linearise(poses[i], poses[j], measured[e], errors[e], by_i, by_j)
        weight = weights[e]
        if robust[e]:
            weight *= _weight(errors[e], information[e], robustness)
        for a in range(3):
            for b in range(3):
                weighed[a, b] = weight * information[e, a, b]
        for node, jacobian in ((i, by_i), (j, by_j)):
            _product(jacobian, weighed, pulled)
            for a in range(3):
                for b in range(3):
                    gradient[node, a] += pulled[a, b] * errors[e, b]
            for k in range(3):
                at = _entry(starts[node], above[node], k) + 3 * above[node]
                for r in range(k + 1):
                    values[at + r] += _dot(pulled, jacobian, r, k)
        # `pulled` is that of j now; the block above the diagonal has the earlier node in its rows.
        last = max(i, j)
        for k in range(3):
            at = _entry(starts[last], above[last], k) + 3 * ranks[pair_of[e]]
            for r in range(3):
                if i < j:
                    values[at + r] += _dot(pulled, by_i, k, r)
                else:
                    values[at + r] += _dot(pulled, by_i, r, k)
    for node in range(len(held)):
        if held[node] >= HELD:
            gradient[node] = 0.0


@compiled
def _weight(error: Floats, information: Floats, robustness: tuple[float, int]) -> float:
    """Return how much a robust edge counts, at most 1; see `NormalEquations.fill`."""
    squared = squared_error(error, information)
    weight: float = (robustness[0] / math.sqrt(max(squared, 1e-12))) ** robustness[1]
    return min(1.0, weight)


@compiled
def _product(jacobian: Floats, weighed: Floats, pulled: Floats) -> None:
    """Fill in the transposed `jacobian` times `weighed`, all (3, 3)."""
    for a in range(3):
        for b in range(3):
            pulled[a, b] = 0.0
            for c in range(3):
                pulled[a, b] += jacobian[c, a] * weighed[c, b]


@compiled
def _dot(pulled: Floats, jacobian: Floats, row: int, col: int) -> float:
    """Return one entry of a product of two (3, 3) matrices."""
    value = 0.0
    for c in range(3):
        value += pulled[row, c] * jacobian[c, col]
    return value
