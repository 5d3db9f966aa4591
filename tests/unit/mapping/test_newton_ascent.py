from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapping.newton_ascent import _newton_step, ascend, invert

NO_WALLS = np.full((2, 4, 4), -1, dtype=np.int32)
NO_SURFELS = np.zeros((1, 6))
LATTICE = (0.0, 0.0, 0.1)


@given(arrays(np.float64, (3, 3), elements=st.floats(-1.0, 1.0)), st.floats(1e-4, 1e4))
@settings(max_examples=60, deadline=None)
def test_the_inverse_is_the_inverse_whatever_the_units(root, unit):
    scale = np.diag([1.0, 1.0, unit])
    matrix = scale @ (root @ root.T + 0.1 * np.eye(3)) @ scale
    inverse = np.empty((3, 3))
    invert(matrix, inverse)
    assert np.allclose(scale @ inverse @ matrix @ np.linalg.inv(scale), np.eye(3), atol=1e-8)
    assert np.array_equal(inverse, inverse.T)


@given(
    arrays(np.float64, (3, 3), elements=st.floats(-1.0, 1.0)),
    arrays(np.float64, 3, elements=st.floats(-1.0, 1.0)),
)
@settings(max_examples=60, deadline=None)
def test_a_step_solves_the_newton_equations_or_is_refused(root, gradient):
    hessian = 0.3 * np.eye(3) - root @ root.T
    step = np.empty(3)
    for damping in (0.0, 0.5):
        lifted = damping * np.diag(np.abs(np.diag(hessian))) - hessian
        lowest = np.linalg.eigvalsh(lifted)[0]
        if abs(lowest) < 1e-6:
            continue
        assert _newton_step(gradient, hessian, damping, step) == (lowest > 0.0)
        if lowest > 0.0:
            assert np.allclose(lifted @ step, gradient, atol=1e-6)


def climb_from(pose, information, surfels=NO_SURFELS, closest=NO_WALLS, points=None, iterations=30):
    points = np.zeros((0, 4)) if points is None else points
    return ascend(
        points, pose, closest, surfels, LATTICE, 0.05, 0.05, 1.0, (1.0, 2.0, 3.0), information,
        iterations, 1e-6, 3.0,
    )  # fmt: skip


def test_without_end_points_the_prior_is_the_summit():
    pose = np.array([1.2, 1.7, 2.9])
    information = np.diag([4.0, 9.0, 100.0])
    converged, iterations, value = climb_from(pose, information)
    assert converged and iterations < 8
    assert np.allclose(pose, [1.0, 2.0, 3.0])
    assert value == pytest.approx(0.0, abs=1e-12)


def test_headings_are_compared_the_short_way_round():
    pose = np.array([1.0, 2.0, 3.0 - 2.0 * np.pi + 0.1])
    climb_from(pose, np.eye(3))
    assert pose[2] == pytest.approx(3.0 - 2.0 * np.pi)


def test_a_wall_within_reach_wins_over_a_vague_prior():
    closest = np.zeros((2, 40, 40), dtype=np.int32)
    surfels = np.array([[1.5, 0.0, 1.0, 0.0, 0.0, 1.0]])
    points = np.tile([0.4, 0.0, -1.0, 0.0], (50, 1))
    pose = np.array([1.0, 2.0, 0.0])
    converged, _, _ = ascend(
        points, pose, closest, surfels, LATTICE, 0.05, 0.05, 1.0, (1.0, 2.0, 0.0),
        np.diag([1.0, 1.0, 1e6]), 30, 1e-6, 3.0,
    )  # fmt: skip
    assert converged
    assert pose[0] == pytest.approx(1.1, abs=1e-3) and pose[1] == pytest.approx(2.0, abs=1e-6)


def test_too_few_iterations_are_told():
    pose = np.array([9.0, 9.0, 0.0])
    converged, iterations, _ = climb_from(pose, np.eye(3), iterations=2)
    assert not converged and iterations == 2


def test_an_impossible_hessian_ends_the_ascent():
    converged, _, _ = climb_from(np.array([2.0, 2.0, 3.0]), np.zeros((3, 3)))
    assert not converged
