import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.grid import GridGeometry
from sim_world.raycast import cast_discs, cast_grid, cast_segments, clear_rings_of
from sim_world.walls import build_walls, clearance

ROOM = build_walls([], [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [0, 5, 0, 0]])
FOUR = np.array([0.0, math.pi / 2, math.pi, -math.pi / 2])
coordinate = st.floats(-4.0, 4.0)

# A ray almost along a wall meets it at infinity; plain Python says so where compiled code does not.
pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")


def _brute_segments(segments, x, y, angle, range_max):
    d = np.array([math.cos(angle), math.sin(angle)])
    nearest = range_max
    for x1, y1, x2, y2 in segments:
        e = np.array([x2 - x1, y2 - y1])
        turn = d[0] * e[1] - d[1] * e[0]
        if abs(turn) < 1e-9:
            continue
        ax, ay = x1 - x, y1 - y
        t = (ax * e[1] - ay * e[0]) / turn
        share = (ax * d[1] - ay * d[0]) / turn
        if t >= 0 and 0 <= share <= 1:
            nearest = min(nearest, t)
    return nearest


def test_ranges_in_a_rectangular_room():
    ranges = cast_segments(ROOM, Pose2(3.0, 2.0, 0.0), FOUR, 10.0)
    assert ranges == pytest.approx([5.0, 3.0, 3.0, 2.0])
    turned = cast_segments(ROOM, Pose2(3.0, 2.0, math.pi / 2), FOUR, 10.0)
    assert turned == pytest.approx([3.0, 3.0, 2.0, 5.0])


def test_nothing_within_reach_is_exactly_the_reach():
    assert (cast_segments(ROOM, Pose2(4.0, 2.5, 0.0), FOUR, 1.7) == 1.7).all()


def test_no_ray_slips_through_a_corner():
    for corner in ((0.0, 0.0), (8.0, 5.0)):
        bearing = math.atan2(corner[1] - 2.0, corner[0] - 3.0)
        bearings = bearing + np.linspace(-1e-9, 1e-9, 41)
        assert (cast_segments(ROOM, Pose2(3.0, 2.0, 0.0), bearings, 20.0) < 20.0).all()


def test_rays_from_outside_the_walls():
    bearings = np.array([0.0, math.pi, math.pi / 2, 0.3])
    ranges = cast_segments(ROOM, Pose2(-2.0, 2.0, 0.0), bearings, 10.0)
    assert ranges[:3] == pytest.approx([2.0, 10.0, 10.0])
    below = cast_segments(ROOM, Pose2(3.0, -4.0, 0.0), FOUR, 10.0)
    assert below == pytest.approx([10.0, 4.0, 10.0, 10.0])


def test_a_ray_along_a_wall_ends_at_its_near_end():
    wall = build_walls([], [[2.0, 0.0, 4.0, 0.0], [0.0, 3.0, 1.0, 3.0]])
    ranges = cast_segments(wall, Pose2(0.0, 0.0, 0.0), np.array([0.0, math.pi]), 10.0)
    assert ranges == pytest.approx([2.0, 10.0])
    assert cast_segments(wall, Pose2(3.0, 0.0, 0.0), np.array([0.0]), 10.0)[0] == 0.0


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(coordinate, coordinate, coordinate, coordinate), min_size=1, max_size=8),
    coordinate,
    coordinate,
    st.floats(-3.1, 3.1),
    st.floats(0.4, 3.0),
)
def test_segments_equal_brute_force(segments, x, y, angle, bucket_size):
    walls = build_walls([], segments, bucket_size)
    assume(clearance(walls, x, y, 1.0) > 1e-3)
    # A ray along a wall, or past its very end, may fall either way.
    for x1, y1, x2, y2 in segments:
        for end_x, end_y in ((x1, y1), (x2, y2)):
            assume(abs((end_x - x) * math.sin(angle) - (end_y - y) * math.cos(angle)) > 1e-6)
    got = cast_segments(walls, Pose2(x, y, angle), np.array([0.0]), 9.0)[0]
    assert got == pytest.approx(_brute_segments(segments, x, y, angle, 9.0), abs=1e-6)


