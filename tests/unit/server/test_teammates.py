from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan
from server.teammates import Disc, Whereabouts, disc_of, without_teammates

T_MAP_ODOM = Pose2(1.0, 0.0, 0.5 * math.pi)


def test_a_disc_is_where_the_robot_was_with_all_that_is_unsure() -> None:
    where = Whereabouts(0.25, Pose2(2.0, 0.0, 0.0), stamp=5.0)
    disc = disc_of(where, T_MAP_ODOM, sigma=0.1, margin=0.2, stamp=5.0)
    assert (disc.x, disc.y) == pytest.approx((1.0, 2.0))
    assert disc.radius == pytest.approx(0.25 + 0.2 + 0.2)


def test_a_robot_that_drives_is_looked_for_ahead_but_never_far() -> None:
    where = Whereabouts(0.25, IDENTITY, stamp=5.0, speed=0.5)
    soon = disc_of(where, T_MAP_ODOM, 0.0, 0.0, 5.5)
    late = disc_of(where, T_MAP_ODOM, 0.0, 0.0, 50.0)
    before = disc_of(where, T_MAP_ODOM, 0.0, 0.0, 4.0)
    assert (soon.x, soon.y, soon.radius) == pytest.approx((1.0, 0.25, 0.375))
    assert (late.y, late.radius) == pytest.approx((0.5, 0.5))
    assert (before.y, before.radius) == pytest.approx((0.0, 0.25))


def test_what_is_very_unsure_counts_as_a_metre() -> None:
    assert disc_of(Whereabouts(0.2, IDENTITY), IDENTITY, 9.0, 0.0, 0.0).radius == 1.2


def scan(*ranges: float) -> LaserScan:
    return LaserScan(np.array(ranges, dtype=np.float32), 0.0, 0.5 * math.pi, 5.0, 0.0)


def test_beams_that_end_at_a_teammate_are_ignored() -> None:
    seen = scan(2.0, 3.0, 5.0, 0.0)
    kept = without_teammates(seen, Pose2(1.0, 1.0, 0.0), [Disc(3.0, 1.0, 0.5), Disc(9.0, 9.0, 1.0)])
    assert kept.ranges.tolist() == [0.0, 3.0, 5.0, 0.0]
    assert seen.ranges.tolist() == [2.0, 3.0, 5.0, 0.0]


def test_a_scan_without_returns_or_teammates_stays_as_it_is() -> None:
    empty, seen = scan(5.0, 5.0), scan(1.0, 2.0)
    assert without_teammates(empty, IDENTITY, [Disc(0.0, 0.0, 9.0)]) is empty
    assert without_teammates(seen, IDENTITY, []) is seen
