from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_world.radio.shadowing import shadowing

COORDINATES = st.floats(-1e5, 1e5)
PLACES = st.tuples(COORDINATES, COORDINATES)


@given(st.integers(0, 2**63), PLACES, PLACES)
def test_it_is_finite_repeats_and_is_the_same_both_ways(
    seed: int, a: tuple[float, float], b: tuple[float, float]
) -> None:
    value = shadowing(seed, a, b, 1.0)
    assert abs(value) < 10.0
    assert shadowing(seed, a, b, 1.0) == shadowing(seed, b, a, 1.0) == value


def test_it_is_the_same_within_a_cell_and_another_one_for_another_seed() -> None:
    value = shadowing(7, (0.1, 0.1), (5.1, -0.9), 1.0)
    assert shadowing(7, (0.9, 0.9), (5.9, -0.1), 1.0) == value
    assert shadowing(7, (1.1, 0.1), (5.1, -0.9), 1.0) != value
    assert shadowing(8, (0.1, 0.1), (5.1, -0.9), 1.0) != value


def test_it_is_normal_and_unrelated_between_neighbours() -> None:
    cells = [float(k) for k in range(60)]
    values = np.array([[shadowing(1, (x, 0.5), (0.0, y), 1.0) for x in cells] for y in cells])
    assert values.mean() == pytest.approx(0.0, abs=0.06)
    assert values.std() == pytest.approx(1.0, abs=0.05)
    assert (np.abs(values) < 1.0).mean() == pytest.approx(0.683, abs=0.03)
    neighbours = np.corrcoef(values[:, :-1].ravel(), values[:, 1:].ravel())[0, 1]
    assert neighbours == pytest.approx(0.0, abs=0.06)
