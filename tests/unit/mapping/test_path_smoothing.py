import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.path_smoothing import line_care, shortcuts


def sampled_cells(a: tuple[int, int], b: tuple[int, int]) -> set[tuple[int, int]]:
    """Cells a line goes through, found by walking along it; corners are left out."""
    cells = set()
    for t in np.linspace(0.0, 1.0, 4001):
        y, x = a[0] + 0.5 + t * (b[0] - a[0]), a[1] + 0.5 + t * (b[1] - a[1])
        if min(abs(y - round(y)), abs(x - round(x))) > 1e-6:
            cells.add((math.floor(y), math.floor(x)))
    return cells


@settings(max_examples=60, deadline=None)
@given(
    a=st.tuples(st.integers(0, 9), st.integers(0, 9)),
    b=st.tuples(st.integers(0, 9), st.integers(0, 9)),
    seed=st.integers(0, 10_000),
)
def test_a_line_free_of_care_crosses_no_blocked_cell(
    a: tuple[int, int], b: tuple[int, int], seed: int
) -> None:
    weights = np.random.default_rng(seed).choice([0, 1, 3], (10, 10), p=[0.1, 0.6, 0.3])
    cost, heaviest = line_care(weights.astype(np.uint8), *a, *b)
    crossed = [int(weights[c]) for c in sampled_cells(a, b) - {a}]
    if 0 in crossed:
        assert (cost, heaviest) == (math.inf, 0)
    elif math.isfinite(cost):
        assert heaviest == max(crossed, default=0)
        assert math.hypot(a[0] - b[0], a[1] - b[1]) <= cost + 1e-9


def test_a_line_through_a_corner_needs_both_cells_beside_it() -> None:
    weights = np.ones((2, 2), dtype=np.uint8)
    assert line_care(weights, 0, 0, 1, 1) == (pytest.approx(math.sqrt(2.0)), 1)
    weights[0, 1] = 0
    assert line_care(weights, 0, 0, 1, 1) == (math.inf, 0)
    assert line_care(weights.T.copy(), 0, 0, 1, 1) == (math.inf, 0)


def test_a_line_to_its_own_cell_costs_nothing() -> None:
    assert line_care(np.zeros((3, 3), dtype=np.uint8), 1, 1, 1, 1) == (0.0, 0)


def test_a_staircase_becomes_one_line() -> None:
    weights = np.ones((12, 30), dtype=np.uint8)
    cells = [(0, ix) for ix in range(15)] + [(ix - 14, ix) for ix in range(15, 26)]
    kept = shortcuts(np.array(cells, dtype=np.int64), weights)
    assert kept.tolist() == [0, len(cells) - 1]


def test_short_paths_stay() -> None:
    weights = np.ones((3, 3), dtype=np.uint8)
    assert len(shortcuts(np.empty((0, 2), dtype=np.int64), weights)) == 0
    assert shortcuts(np.array([[1, 1]]), weights).tolist() == [0]
    assert shortcuts(np.array([[1, 1], [1, 2]]), weights).tolist() == [0, 1]


def test_no_line_scrapes_what_the_path_went_around() -> None:
    weights = np.ones((30, 30), dtype=np.uint8)
    weights[:12, 10:14] = 5
    cells = (
        [(5 + k, 3) for k in range(8)]
        + [(13, ix) for ix in range(4, 21)]
        + [(13 - k, 20) for k in range(1, 9)]
    )
    path = np.array(cells, dtype=np.int64)
    kept = shortcuts(path, weights)
    for a, b in pairwise(kept):
        assert line_care(weights, *path[a], *path[b])[1] == 1


def test_gives_up_on_lines_that_stay_blocked() -> None:
    weights = np.ones((3, 120), dtype=np.uint8)
    weights[1, :-1] = 0
    there = [(0, ix) for ix in range(60, 120)]
    back = [(2, ix) for ix in range(119, -1, -1)]
    path = np.array([*there, (1, 119), *back], dtype=np.int64)
    corners = path[shortcuts(path, weights)].tolist()
    assert corners[0] == [0, 60]
    assert corners[-1] == [2, 0]
    assert [0, 119] in corners
    assert len(corners) <= 4
