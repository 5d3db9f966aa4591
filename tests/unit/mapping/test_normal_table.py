from __future__ import annotations

import hashlib
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.normal_table import SHARES, share_below, small_exp


def normal(x: float) -> float:
    return 0.5 * (1.0 + math.erf(x / math.sqrt(2.0)))


@pytest.mark.parametrize("x", [-4.0, -1.234, 0.0, 0.5, 2.0, 3.3])
def test_it_is_a_normal_distribution_with_a_share_three_times_as_wide(x):
    assert share_below(x) == pytest.approx(0.99 * normal(x) + 0.01 * normal(x / 3.0), abs=2e-5)


@given(st.floats(-20.0, 20.0), st.floats(0.0, 1.0))
def test_it_never_falls(x, more):
    assert 0.0 <= share_below(x) <= share_below(x + more) <= 1.0


def test_beyond_its_ends_it_is_none_or_all():
    assert share_below(-12.0) == share_below(-math.inf) == share_below(math.nan) == 0.0
    assert share_below(12.0) == share_below(math.inf) == 1.0
    assert share_below(math.nextafter(12.0, 0.0)) == pytest.approx(1.0)


def test_the_exponential_series():
    for x in (-1.0, -0.01, 0.0, 0.3, 1.0):
        assert small_exp(x) == pytest.approx(math.exp(x), rel=1e-15)


def test_the_table_is_the_same_everywhere():
    # A reader with another table reads other scans: the table is part of the format.
    digest = hashlib.sha256(np.ascontiguousarray(SHARES, dtype="<f8").tobytes()).hexdigest()
    assert digest[:16] == "410e4cf713f72e2a"
