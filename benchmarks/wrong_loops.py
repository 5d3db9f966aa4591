"""Loop closures that are wrong, to be added to a pose graph that has only right ones.

After Suenderhauf & Protzel 2012, "Switchable constraints for robust pose graph SLAM": random ones,
and groups of consecutive ones that agree with each other.
"""

from __future__ import annotations

import math

import numpy as np

from mapping.constraints import Constraints, Flags
from mapping.geometry import Floats, Pose2, fit_rigid, pose_from

# Closures claim that two places are nearly one ("near"), or any pose of one in the other ("far").
_NEAR_M, _NEAR_RAD, _FAR_M = 0.3, math.radians(10.0), 10.0
_LEAST_APART = 20


def with_wrong_loops(
    constraints: Constraints, way: Floats, share: float, kind: str, seed: int
) -> tuple[Constraints, Flags]:
    """Return a graph with wrong loop closures at its end, and which they are, (E,) bool.

    Args:
        constraints: of the right graph.
        way: (N, 3) poses of its nodes by odometry: groups of wrong closures agree with these.
        share: wrong closures by right ones.
        kind: "random" or "group" (5 to 10 consecutive ones), and "near" or "far".
        seed: of all randomness.
    """
    rng = np.random.default_rng(seed)
    right = np.flatnonzero(np.abs(np.diff(constraints.ends)[:, 0]) != 1)
    count = round(share * len(right))
    ends: list[tuple[int, int]] = []
    measured: list[tuple[float, float, float]] = []
    while len(ends) < count:
        size = int(rng.integers(5, 11)) if kind.startswith("group") else 1
        i, j = sorted(int(node) for node in rng.integers(0, len(way) - size, 2))
        if j - i < _LEAST_APART:
            continue
        T_i_j = _wrong_pose(rng, near=kind.endswith("near"))
        for k in range(min(size, count - len(ends))):
            T_i_ik, T_j_jk = _between(way, i, i + k), _between(way, j, j + k)
            ends.append((i + k, j + k))
            measured.append((T_i_ik.inverse() @ T_i_j @ T_j_jk).as_tuple())
    wrong = np.arange(len(constraints) + count) >= len(constraints)
    information = constraints.information[rng.choice(right, count)]
    return Constraints(
        np.concatenate((constraints.ends, np.array(ends, dtype=np.int64).reshape(-1, 2))),
        np.concatenate((constraints.measured, np.array(measured).reshape(-1, 3))),
        np.concatenate((constraints.information, information)),
    ), wrong


def trajectory_error(poses: Floats, reference: Floats) -> float:
    """Return the root mean square distance [m] of places after the best rigid transform."""
    T_reference_map = fit_rigid(reference[:, :2], poses[:, :2])
    off = T_reference_map.apply(poses[:, :2]) - reference[:, :2]
    return float(np.sqrt((off**2).sum(axis=1).mean()))


def relative_error(poses: Floats, reference: Floats, apart: int = 1) -> float:
    """Return the mean distance [m] by which nodes so far apart in number are off of each other."""
    pairs = zip(range(len(poses) - apart), range(apart, len(poses)), strict=True)
    off = [_between(poses, i, j).distance_to(_between(reference, i, j)) for i, j in pairs]
    return float(np.mean(off))


def _wrong_pose(rng: np.random.Generator, near: bool) -> Pose2:
    if near:
        return Pose2(*rng.normal(0.0, (_NEAR_M, _NEAR_M, _NEAR_RAD)))
    return Pose2(*rng.uniform(-1.0, 1.0, 3) * (_FAR_M, _FAR_M, math.pi))


def _between(poses: Floats, i: int, j: int) -> Pose2:
    """Return the pose of j in i."""
    return pose_from(poses[i]).inverse() @ pose_from(poses[j])