def _grid(rows):
    return np.array([[cell == "#" for cell in row] for row in rows[::-1]])


def _brute_grid(solid, geometry, x, y, angle, range_max):
    """Return the nearest entry into any solid square, by slabs; outside is solid too."""
    d = (math.cos(angle), math.sin(angle))
    r, nearest = geometry.resolution, range_max
    padded = np.pad(solid, 1, constant_values=True)
    for iy, ix in np.argwhere(padded) - 1:
        low = (geometry.origin_x + ix * r, geometry.origin_y + iy * r)
        t0, t1 = 0.0, math.inf
        for start, lo, direction in zip((x, y), low, d, strict=True):
            a, b = (lo - start) / direction, (lo + r - start) / direction
            t0, t1 = max(t0, min(a, b)), min(t1, max(a, b))
        if t0 < t1:
            nearest = min(nearest, t0)
    return nearest


def test_a_ray_ends_where_it_enters_the_solid_cell():
    solid = _grid(["......", ".#..#.", "......"])
    geometry = GridGeometry(0.5, 10.0, 20.0, 3, 6)
    ranges = cast_grid(clear_rings_of(solid), geometry, Pose2(11.2, 20.7, 0.0), FOUR, 10.0)
    assert ranges == pytest.approx([0.8, 0.8, 0.2, 0.7])


def test_a_ray_that_starts_in_a_solid_cell_or_outside_has_no_length():
    solid = _grid(["#.", ".."])
    rings = clear_rings_of(solid)
    geometry = GridGeometry(1.0, 0.0, 0.0, 2, 2)
    assert (cast_grid(rings, geometry, Pose2(0.5, 1.5, 0.0), FOUR, 5.0) == 0.0).all()
    assert (cast_grid(rings, geometry, Pose2(-3.0, 1.5, 0.0), FOUR, 5.0) == 0.0).all()


def test_clear_rings_count_kings_moves_and_are_capped():
    rings = clear_rings_of(np.zeros((7, 9), dtype=bool))
    assert rings[0, 0] == 1
    assert rings[3, 4] == 4
    assert clear_rings_of(np.zeros((1, 1), dtype=bool)).dtype == np.uint8
    assert clear_rings_of(np.zeros((601, 601), dtype=bool)).max() == 255


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-3.1, 3.1))
def test_grid_equals_brute_force(seed, angle):
    rng = np.random.default_rng(seed)
    solid = rng.random((12, 14)) < 0.06
    geometry = GridGeometry(0.25, -1.0, 2.0, 12, 14)
    x, y = rng.uniform(-0.9, 2.4), rng.uniform(2.1, 4.9)
    if min(abs(math.cos(angle)), abs(math.sin(angle))) < 1e-6:
        angle += 0.01
    got = cast_grid(clear_rings_of(solid), geometry, Pose2(x, y, angle), np.array([0.0]), 2.5)[0]
    assert got == pytest.approx(_brute_grid(solid, geometry, x, y, angle, 2.5), abs=1e-6)


def test_discs():
    discs = np.array([[3.0, 0.0, 0.5], [5.0, 0.0, 0.5], [0.0, 20.0, 0.5]])
    ranges = cast_discs(discs, Pose2(0.0, 0.0, 0.0), np.array([0.0, math.pi, 0.1, 1.5]), 10.0)
    assert ranges[0] == pytest.approx(2.5)
    assert ranges[1] == 10.0
    along, off = 3.0 * math.cos(0.1), 3.0 * math.sin(0.1)
    assert ranges[2] == pytest.approx(along - math.sqrt(0.25 - off**2))
    assert ranges[3] == 10.0


def test_from_inside_a_disc_everything_is_at_zero():
    assert (cast_discs(np.array([[0.1, 0.0, 0.5]]), Pose2(0, 0, 0), FOUR, 10.0) == 0.0).all()
