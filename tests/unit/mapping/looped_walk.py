"""A walk on a lattice that comes by its old places again and again: a pose graph with its truth."""

from __future__ import annotations

import numpy as np

from mapping.constraints import Constraints, Indices
from mapping.geometry import Floats, pose_from


def lattice(nodes: int, size: int = 6) -> Floats:
    """Return poses (N, 3) of a walk to and fro through a square of `size` streets, 1 m a step."""
    rng = np.random.default_rng(1)
    place, heading, poses = np.array([0, 0]), 0, []
    steps = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    for _ in range(nodes):
        poses.append((*place, heading * np.pi / 2))
        turns = [int(t) for t in rng.permutation([0, 0, 1, 3])] + [2]
        inside = [t for t in turns if np.all(np.abs(place + steps[(heading + t) % 4]) <= size // 2)]
        heading = (heading + inside[0]) % 4
        place = place + steps[heading]
    return np.array(poses, dtype=np.float64)


def measured_between(
    poses: Floats, ends: Indices, deviations: Floats, rng: np.random.Generator
) -> Constraints:
    """Return what is measured of some pairs of nodes with errors of these deviations (3,)."""
    measured = [
        (pose_from(poses[i]).inverse() @ pose_from(poses[j]) @ pose_from(error)).as_tuple()
        for (i, j), error in zip(ends, rng.normal(0.0, deviations, (len(ends), 3)), strict=True)
    ]
    # Of the frame of j, turned by what was measured: a matrix alike along x and y stays as it is.
    information = np.tile(np.diag(1.0 / np.maximum(deviations, 1e-3) ** 2), (len(ends), 1, 1))
    return Constraints(ends, np.array(measured), information)


def looped_walk(
    nodes: int = 80, deviation: float = 0.02, seed: int = 2
) -> tuple[Floats, Floats, Constraints]:
    """Return the true poses (N, 3), those by odometry, and the constraints: steps, then loops."""
    rng = np.random.default_rng(seed)
    truth = lattice(nodes)
    ends = [(k, k + 1) for k in range(nodes - 1)]
    for k in range(4, nodes):
        off = np.hypot(*(truth[: k - 3, :2] - truth[k, :2]).T)
        ends += [(int(near), k) for near in np.flatnonzero(off < 0.5)[:2]]
    constraints = measured_between(truth, np.array(ends), np.full(3, deviation), rng)
    pose, way = pose_from(truth[0]), [truth[0]]
    for step in constraints.measured[: nodes - 1]:
        pose = pose @ pose_from(step)
        way.append(pose.as_array())
    return truth, np.array(way), constraints
