"""A whole graph comes down to its optimum, from near and from far."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.batch_optimisation import covariances, held_nodes, optimise
from mapping.constraints import linearise
from mapping.normal_equations import HELD
from tests.unit.mapping.looped_walk import looped_walk


def test_without_errors_the_truth_is_found() -> None:
    truth, _, constraints = looped_walk(40, deviation=0.0)
    guess = truth + np.random.default_rng(1).normal(0.0, 0.1, truth.shape)
    guess[0] = truth[0]
    best = optimise(guess, constraints, held_nodes(len(truth), constraints, []))
    assert best.poses[:, :2] == pytest.approx(truth[:, :2], abs=1e-6)
    assert np.cos(best.poses[:, 2] - truth[:, 2]) == pytest.approx(1.0)
    assert best.chi2 < 1e-9
    assert np.all(np.abs(best.poses[:, 2]) <= np.pi)


def test_nothing_nearby_is_likelier() -> None:
    _, way, constraints = looped_walk(60)
    held = held_nodes(len(way), constraints, [])
    best = optimise(way, constraints, held, tolerance=1e-10)
    assert best.chi2 == pytest.approx(constraints.squared_errors(best.poses).sum())
    # As many squares as degrees of freedom: errors are as large as is stated.
    degrees = 3 * (len(constraints) - len(way) + 1)
    assert 0.7 * degrees < best.chi2 < 1.3 * degrees
    rng = np.random.default_rng(2)
    for _ in range(20):
        moved = best.poses + rng.normal(0.0, 1e-3, way.shape)
        assert constraints.squared_errors(moved).sum() > best.chi2
    again = optimise(best.poses, constraints, held)
    assert (again.iterations, again.chi2) == (1, pytest.approx(best.chi2))


@settings(max_examples=10)
@given(st.integers(0, 1000), st.floats(0.1, 3.0))
def test_from_anywhere_it_only_goes_down(seed: int, scatter: float) -> None:
    """Far from the optimum plain steps fail, and are damped."""
    truth, _, constraints = looped_walk(12)
    guess = truth + np.random.default_rng(seed).normal(0.0, scatter, truth.shape)
    best = optimise(guess, constraints, held_nodes(len(truth), constraints, []))
    assert best.chi2 <= constraints.squared_errors(guess).sum()
    assert np.all(np.isfinite(best.poses))


def test_steps_that_fail_are_damped() -> None:
    truth, _, constraints = looped_walk(12)
    guess = truth + np.random.default_rng(3).normal(0.0, 3.0, truth.shape)
    held = held_nodes(len(truth), constraints, [])
    few = optimise(guess, constraints, held, most_steps=3)
    many = optimise(guess, constraints, held)
    assert few.iterations == 3 < many.iterations
    assert many.chi2 <= few.chi2


def test_fixed_nodes_stay_to_the_last_bit() -> None:
    _, way, constraints = looped_walk(30)
    held = held_nodes(len(way), constraints, [5, 17])
    assert np.flatnonzero(held >= HELD).tolist() == [5, 17]
    best = optimise(way, constraints, held)
    assert np.array_equal(best.poses[[5, 17]], way[[5, 17]])
    assert not np.array_equal(best.poses[0], way[0])


def test_each_part_of_a_graph_has_a_gauge() -> None:
    _, way, constraints = looped_walk(30)
    cut = np.all(constraints.ends < 12, axis=1) | np.all(constraints.ends >= 12, axis=1)
    apart = constraints.only(cut & np.all(constraints.ends < 29, axis=1))
    assert np.flatnonzero(held_nodes(30, apart, []) >= HELD).tolist() == [0, 12, 29]
    held = held_nodes(30, apart, [3])
    assert np.flatnonzero(held >= HELD).tolist() == [3, 12, 29]
    best = optimise(way, apart, held)
    assert np.array_equal(best.poses[[3, 12, 29]], way[[3, 12, 29]])


def test_covariances_are_those_of_the_whole_system() -> None:
    _, way, constraints = looped_walk(20)
    held = held_nodes(20, constraints, [])
    best = optimise(way, constraints, held)
    found = covariances(best.poses, constraints, held, [0, 7, 19])
    assert found[0] == pytest.approx(np.zeros((3, 3)), abs=1e-6)
    whole = np.zeros((60, 60))
    for (i, j), measured, information in zip(
        constraints.ends, constraints.measured, constraints.information, strict=True
    ):
        error, jacobian = np.zeros(3), np.zeros((3, 60))
        by_i, by_j = np.zeros((3, 3)), np.zeros((3, 3))
        linearise(best.poses[i], best.poses[j], measured, error, by_i, by_j)
        jacobian[:, 3 * i : 3 * i + 3], jacobian[:, 3 * j : 3 * j + 3] = by_i, by_j
        whole += jacobian.T @ information @ jacobian
    inverse = np.linalg.inv(whole[3:, 3:])  # the first node is held
    assert found[1] == pytest.approx(inverse[18:21, 18:21], rel=1e-4, abs=1e-9)
    assert found[2] == pytest.approx(inverse[54:, 54:], rel=1e-4, abs=1e-9)
