import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_world.walls import build_walls, clearance

SQUARE = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]]
coordinate = st.floats(-5.0, 5.0)


def _brute(segments, x, y):
    nearest = math.inf
    for x1, y1, x2, y2 in segments:
        length = (x2 - x1) ** 2 + (y2 - y1) ** 2
        share = 0.0 if length == 0 else ((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / length
        share = min(max(share, 0.0), 1.0)
        nearest = min(nearest, math.hypot(x - x1 - share * (x2 - x1), y - y1 - share * (y2 - y1)))
    return nearest


def test_clearance_is_zero_inside_a_solid_whatever_its_sense_of_turning():
    for corners in (SQUARE, SQUARE[::-1]):
        walls = build_walls([corners])
        assert clearance(walls, 2.0, 2.0, 0.3) == 0.0
        assert clearance(walls, 0.5, 2.0, 2.0) == pytest.approx(0.5)
        assert clearance(walls, 0.5, 2.0, 0.3) == pytest.approx(0.3)


def test_a_wall_on_the_line_between_buckets_is_found_from_both_sides():
    walls = build_walls([], [[0.0, 0.0, 0.0, 4.0], [2.0, 0.0, 2.0, 4.0], [4.0, 0.0, 4.0, 4.0]])
    assert clearance(walls, 1.9, 2.0, 0.5) == pytest.approx(0.1)
    assert clearance(walls, 2.1, 2.0, 0.5) == pytest.approx(0.1)


def test_parts_are_told_apart():
    walls = build_walls([SQUARE], [[5.0, 5.0, 6.0, 6.0]])
    assert walls.solid_count == 1
    assert walls.solid(0).tolist() == SQUARE
    assert walls.bare.tolist() == [[5.0, 5.0, 6.0, 6.0]]
    assert walls.extent == (1.0, 1.0, 6.0, 6.0)


def test_a_world_without_walls():
    walls = build_walls([])
    assert walls.extent == (0.0, 0.0, 0.0, 0.0)
    assert clearance(walls, 1.0, 1.0, 0.5) == 0.5


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(coordinate, coordinate, coordinate, coordinate), min_size=1, max_size=8),
    coordinate,
    coordinate,
    st.floats(0.3, 2.5),
)
def test_clearance_equals_brute_force(segments, x, y, bucket_size):
    walls = build_walls([], segments, bucket_size)
    expected = min(_brute(segments, x, y), 1.5)
    assert clearance(walls, x, y, 1.5) == pytest.approx(expected, abs=1e-9)


def test_every_segment_is_in_the_buckets_it_crosses():
    rng = np.random.default_rng(0)
    walls = build_walls([], rng.uniform(0.0, 6.0, (20, 4)), 0.7)
    for k, (x1, y1, x2, y2) in enumerate(walls.segments):
        for share in np.linspace(0.0, 1.0, 50):
            x, y = x1 + share * (x2 - x1), y1 + share * (y2 - y1)
            ix, iy = ((np.array([x, y]) - walls.origin) / walls.bucket_size).astype(int)
            bucket = iy * walls.bucket_cols + ix
            items = walls.bucket_items[
                walls.bucket_starts[bucket] : walls.bucket_starts[bucket + 1]
            ]
            assert k in items
