"""The sparse system of a pose graph is that of all its edges, written out in full."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.constraints import linearise
from mapping.geometry import Floats
from mapping.normal_equations import HELD, NormalEquations

# Edges against the order of the nodes, two of one pair, and a node (3) that nothing connects.
ENDS = np.array([[0, 1], [1, 2], [2, 0], [4, 1], [1, 4]])
NODES = 5


def system_of(rng: np.random.Generator, robust: bool) -> NormalEquations:
    roots = rng.standard_normal((len(ENDS), 3, 3))
    return NormalEquations(
        NODES,
        ENDS,
        rng.standard_normal((len(ENDS), 3)),
        roots @ roots.transpose(0, 2, 1) + np.eye(3),
        np.full(len(ENDS), robust),
    )


def linearised(a: Floats, b: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
    error, by_i, by_j = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    linearise(a, b, z, error, by_i, by_j)
    return error, by_i, by_j


def in_full(system: NormalEquations, poses: Floats, power: int) -> tuple[Floats, Floats]:
    """Return matrix and gradient, dense."""
    matrix, gradient = 1e-9 * np.eye(3 * NODES), np.zeros(3 * NODES)
    for (i, j), z, information, robust in zip(
        ENDS, system._measured, system._information, system._robust, strict=True
    ):
        error, by_i, by_j = linearised(poses[i], poses[j], z)
        jacobian = np.zeros((3, 3 * NODES))
        jacobian[:, 3 * i : 3 * i + 3], jacobian[:, 3 * j : 3 * j + 3] = by_i, by_j
        size = np.sqrt(error @ information @ error)
        weight = min(1.0, (3.0 / size) ** power) if robust else 1.0
        matrix += weight * jacobian.T @ information @ jacobian
        gradient += weight * jacobian.T @ information @ error
    matrix[:3, :3] += HELD * np.eye(3)
    gradient[:3] = 0.0
    return matrix, gradient


def test_derivatives_are_those_of_the_error() -> None:
    rng = np.random.default_rng(3)
    a, b, z = rng.standard_normal((3, 3))
    error, by_i, by_j = linearised(a, b, z)
    for axis in range(3):
        shift = 1e-6 * np.eye(3)[axis]
        by_a = (linearised(a + shift, b, z)[0] - error) / 1e-6
        by_b = (linearised(a, b + shift, z)[0] - error) / 1e-6
        assert by_a == pytest.approx(by_i[:, axis], abs=1e-4)
        assert by_b == pytest.approx(by_j[:, axis], abs=1e-4)


@pytest.mark.parametrize(("robust", "power"), [(False, 1), (True, 1), (True, 2)])
def test_a_step_solves_the_whole_system(robust: bool, power: int) -> None:
    rng = np.random.default_rng(5)
    system = system_of(rng, robust)
    connected = [0, 1, 2, 4]
    for _ in range(2):  # filled in anew for other poses
        poses = rng.standard_normal((NODES, 3))
        system.fill(poses, 3.0, power)
        matrix, gradient = in_full(system, poses, power)
        step = -np.linalg.solve(matrix, gradient).reshape(-1, 3)
        assert system.step() == pytest.approx(step, abs=1e-6)
        inverse = np.linalg.inv(matrix)
        for node, found in zip(connected, system.covariances(connected), strict=True):
            block = inverse[3 * node : 3 * node + 3, 3 * node : 3 * node + 3]
            assert found == pytest.approx(block, abs=1e-6)
        both = np.ix_([12, 13, 14, 3, 4, 5], [12, 13, 14, 3, 4, 5])
        assert system.joint_covariance([4, 1]) == pytest.approx(inverse[both], abs=1e-6)


def test_a_node_without_edges_stays() -> None:
    rng = np.random.default_rng(7)
    system = system_of(rng, robust=False)
    system.fill(rng.standard_normal((NODES, 3)), 3.0, 1)
    assert system.step()[3] == pytest.approx(np.zeros(3))
