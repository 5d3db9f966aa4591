from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.grid import GridGeometry, OccupancyGrid
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings, beam_ends, integrate_scan, scan_extent
from mapping.scan_points import scan_points, turned_points
from tests.unit.mapping.rectangle import rectangle_scan

HERE = Pose2(0.05, 0.05, 0.0)


def one_beam(reach: float, bearing: float = 0.0, range_max: float = 2.0) -> LaserScan:
    return LaserScan(np.array([reach], dtype=np.float32), bearing, 0.1, range_max, 0.0)


def blank(half: float = 3.0, resolution: float = 0.1) -> OccupancyGrid:
    cells = round(2 * half / resolution)
    return OccupancyGrid.unknown(GridGeometry(resolution, -half, -half, cells, cells))


def at(grid: OccupancyGrid, x: float, y: float) -> float:
    return float(grid.log_odds[grid.geometry.cell_at(x, y)])


def test_a_beam_clears_its_way_and_hits_at_its_end():
    grid = blank()
    integrate_scan(grid, one_beam(1.0), HERE, IntegrationSettings(hit=0.9, miss=-0.6))
    assert at(grid, 1.05, 0.05) == pytest.approx(0.9)
    assert at(grid, 0.05, 0.05) == at(grid, 0.85, 0.05) == pytest.approx(-0.6)
    assert at(grid, 1.15, 0.05) == at(grid, 0.5, 0.15) == 0.0


def test_misses_stop_the_margin_before_the_end_point():
    grid = blank()
    integrate_scan(grid, one_beam(1.0), HERE, IntegrationSettings(clear_margin=0.2))
    assert at(grid, 0.75, 0.05) < 0.0
    assert at(grid, 0.95, 0.05) == 0.0


def test_a_beam_without_return_clears_to_its_reach_and_marks_no_hit():
    grid = blank()
    integrate_scan(grid, one_beam(2.0), HERE)
    assert (grid.log_odds <= 0.0).all()
    assert at(grid, 1.95, 0.05) < 0.0
    assert at(grid, 2.15, 0.05) == 0.0


def test_a_range_of_zero_is_ignored():
    grid = blank()
    assert integrate_scan(grid, one_beam(0.0), HERE).empty is False
    assert (grid.log_odds == 0.0).all()


def test_a_very_short_beam_clears_nothing():
    grid = blank()
    integrate_scan(grid, one_beam(0.015), HERE)
    assert (grid.log_odds >= 0.0).all()


def test_as_many_beams_must_end_in_a_cell_as_pass_it():
    for ranges, wall in (([0.97, 2.0], True), ([0.97, 2.0, 2.0], False)):
        grid = blank()
        scan = LaserScan(np.array(ranges, dtype=np.float32), 0.0, 0.01, 3.0, 0.0)
        integrate_scan(grid, scan, HERE)
        assert (at(grid, 1.05, 0.05) > 0.0) == wall


def test_a_thin_wall_seen_from_both_sides_is_drawn_once():
    grid = blank(half=2.0)
    bearings = np.linspace(-0.5, 0.5, 41)
    for x, facing in ((0.02, 1.0), (1.07, -1.0)):  # the wall is from 0.52 to 0.57 m
        reach = (0.5 / np.cos(bearings)).astype(np.float32)
        scan = LaserScan(reach, -0.5, 0.025, 5.0, 0.0)
        integrate_scan(grid, scan, Pose2(x, 0.05, 0.0 if facing > 0.0 else np.pi))
    across = [at(grid, x, 0.05) > 0.0 for x in (0.35, 0.45, 0.55, 0.65)]
    assert across == [False, False, True, False]


def test_points_that_are_known_already_are_not_made_again():
    scan = LaserScan(np.full(30, 1.0, dtype=np.float32), 0.0, 0.05, 3.0, 0.0)
    given_them, alone = blank(), blank()
    integrate_scan(alone, scan, HERE)
    integrate_scan(given_them, scan, HERE, points_map=turned_points(scan_points(scan), HERE))
    assert np.array_equal(alone.log_odds, given_them.log_odds)


def test_every_cell_changes_at_most_once_per_scan():
    grid = blank()
    chosen = IntegrationSettings(hit=0.9, miss=-0.6)
    ranges = np.full(90, 1.0, dtype=np.float32)
    integrate_scan(grid, LaserScan(ranges, 0.0, 0.005, 3.0, 0.0), HERE, chosen)
    values = np.unique(grid.log_odds)
    assert np.allclose(values, [-0.6, 0.0, 0.9])


def test_log_odds_are_clamped():
    grid = blank()
    chosen = IntegrationSettings(lowest=-1.0, highest=1.5)
    for _ in range(9):
        integrate_scan(grid, one_beam(1.0), HERE, chosen)
    assert at(grid, 1.05, 0.05) == pytest.approx(1.5)
    assert at(grid, 0.5, 0.05) == pytest.approx(-1.0)


