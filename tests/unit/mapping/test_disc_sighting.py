"""Teammates in a scan are discs of known radius."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.disc_sighting import find_discs
from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.scan import LaserScan
from sim_world.raycast import cast_discs

STEP = math.radians(1.0)


def scan_of(
    discs: list[tuple[float, float, float]], wall: float = 8.0, sigma: float = 0.0
) -> LaserScan:
    """Half a turn in front of a round wall, with discs x, y, radius [m]."""
    bearings: Floats = -math.pi / 2 + STEP * np.arange(181)
    seen = cast_discs(np.array(discs).reshape(-1, 3), IDENTITY, bearings, 8.0)
    ranges = np.minimum(seen, wall)
    noise = sigma * np.random.default_rng(1).standard_normal(181)
    ranges = np.where(ranges < 8.0, ranges + noise, 8.0).astype(np.float32)
    return LaserScan(ranges, -math.pi / 2, STEP, 8.0, 0.0)


@pytest.mark.parametrize("place", [(0.8, 0.0), (1.0, 1.0), (2.0, -1.5), (0.5, 0.3)])
def test_a_disc_is_found_where_it_is(place: tuple[float, float]) -> None:
    found = find_discs(scan_of([(*place, 0.25)], sigma=0.02), 0.25)
    assert found.shape == (1, 2)
    assert found[0] == pytest.approx(place, abs=0.04)


def test_two_discs_are_two() -> None:
    found = find_discs(scan_of([(1.0, 0.6, 0.25), (1.0, -0.6, 0.25)], wall=5.0), 0.25)
    assert sorted(found[:, 1].round(1).tolist()) == [-0.6, 0.6]


def test_a_disc_of_another_size_is_none() -> None:
    assert not len(find_discs(scan_of([(1.5, 0.0, 0.6)]), 0.25))
    assert not len(find_discs(scan_of([(1.5, 0.0, 0.1)]), 0.25))


def test_a_wall_with_a_gap_is_no_disc() -> None:
    ranges = np.full(181, 2.0, np.float32)
    ranges[80:100] = 8.0
    assert not len(find_discs(LaserScan(ranges, -math.pi / 2, STEP, 8.0, 0.0), 0.25))


def test_a_hole_of_a_discs_size_is_none() -> None:
    ranges = np.full(181, 1.0, np.float32)
    ranges[80:100] = 2.0
    assert not len(find_discs(LaserScan(ranges, -math.pi / 2, STEP, 8.0, 0.0), 0.25))


def test_a_flat_board_and_a_step_are_no_discs() -> None:
    bearings = -math.pi / 2 + STEP * np.arange(181)
    board = np.full(181, 8.0)
    near = np.abs(np.tan(bearings) * 1.0) < 0.25
    board[near & (np.abs(bearings) < 1.0)] = (1.0 / np.cos(bearings))[
        near & (np.abs(bearings) < 1.0)
    ]
    board[85:90] += 0.1
    assert not len(
        find_discs(LaserScan(board.astype(np.float32), -math.pi / 2, STEP, 8.0, 0.0), 0.25)
    )


def test_the_laser_may_sit_anywhere() -> None:
    scan = scan_of([(1.0, 0.0, 0.25)])
    moved = LaserScan(scan.ranges, scan.bearing_start, STEP, 8.0, 0.0, Pose2(0.1, 0.2, math.pi / 2))
    assert find_discs(moved, 0.25)[0] == pytest.approx((0.1, 1.2), abs=0.02)


def test_far_away_too_few_beams_hit() -> None:
    assert not len(find_discs(scan_of([(7.0, 0.0, 0.25)]), 0.25))
    assert not len(find_discs(scan_of([(0.6, 0.0, 0.25)]), 0.7))
