"""Those constraints are kept that hold together with the trusted ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.batch_optimisation import held_nodes
from mapping.constraints import Constraints
from mapping.graduated_loss import select, truncated_weights


@given(st.floats(0.0, 1e9), st.floats(0.01, 100.0), st.floats(1e-9, 1e9))
def test_weights_fall_from_one_to_zero(squared: float, limit: float, convexity: float) -> None:
    errors = np.array([squared, 2.0 * squared + 1e-3])
    first, second = truncated_weights(errors, limit, convexity)
    assert 0.0 <= second <= first <= 1.0
    if squared <= convexity / (convexity + 1.0) * limit * 0.999:
        assert first == 1.0
    if squared >= (convexity + 1.0) / convexity * limit * 1.001:
        assert first == 0.0


def test_no_error_at_all_is_no_trouble() -> None:
    for convexity in (1e-9, 1.0, 1e15):
        assert truncated_weights(np.zeros(2), 1e-3, convexity).tolist() == [1.0, 1.0]


def lines(claims: list[float]) -> tuple[np.ndarray, Constraints, np.ndarray]:
    """A straight walk of ten steps of 1 m; claims of how far its end is from its beginning [m]."""
    ends = np.array([(k, k + 1) for k in range(10)] + [(0, 10)] * len(claims))
    measured = np.zeros((len(ends), 3))
    measured[:, 0] = [1.0] * 10 + claims
    information = np.tile(100.0 * np.eye(3), (len(ends), 1, 1))
    poses = np.zeros((11, 3))
    poses[:, 0] = np.arange(11)
    return poses, Constraints(ends, measured, information), np.arange(len(ends)) < 10


def test_the_many_win_over_the_few() -> None:
    poses, constraints, trusted = lines([10.5, 10.52, 10.48, 14.0])
    held = held_nodes(11, constraints, [])
    found = select(poses, constraints, trusted, 9.0, held)
    assert found.kept.tolist() == [True] * 13 + [False]
    assert 10.3 < found.poses[10, 0] < 10.5
    assert found.iterations > 3


def test_what_agrees_is_kept_at_once() -> None:
    poses, constraints, trusted = lines([10.1, 10.0])
    found = select(poses, constraints, trusted, 9.0, held_nodes(11, constraints, []))
    assert found.kept.all()
    assert found.iterations == 1
    assert found.poses[10, 0] == pytest.approx(10.05, abs=0.01)


def test_fixed_ends_are_not_moved_by_a_claim() -> None:
    poses, constraints, trusted = lines([10.1, 13.0])
    found = select(poses, constraints, trusted, 9.0, held_nodes(11, constraints, [0, 10]))
    assert found.kept.tolist() == [True] * 11 + [False]
    assert np.array_equal(found.poses[[0, 10]], poses[[0, 10]])
