"""Teammates that may be anywhere do not become walls."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry import IDENTITY, Floats
from mapping.scan import LaserScan
from robot_agent.unplaced import without_discs
from sim_world.raycast import cast_discs

STEP = math.radians(1.0)
RADIUS = 0.25


def scan_of(*discs: tuple[float, float, float], wall: float = 5.0) -> LaserScan:
    """Half a turn in front of a round wall, with discs x, y, radius [m]."""
    bearings: Floats = -math.pi / 2 + STEP * np.arange(181)
    seen = cast_discs(np.array(discs).reshape(-1, 3), IDENTITY, bearings, 8.0)
    ranges = np.minimum(seen, wall).astype(np.float32)
    return LaserScan(ranges, -math.pi / 2, STEP, 8.0, 0.0)


def test_of_a_scan_without_discs_nothing_is_taken() -> None:
    scan = scan_of()
    np.testing.assert_array_equal(without_discs(scan, [RADIUS]).ranges, scan.ranges)


@given(st.floats(0.7, 2.5), st.floats(-1.2, 1.2))
def test_no_beam_ends_at_a_teammate_and_all_others_stay(away: float, bearing: float) -> None:
    x, y = away * math.cos(bearing), away * math.sin(bearing)
    scan = scan_of((x, y, RADIUS))
    kept = without_discs(scan, [RADIUS])
    at_mate = scan.ranges < 4.9
    assert at_mate.sum() >= 5
    assert not kept.hits[at_mate].any()
    assert kept.hits[~at_mate].all()


def test_each_size_of_a_teammate_is_looked_for() -> None:
    scan = scan_of((1.0, 0.7, 0.2), (1.0, -0.7, 0.3), wall=3.0)
    assert (without_discs(scan, [0.2, 0.3]).ranges[scan.hits] < 2.9).sum() <= (
        without_discs(scan, [0.2]).ranges[scan.hits] < 2.9
    ).sum()
    hits = without_discs(scan, [0.2, 0.3]).hits
    assert not (hits & (scan.ranges < 2.9)).any()


def test_a_post_of_another_size_stays() -> None:
    scan = scan_of((1.5, 0.0, 0.6))
    np.testing.assert_array_equal(without_discs(scan, [RADIUS]).ranges, scan.ranges)
