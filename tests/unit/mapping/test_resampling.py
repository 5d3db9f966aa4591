from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.resampling import effective_sample_size, normalized, systematic_resample

log_weights = st.lists(st.floats(-50.0, 0.0), min_size=1, max_size=12).map(np.array)


@given(log_weights, st.integers(0, 2**32))
def test_copies_are_as_many_as_the_weight_says_up_to_rounding(logs: np.ndarray, seed: int) -> None:
    weights = normalized(logs)
    parents = systematic_resample(weights, np.random.default_rng(seed))
    copies, due = np.bincount(parents, minlength=len(weights)), len(weights) * weights
    assert (copies >= np.floor(due - 1e-9)).all() and (copies <= np.ceil(due + 1e-9)).all()
    assert (parents[parents] == parents).all()


@given(log_weights)
def test_the_effective_size_lies_between_one_and_all(logs: np.ndarray) -> None:
    assert 1.0 - 1e-9 <= effective_sample_size(normalized(logs)) <= len(logs) + 1e-9


def test_effective_sizes_of_extremes() -> None:
    assert effective_sample_size(np.full(8, 1 / 8)) == pytest.approx(8.0)
    assert effective_sample_size(np.array([0.0, 1.0, 0.0])) == pytest.approx(1.0)


def test_on_average_copies_are_in_proportion_to_the_weights() -> None:
    rng, weights = np.random.default_rng(1), np.array([0.05, 0.42, 0.13, 0.4])
    draws = [np.bincount(systematic_resample(weights, rng), minlength=4) for _ in range(4000)]
    assert np.mean(draws, axis=0) / 4 == pytest.approx(weights, abs=0.01)


def test_equal_weights_change_nothing() -> None:
    parents = systematic_resample(np.full(5, 0.2), np.random.default_rng(2))
    assert parents.tolist() == [0, 1, 2, 3, 4]


def test_weights_far_below_what_a_float_holds_are_told_apart() -> None:
    assert normalized(np.array([-5000.0, -5001.0])) == pytest.approx([0.731, 0.269], abs=1e-3)
