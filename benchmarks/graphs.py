"""Rows of `benchmarks.kernels` for pose graphs."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import splu

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.floors import Case
from mapping.geometry import Floats
from mapping.normal_equations import NormalEquations

NODES = 2000


def walk() -> tuple[NormalEquations, Floats]:
    """Return the system of a walk on a lattice that closes many loops, and its poses (N, 3)."""
    rng = np.random.default_rng(1)
    steps = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
    turns = np.cumsum(rng.integers(-1, 2, NODES)) % 4
    places = np.cumsum(steps[turns], axis=0)
    poses = np.column_stack((places, turns * np.pi / 2))
    ends = [(k, k + 1) for k in range(NODES - 1)]
    for k in range(2, NODES, 3):
        near = np.flatnonzero(np.abs(places[: k - 1] - places[k]).sum(axis=1) <= 1.0)
        ends += [(int(near[0]), k)] if len(near) else []
    table = np.array(ends)
    a, b = poses[table[:, 0]], poses[table[:, 1]]
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    dx, dy = (b - a)[:, 0], (b - a)[:, 1]
    measured = np.column_stack((c * dx + s * dy, c * dy - s * dx, b[:, 2] - a[:, 2]))
    measured += rng.normal(scale=0.02, size=measured.shape)
    information = np.tile(np.diag([2500.0, 2500.0, 10_000.0]), (len(table), 1, 1))
    return NormalEquations(NODES, table, measured, information, np.zeros(len(table), bool)), poses


def step_case() -> Case:
    """One Gauss-Newton step: numbers filled in, factored, solved."""
    system, poses = walk()

    def run() -> None:
        system.fill(poses, 3.0, 1)
        system.step()

    return Case("pose graph step", f"{NODES} poses, QDLDL", 1, "steps", run)


def splu_case() -> Case:
    """What scipy's factorisation of the same matrix takes, for comparison."""
    system, poses = walk()
    system.fill(poses, 3.0, 1)
    upper = system.matrix
    whole = (upper + upper.T).tolil()
    whole.setdiag(upper.diagonal())
    run = partial(splu, whole.tocsc())
    return Case("pose graph step", f"{NODES} poses, scipy splu alone", 1, "steps", run)


def covariances_case() -> Case:
    """How well fifty poses are known."""
    system, poses = walk()
    system.fill(poses, 3.0, 1)
    nodes = list(range(0, NODES, NODES // 50))
    run = partial(system.covariances, nodes)
    return Case("covariances", f"50 of {NODES} poses", 50, "poses", run)


CASES: list[Callable[[], Case]] = [step_case, splu_case, covariances_case]
