"""What a graph predicts of a loop is what its whole covariance says."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.batch_optimisation import held_nodes, system_of
from mapping.constraints import linearise
from mapping.error_spread import predicted_spread
from tests.unit.mapping.looped_walk import looped_walk


def test_spread_is_that_of_the_joint_covariance() -> None:
    _, way, constraints = looped_walk(40)
    known, asked = constraints.only(constraints.ends[:, 1] % 3 < 2), constraints
    system = system_of(len(way), known, held_nodes(len(way), known, []))
    system.fill_weighed(way, np.ones(len(known)))
    spread = predicted_spread(system, way, asked)
    for (i, j), measured, found in zip(asked.ends, asked.measured, spread, strict=True):
        error, by_i, by_j = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
        linearise(way[i], way[j], measured, error, by_i, by_j)
        both = np.hstack((by_i, by_j))
        whole = both @ system.joint_covariance([i, j]) @ both.T
        assert found == pytest.approx(whole, rel=1e-6, abs=1e-9)


def test_of_a_chain_errors_add_up() -> None:
    _, way, constraints = looped_walk(9)
    chain = constraints.only(np.arange(8))
    system = system_of(9, chain, held_nodes(9, chain, []))
    system.fill_weighed(way, np.ones(8))
    ends = chain.only(np.arange(2))
    ends.ends[:] = [(0, 8), (4, 8)]
    whole, half = predicted_spread(system, way, ends)
    assert whole[2, 2] == pytest.approx(8 * 0.02**2)
    assert half[2, 2] == pytest.approx(4 * 0.02**2)
