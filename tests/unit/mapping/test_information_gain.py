import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.grid import CLEAR, OBSTACLE, UNKNOWN
from mapping.information_gain import (
    entropy_weight,
    gain_region,
    information_gains,
    roomy_classes,
)


def flooded(classes: np.ndarray, cell: tuple[int, int], reach: float) -> set[tuple[int, int]]:
    seen: set[tuple[int, int]] = set()
    queue = [cell]
    while queue:
        cy, cx = queue.pop()
        for iy, ix in ((cy - 1, cx), (cy + 1, cx), (cy, cx - 1), (cy, cx + 1)):
            inside = 0 <= iy < classes.shape[0] and 0 <= ix < classes.shape[1]
            if not inside or (iy, ix) in seen or classes[iy, ix] != UNKNOWN:
                continue
            if (iy - cell[0]) ** 2 + (ix - cell[1]) ** 2 <= reach * reach:
                seen.add((iy, ix))
                queue.append((iy, ix))
    return seen


@settings(max_examples=80, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 16), st.integers(1, 16)),
    known=st.sampled_from([0.05, 0.3, 0.6]),
    reach=st.sampled_from([0.5, 1.0, 2.5, 4.0, 30.0]),
    seed=st.integers(0, 100_000),
)
def test_equals_a_plain_flood(
    shape: tuple[int, int], known: float, reach: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    classes = rng.choice(3, shape, p=[1 - known, known / 2, known / 2]).astype(np.uint8)
    weight = rng.random(shape).astype(np.float32)
    cells = np.column_stack((rng.integers(0, shape[0], 3), rng.integers(0, shape[1], 3)))
    classes[cells[:, 0], cells[:, 1]] = CLEAR
    gains, boxes = information_gains(classes, None, cells, reach)
    weighted, weighted_boxes = information_gains(classes, weight, cells, reach)
    np.testing.assert_array_equal(boxes, weighted_boxes)
    for k, (iy, ix) in enumerate(cells):
        region = flooded(classes, (int(iy), int(ix)), reach)
        assert gains[k] == len(region)
        assert weighted[k] == pytest.approx(sum(float(weight[c]) for c in region))
        flat = gain_region(classes, (int(iy), int(ix)), reach)
        assert flat.tolist() == sorted(y * shape[1] + x for y, x in region)
        if region:
            ys, xs = zip(*region, strict=True)
            assert boxes[k].tolist() == [min(ys), min(xs), max(ys) + 1, max(xs) + 1]
        else:
            assert boxes[k].tolist() == [iy, ix, iy, ix]


def test_a_wall_ends_the_flood() -> None:
    classes = np.zeros((9, 9), dtype=np.uint8)
    classes[4, 0] = CLEAR
    classes[:, 4] = OBSTACLE
    gains, boxes = information_gains(classes, None, [(4, 0)], 50.0)
    assert gains.tolist() == [4 * 9 - 1]
    assert boxes.tolist() == [[0, 0, 9, 4]]


def test_no_frontier_no_gain() -> None:
    gains, boxes = information_gains(np.zeros((3, 3), dtype=np.uint8), None, [], 5.0)
    assert gains.shape == (0,)
    assert boxes.shape == (0, 4)


def test_entropy() -> None:
    p = np.array([[0.5, 0.9], [0.1, 0.999999]])
    log_odds = np.log(p / (1.0 - p)).astype(np.float32)
    bits = entropy_weight(log_odds)
    expected = -p * np.log2(p) - (1 - p) * np.log2(1 - p)
    np.testing.assert_allclose(bits, expected, atol=1e-4)
    assert bits.dtype == np.float32
    assert bits[0, 0] == 1.0
    assert entropy_weight(np.array([-math.inf, 80.0], dtype=np.float32))[1] == pytest.approx(0.0)


def test_floods_do_not_pass_gaps_that_the_body_cannot():
    classes = np.array([[CLEAR, UNKNOWN, UNKNOWN], [OBSTACLE, UNKNOWN, CLEAR]], dtype=np.uint8)
    clearance = np.array([[0.1, 0.1, 0.3], [0.0, 0.05, 0.2]], dtype=np.float32)
    roomy = roomy_classes(classes, clearance, 0.25)
    assert roomy.tolist() == [[CLEAR, CLEAR, UNKNOWN], [OBSTACLE, CLEAR, CLEAR]]
    assert classes[0, 1] == UNKNOWN
