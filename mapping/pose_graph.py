"""A pose graph in the plane: poses, what is known of them by pairs, and the likeliest of all.

Nodes are poses in the map frame, edges are measured poses of one node in another. The graph's
optimum minimises the sum of squared errors, each weighed by its information. Edges that compare
what robots see may be wrong: far off, they pull with a bounded force at first, so that large loops
close from afar, and then, near the optimum, the less the farther off they still are.

Source: Grisetti, Kuemmerle, Stachniss & Burgard 2010, "A tutorial on graph-based SLAM"; the bounded
force is Huber's (1964), the redescending one has the tail of Cauchy's weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu

from mapping.geometry import Floats, Pose2, pose_from

# A robust edge whose error exceeds this many standard deviations counts less.
_ROBUST_FROM = 3.0
# The last steps are taken with redescending weights.
_LAST_STEPS = 4
# How firmly the first node is held: it is the gauge of all others.
_HELD = 1e9


@dataclass(frozen=True, slots=True)
class Edge:
    """What is known of two nodes.

    Attributes:
        i: one node.
        j: the other.
        T_i_j: the measured pose of j in i.
        information: (3, 3) inverse covariance of its error, in the frame of j; may be singular.
        robust: whether it may be wrong.
    """

    i: int
    j: int
    T_i_j: Pose2
    information: Floats
    robust: bool = False


class PoseGraph:
    """Nodes and edges.

    Attributes:
        edges: all edges in the order they came.
    """

    def __init__(self) -> None:
        self.edges: list[Edge] = []
        self._poses: Floats = np.zeros((64, 3))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def poses(self) -> Floats:
        """The poses (x, y, theta) of all nodes, (N, 3), map frame."""
        return self._poses[: self._count]

    def pose(self, node: int) -> Pose2:
        """Return `T_map_base` of a node."""
        return pose_from(self._poses[node])

    def nearest(self, T_map_base: Pose2) -> int | None:
        """Return the node closest to a pose, or None of no nodes."""
        if not self._count:
            return None
        off = self.poses[:, :2] - (T_map_base.x, T_map_base.y)
        return int(np.hypot(off[:, 0], off[:, 1]).argmin())

    def add(self, T_map_node: Pose2) -> int:
        """Add a node; return its number."""
        if self._count == len(self._poses):
            self._poses = np.concatenate((self._poses, np.zeros_like(self._poses)))
        self._poses[self._count] = T_map_node.as_array()
        self._count += 1
        return self._count - 1

    def connect(self, edge: Edge) -> None:
        """Add an edge."""
        self.edges.append(edge)

    def error(self, edge: Edge) -> tuple[Floats, float]:
        """Return the error (3,) of an edge in the frame of its j, and its square by weight."""
        off = edge.T_i_j.inverse() @ (self.pose(edge.i).inverse() @ self.pose(edge.j))
        error = off.as_array()
        return error, float(error @ edge.information @ error)

    def optimise(self, iterations: int = 8, tolerance: float = 1e-3) -> tuple[float, float]:
        """Move all nodes but the first to the graph's optimum (Gauss-Newton).

        Returns:
            The farthest any node was moved [m], and the most any was turned [rad].
        """
        if not self.edges:
            return 0.0, 0.0
        before = self.poses.copy()
        table = _Table(self.edges)
        for power, steps in ((1, iterations), (2, _LAST_STEPS)):
            for _ in range(steps):
                factor, gradient = self._factor(table, power)
                step = -factor.solve(gradient).reshape(-1, 3)
                self.poses[:] += step
                if float(np.abs(step).max()) < tolerance:
                    break
        moved = self.poses - before
        self.poses[:, 2] = _wrapped(self.poses[:, 2])
        return float(np.hypot(moved[:, 0], moved[:, 1]).max()), float(np.abs(moved[:, 2]).max())

    def covariances(self, nodes: list[int]) -> Floats:
        """Return the covariance (n, 3, 3) of each of `nodes` against the first node, map frame."""
        if not self.edges or not nodes:
            return np.tile(np.eye(3) / _HELD, (len(nodes), 1, 1))
        factor, _ = self._factor(_Table(self.edges), 2)
        columns = np.zeros((3 * self._count, 3 * len(nodes)))
        for k, node in enumerate(nodes):
            columns[3 * node : 3 * node + 3, 3 * k : 3 * k + 3] = np.eye(3)
        solved = factor.solve(columns)
        return np.stack([solved[3 * n : 3 * n + 3, 3 * k : 3 * k + 3] for k, n in enumerate(nodes)])

    def _factor(self, table: _Table, power: int) -> tuple[SuperLU, Floats]:
        """Return the factored normal matrix at the poses as they are, and the gradient (3 N,).

        Args:
            table: all edges.
            power: 1 for bounded, 2 for redescending forces of robust edges.
        """
        errors, by_i, by_j = table.linearised(self.poses)
        weighed = table.weighed(errors, power)
        gradient = np.zeros((self._count, 3))
        rows, cols, values = [], [], []
        ends = ((table.i, by_i), (table.j, by_j))
        for first, jacobian in ends:
            pulled = np.einsum("eki,ekl->eil", jacobian, weighed)
            pull = np.einsum("eil,el->ei", pulled, errors)
            for axis in range(3):
                gradient[:, axis] += np.bincount(first, pull[:, axis], self._count)
            for second, other in ends:
                block = np.einsum("eil,elj->eij", pulled, other)
                row, col = np.broadcast_arrays(
                    3 * first[:, None, None] + np.arange(3)[None, :, None],
                    3 * second[:, None, None] + np.arange(3)[None, None, :],
                )
                rows.append(row.ravel())
                cols.append(col.ravel())
                values.append(block.ravel())
        size = 3 * self._count
        diagonal = np.arange(size)
        rows.append(diagonal)
        cols.append(diagonal)
        values.append(np.where(diagonal < 3, _HELD, 1e-9))
        gradient[0] = 0.0
        places = (np.concatenate(rows), np.concatenate(cols))
        matrix = csc_matrix((np.concatenate(values), places), shape=(size, size))
        return splu(matrix), gradient.ravel()


class _Table:
    """Edges as arrays."""

    def __init__(self, edges: list[Edge]) -> None:
        self.i: npt.NDArray[np.intp] = np.array([edge.i for edge in edges], dtype=np.intp)
        self.j: npt.NDArray[np.intp] = np.array([edge.j for edge in edges], dtype=np.intp)
        self.measured: Floats = np.array([edge.T_i_j.as_array() for edge in edges])
        self.information: Floats = np.array([edge.information for edge in edges])
        self.robust: npt.NDArray[np.bool_] = np.array([edge.robust for edge in edges])

    def linearised(self, poses: Floats) -> tuple[Floats, Floats, Floats]:
        """Return errors (E, 3) and their derivatives (E, 3, 3) by the poses of i and of j.

        Source: Grisetti et al. 2010, equations 30 to 32.
        """
        a, b, z = poses[self.i], poses[self.j], self.measured
        dx, dy = b[:, 0] - a[:, 0], b[:, 1] - a[:, 1]
        ca, sa = np.cos(a[:, 2]), np.sin(a[:, 2])
        cz, sz = np.cos(z[:, 2]), np.sin(z[:, 2])
        # The offset in the frame of i, and then, less what was measured, in that of j as measured.
        ox, oy = ca * dx + sa * dy - z[:, 0], -sa * dx + ca * dy - z[:, 1]
        errors = np.column_stack(
            (cz * ox + sz * oy, -sz * ox + cz * oy, _wrapped(b[:, 2] - a[:, 2] - z[:, 2]))
        )
        c, s = np.cos(a[:, 2] + z[:, 2]), np.sin(a[:, 2] + z[:, 2])
        by_j = np.zeros((len(z), 3, 3))
        by_j[:, 0, 0], by_j[:, 0, 1] = c, s
        by_j[:, 1, 0], by_j[:, 1, 1] = -s, c
        by_j[:, 2, 2] = 1.0
        by_i = -by_j
        turned_x, turned_y = -sa * dx + ca * dy, -ca * dx - sa * dy
        by_i[:, 0, 2] = cz * turned_x + sz * turned_y
        by_i[:, 1, 2] = -sz * turned_x + cz * turned_y
        return errors, by_i, by_j

    def weighed(self, errors: Floats, power: int) -> Floats:
        """Return the information (E, 3, 3), less where a robust edge is far off; see `_factor`."""
        squared = np.einsum("ei,eij,ej->e", errors, self.information, errors)
        size = np.sqrt(np.maximum(squared, 1e-12))
        weights = np.where(self.robust, np.minimum(1.0, (_ROBUST_FROM / size) ** power), 1.0)
        return self.information * weights[:, None, None]


def turned_covariance(covariance: Floats, angle: float) -> Floats:
    """Return a covariance (3, 3) of (x, y, theta) in a frame turned by `angle` [rad].

    A matrix of information turns alike. From the map's frame into that of a robot with heading
    theta the angle is theta.
    """
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    turned: Floats = turn @ covariance @ turn.T
    return turned


def carried_covariance(covariance: Floats, dx: float, dy: float) -> Floats:
    """Return the covariance (3, 3) of a pose that is rigidly (dx, dy) [m] away, same frame."""
    carry = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
    carried: Floats = carry @ covariance @ carry.T
    return carried


def blurred_information(information: Floats, covariance: Floats) -> Floats:
    """Return the information (3, 3), maybe singular, when an error of `covariance` is added."""
    blurred = np.linalg.solve(np.eye(3) + information @ covariance, information)
    symmetric: Floats = 0.5 * (blurred + blurred.T)
    return symmetric


def _wrapped(angles: Floats) -> Floats:
    """Return angles wrapped to [-pi, pi]."""
    wrapped: Floats = np.arctan2(np.sin(angles), np.cos(angles))
    return wrapped
