import heapq

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.bucket_wave import (
    DIAGONAL_STEP,
    MAX_WEIGHT,
    NOWHERE,
    STRAIGHT_STEP,
    UNREACHED,
    bucket_wave,
)


def dijkstra(weights: np.ndarray, starts: np.ndarray) -> np.ndarray:
    rows, cols = weights.shape
    units = np.full(weights.shape, UNREACHED, dtype=np.int32)
    heap = [(0, int(iy), int(ix)) for iy, ix in starts]
    for _, iy, ix in heap:
        units[iy, ix] = 0
    heapq.heapify(heap)
    while heap:
        cost, cy, cx = heapq.heappop(heap)
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                iy, ix = cy + dy, cx + dx
                if not (0 <= iy < rows and 0 <= ix < cols) or weights[iy, ix] == 0:
                    continue
                if dy and dx and (weights[cy, ix] == 0 or weights[iy, cx] == 0):
                    continue
                step = DIAGONAL_STEP if dy and dx else STRAIGHT_STEP
                reached = cost + step * min(int(weights[iy, ix]), MAX_WEIGHT)
                if reached < units[iy, ix]:
                    units[iy, ix] = reached
                    heapq.heappush(heap, (reached, iy, ix))
    return units


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 14), st.integers(1, 14)),
    blocked=st.sampled_from([0.0, 0.2, 0.45]),
    heaviest=st.sampled_from([1, 6, 9, 200]),
    sources=st.integers(1, 3),
    seed=st.integers(0, 100_000),
)
def test_equals_dijkstra(
    shape: tuple[int, int], blocked: float, heaviest: int, sources: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    weights = rng.integers(1, heaviest + 1, shape).astype(np.uint8)
    weights[rng.random(shape) < blocked] = 0
    starts = np.column_stack(
        (rng.integers(0, shape[0], sources), rng.integers(0, shape[1], sources))
    )
    np.testing.assert_array_equal(
        bucket_wave(weights, starts, NOWHERE, 0), dijkstra(weights, starts)
    )


def test_without_a_start_nothing_is_reached() -> None:
    units = bucket_wave(
        np.ones((3, 3), dtype=np.uint8), np.empty((0, 2), dtype=np.int64), NOWHERE, 0
    )
    assert (units == UNREACHED).all()


def test_many_starts_need_larger_buckets() -> None:
    weights = np.ones((20, 20), dtype=np.uint8)
    starts = np.argwhere(weights > 0)
    assert (bucket_wave(weights, starts, NOWHERE, 0) == 0).all()


def test_a_wave_stops_some_way_beyond_the_cell_it_is_sent_for() -> None:
    weights = np.ones((5, 60), dtype=np.uint8)
    starts = np.array([[2, 0]])
    whole = bucket_wave(weights, starts, NOWHERE, 0)
    near = bucket_wave(weights, starts, (2, 10), 4 * STRAIGHT_STEP)
    known = whole <= whole[2, 14]
    np.testing.assert_array_equal(near[known], whole[known])
    assert (near[:, 20:] == UNREACHED).all()
    weights[2, 10] = 0  # the wave never comes there, so it goes everywhere
    assert bucket_wave(weights, starts, (2, 10), 0)[2, 59] < UNREACHED
    assert bucket_wave(weights, starts, (7, 10), 0)[2, 59] < UNREACHED