def test_kept_walls_are_neither_erased_nor_seen_through():
    grid = blank()
    integrate_scan(grid, one_beam(1.0), HERE)
    before = at(grid, 1.05, 0.05)
    integrate_scan(grid, one_beam(2.0), HERE, keep_above=0.4)
    assert at(grid, 1.05, 0.05) == before
    assert at(grid, 1.5, 0.05) == 0.0
    integrate_scan(grid, one_beam(2.0), HERE)
    assert at(grid, 1.05, 0.05) < before
    assert at(grid, 1.5, 0.05) < 0.0


def test_what_lies_outside_the_grid_is_left_out():
    grid = blank(half=0.5)
    box = integrate_scan(grid, one_beam(1.9), HERE)
    assert box.ix1 == grid.geometry.cols
    assert at(grid, 0.45, 0.05) < 0.0
    assert integrate_scan(grid, one_beam(1.0), Pose2(50.0, 0.0, 0.0)).empty


def test_the_laser_may_stand_outside_the_grid():
    grid = blank(half=0.5)
    integrate_scan(grid, one_beam(1.9), Pose2(-1.0, 0.05, 0.0))
    assert at(grid, 0.05, 0.05) < 0.0


def test_extent_and_ends_agree_and_use_the_mount():
    scan = LaserScan(
        np.array([1.0, 0.0, 9.0], dtype=np.float32), 0.0, math.pi / 2, 2.0, 0.0,
        Pose2(0.5, 0.0, 0.0),
    )  # fmt: skip
    ends, hits = beam_ends(scan, Pose2(0.0, 1.0, math.pi / 2))
    assert np.allclose(ends, [[0.0, 2.5], [0.0, -0.5]], atol=1e-6)
    assert hits.tolist() == [True, False]
    assert np.allclose(scan_extent(scan, Pose2(0.0, 1.0, math.pi / 2)), [0.0, -0.5, 0.0, 2.5])


def test_filling_between_leaves_no_comb_of_unseen_cells():
    ranges = np.full(9, 2.5, dtype=np.float32)
    scan = LaserScan(ranges, -0.4, 0.1, 3.0, 0.0)
    plain, filled = blank(), blank()
    integrate_scan(plain, scan, HERE)
    settings = IntegrationSettings(fill_between=True, surface_gap=0.0)
    integrate_scan(filled, scan, HERE, settings)
    assert (filled.log_odds < 0.0).sum() > 1.2 * (plain.log_odds < 0.0).sum()
    assert np.array_equal(filled.log_odds > 0.0, plain.log_odds > 0.0)


def test_neighbouring_end_points_lie_on_one_surface():
    ranges = np.full(9, 2.5, dtype=np.float32)
    scan = LaserScan(ranges, -0.4, 0.1, 3.0, 0.0)  # end points 0.25 m apart
    settings = IntegrationSettings(fill_between=True)
    grid = blank()
    integrate_scan(grid, scan, HERE, settings)
    wall = grid.log_odds > 0.0
    rows = np.flatnonzero(wall.any(axis=1))
    assert len(rows) > 2 * len(ranges) and (np.diff(rows) == 1).all()
    # What was seen free stays free: a surface is only guessed where nothing speaks against it.
    grid.log_odds[:] = -1.0
    integrate_scan(grid, scan, HERE, settings)
    assert (grid.log_odds > -1.0).sum() <= len(ranges)


def test_walls_come_out_thin_and_the_floor_before_them_clear():
    rng = np.random.default_rng(3)
    grid = OccupancyGrid.unknown(GridGeometry(0.1, -0.5, -0.5, 40, 50))
    for _ in range(15):
        pose = Pose2(rng.uniform(1.0, 3.0), rng.uniform(1.0, 2.0), rng.uniform(-3.0, 3.0))
        integrate_scan(grid, rectangle_scan(pose, beams=120, noise=0.03, rng=rng), pose)
    walls = np.argwhere(grid.log_odds > 0.4)
    centres = grid.geometry.centres_of(walls)
    off = np.minimum.reduce(
        [abs(centres[:, 0]), abs(centres[:, 0] - 4.0), abs(centres[:, 1]), abs(centres[:, 1] - 3.0)]
    )
    assert off.max() < 0.16
    assert len(walls) * 0.1 < 2.0 * 14.0
    inside = grid.log_odds[7:33, 7:43]
    assert (inside < -0.4).mean() > 0.97


@given(
    st.lists(st.floats(0.0, 2.5), min_size=1, max_size=12),
    st.floats(-0.9, 0.9),
    st.floats(-3.1, 3.1),
)
@settings(max_examples=40, deadline=None)
def test_changes_stay_in_the_box_and_within_one_step(ranges, x, theta):
    grid = blank(half=2.0, resolution=0.2)
    scan = LaserScan(np.array(ranges, dtype=np.float32), -1.0, 0.2, 2.0, 0.0)
    box = integrate_scan(grid, scan, Pose2(x, 0.3, theta))
    values = grid.log_odds.copy()
    assert values.max() <= 0.9 + 1e-6 and values.min() >= -0.6 - 1e-6
    values[box.slices] = 0.0
    assert (values == 0.0).all()
