"""The constraints of a pose graph as arrays: which nodes, measured how, how well; and their errors.

Source: Grisetti, Kuemmerle, Stachniss & Burgard 2010, "A tutorial on graph-based SLAM".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats

Indices = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Constraints:
    """Measured poses of nodes in the frames of other nodes.

    Attributes:
        ends: (E, 2) the nodes i and j of each.
        measured: (E, 3) the pose (x, y, theta) of j in i, as measured.
        information: (E, 3, 3) inverse covariance of its error, in the frame of j; may be singular.
    """

    ends: Indices
    measured: Floats
    information: Floats

    def __len__(self) -> int:
        return len(self.ends)

    def only(self, chosen: Flags | Indices) -> Constraints:
        """Return some of them: those that are flagged, (E,) bool, or those at some places."""
        return Constraints(self.ends[chosen], self.measured[chosen], self.information[chosen])

    def squared_errors(self, poses: Floats) -> Floats:
        """Return the squared Mahalanobis error (E,) of each at some poses (N, 3), map frame."""
        squared = np.empty(len(self.ends))
        _squared_errors(poses, self.ends, self.measured, self.information, squared)
        return squared


@compiled
def linearise(a: Floats, b: Floats, z: Floats, error: Floats, by_i: Floats, by_j: Floats) -> None:
    """Work out the error (3,) of an edge and its derivatives (3, 3) by the poses of i and of j.

    The offset is taken in the frame of i, and then, less what was measured, in that of j as
    measured (Grisetti et al. 2010, equations 30 to 32).
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    ca, sa = math.cos(a[2]), math.sin(a[2])
    cz, sz = math.cos(z[2]), math.sin(z[2])
    along, across = ca * dx + sa * dy, -sa * dx + ca * dy
    error[0] = cz * (along - z[0]) + sz * (across - z[1])
    error[1] = -sz * (along - z[0]) + cz * (across - z[1])
    turn = b[2] - a[2] - z[2]
    error[2] = math.atan2(math.sin(turn), math.cos(turn))
    c, s = math.cos(a[2] + z[2]), math.sin(a[2] + z[2])
    by_j[0, 0], by_j[0, 1] = c, s
    by_j[1, 0], by_j[1, 1] = -s, c
    by_j[2, 2] = 1.0
    by_i[0, 0], by_i[0, 1] = -c, -s
    by_i[1, 0], by_i[1, 1] = s, -c
    by_i[0, 2] = cz * across - sz * along
    by_i[1, 2] = -sz * across - cz * along
    by_i[2, 2] = -1.0


@compiled
def squared_error(error: Floats, information: Floats) -> float:
    """Return the square of an error (3,), weighed by an information (3, 3)."""
    squared = 0.0
    for a in range(3):
        for b in range(3):
            squared += error[a] * information[a, b] * error[b]
    return squared


@compiled
def _squared_errors(
    poses: Floats, ends: Indices, measured: Floats, information: Floats, squared: Floats
) -> None:
    """Fill in the squared error of every edge."""
    error, by_i, by_j = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for e in range(len(ends)):
        linearise(poses[ends[e, 0]], poses[ends[e, 1]], measured[e], error, by_i, by_j)
        squared[e] = squared_error(error, information[e])
