"""A pose graph in the plane: poses, what is known of them by pairs, and the likeliest of all.

Nodes are poses in the map frame, edges are measured poses of one node in another. The graph's
optimum minimises the sum of squared errors, each weighed by its information. Edges that compare
what robots see may be wrong: far off, they pull with a bounded force at first, so that large loops
close from afar, and then, near the optimum, the less the farther off they still are.

Source: Grisetti, Kuemmerle, Stachniss & Burgard 2010, "A tutorial on graph-based SLAM"; the bounded
force is Huber's (1964).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2, pose_from
from mapping.normal_equations import HELD, NormalEquations

# A robust edge whose error exceeds this many standard deviations counts less. Comparisons with one
# submap share its errors, so their covariances are kept large, and a deviation is rare.
_ROBUST_FROM = 1.5
# The powers by which they count less, and how many steps are taken with each: first a bounded
# force, which draws large loops together, then less and less for those that stay apart.
_POWERS = ((1, 8), (2, 4), (4, 8))


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
        self._equations: NormalEquations | None = None

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
        self._equations = None
        if self._count == len(self._poses):
            self._poses = np.concatenate((self._poses, np.zeros_like(self._poses)))
        self._poses[self._count] = T_map_node.as_array()
        self._count += 1
        return self._count - 1

    def connect(self, edge: Edge) -> None:
        """Add an edge."""
        self._equations = None
        self.edges.append(edge)

    def error(self, edge: Edge) -> tuple[Floats, float]:
        """Return the error (3,) of an edge in the frame of its j, and its square by weight."""
        off = edge.T_i_j.inverse() @ (self.pose(edge.i).inverse() @ self.pose(edge.j))
        error = off.as_array()
        return error, float(error @ edge.information @ error)

    def optimise(self, tolerance: float = 1e-3) -> tuple[float, float]:
        """Move all nodes but the first to the graph's optimum (Gauss-Newton).

        The weights of edges that may be wrong fall off faster and faster, which is graduated
        non-convexity in three stages (Yang, Antonante, Tzoumas & Carlone 2020).

        Returns:
            The farthest any node was moved [m], and the most any was turned [rad].
        """
        if not self.edges:
            return 0.0, 0.0
        before = self.poses.copy()
        system = self._system()
        for power, steps in _POWERS:
            for _ in range(steps):
                system.fill(self.poses, _ROBUST_FROM, power)
                step = system.step()
                self.poses[:] += step
                if float(np.abs(step).max()) < tolerance:
                    break
        moved = self.poses - before
        self.poses[:, 2] = _wrapped(self.poses[:, 2])
        return float(np.hypot(moved[:, 0], moved[:, 1]).max()), float(np.abs(moved[:, 2]).max())

    def reject(self, above: float) -> int:
        """Take out the edges that may be wrong and whose squared error is larger.

        In the optimum they have no say any more; but who reads the graph elsewhere does not know.

        Returns:
            How many that were.
        """
        kept = [edge for edge in self.edges if not edge.robust or self.error(edge)[1] <= above]
        rejected = len(self.edges) - len(kept)
        if rejected:
            self.edges, self._equations = kept, None
        return rejected

    def covariances(self, nodes: list[int]) -> Floats:
        """Return the covariance (n, 3, 3) of each of `nodes` against the first node, map frame."""
        if not self.edges:
            return np.tile(np.eye(3) / HELD, (len(nodes), 1, 1))
        return self._filled().covariances(nodes)

    def joint_covariance(self, nodes: list[int]) -> Floats:
        """Return the joint covariance (3 n, 3 n) of `nodes` against the first node, map frame."""
        if not self.edges:
            return np.eye(3 * len(nodes)) / HELD
        return self._filled().joint_covariance(nodes)

    def _filled(self) -> NormalEquations:
        """Return the system of all edges, worked out at the poses as they are."""
        system = self._system()
        system.fill(self.poses, _ROBUST_FROM, _POWERS[-1][0])
        return system

    def _system(self) -> NormalEquations:
        """Return the system of all edges; it serves until a node or an edge is added."""
        if self._equations is None:
            self._equations = NormalEquations(
                self._count,
                np.array([(edge.i, edge.j) for edge in self.edges], dtype=np.int64),
                np.array([edge.T_i_j.as_tuple() for edge in self.edges]),
                np.array([edge.information for edge in self.edges]),
                np.array([edge.robust for edge in self.edges]),
            )
        return self._equations


@compiled
def turned_covariance(covariance: Floats, angle: float) -> Floats:
    """Return a covariance (3, 3) of (x, y, theta) in a frame turned by `angle` [rad].

    A matrix of information turns alike. From the map's frame into that of a robot with heading
    theta the angle is theta.
    """
    c, s = math.cos(angle), math.sin(angle)
    turn = np.zeros((3, 3))
    turn[0, 0], turn[0, 1], turn[1, 0], turn[1, 1], turn[2, 2] = c, s, -s, c, 1.0
    return _moved(covariance, turn)


@compiled
def carried_covariance(covariance: Floats, dx: float, dy: float) -> Floats:
    """Return the covariance (3, 3) of a pose that is rigidly (dx, dy) [m] away, same frame."""
    carry = np.eye(3)
    carry[0, 2], carry[1, 2] = -dy, dx
    return _moved(covariance, carry)


@compiled
def _moved(covariance: Floats, by: Floats) -> Floats:
    """Return `by` times the covariance times `by` transposed, all (3, 3)."""
    moved = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                for m in range(3):
                    moved[i, j] += by[i, k] * covariance[k, m] * by[j, m]
    return moved


def blurred_information(information: Floats, covariance: Floats) -> Floats:
    """Return the information (3, 3), maybe singular, when an error of `covariance` is added."""
    blurred = np.linalg.solve(np.eye(3) + information @ covariance, information)
    symmetric: Floats = 0.5 * (blurred + blurred.T)
    return symmetric


def positive_part(matrix: Floats) -> Floats:
    """Return the part of a matrix (3, 3) that is a covariance: symmetric, nothing below zero."""
    strengths, directions = np.linalg.eigh(0.5 * (matrix + matrix.T))
    positive: Floats = (directions * np.maximum(strengths, 0.0)) @ directions.T
    return positive


def _wrapped(angles: Floats) -> Floats:
    """Return angles wrapped to [-pi, pi]."""
    wrapped: Floats = np.arctan2(np.sin(angles), np.cos(angles))
    return wrapped
