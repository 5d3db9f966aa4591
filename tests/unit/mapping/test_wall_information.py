"""Straight walls hold a pose across themselves, and never along."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.match_map import MatchMap
from mapping.scan import LaserScan
from mapping.wall_information import firm_part, wall_information

STEP = math.radians(1.0)


def corner(with_end: bool, seed: int = 0) -> LaserScan:
    """A wall along y = -1, and one across x = 3 if wanted."""
    bearings = -math.pi / 2 + STEP * np.arange(181)
    with np.errstate(divide="ignore"):
        side = np.where(np.sin(bearings) < -1e-3, -1.0 / np.sin(bearings), 8.0)
        end = np.where(np.cos(bearings) > 1e-3, 3.0 / np.cos(bearings), 8.0)
    ranges = np.minimum(side, end) if with_end else side
    noise = 0.03 * np.random.default_rng(seed).standard_normal(181)
    ranges = np.where(ranges < 8.0, np.minimum(ranges + noise, 7.99), 8.0)
    return LaserScan(ranges.astype(np.float32), -math.pi / 2, STEP, 8.0, 0.0)


def drawn(with_end: bool) -> MatchMap:
    map_ = MatchMap()
    for seed in range(3):
        map_.insert(corner(with_end, seed), IDENTITY)
    return map_


def test_a_bare_wall_does_not_hold_along_itself() -> None:
    information = firm_part(wall_information(drawn(False), corner(False, 9), IDENTITY))
    assert information[1, 1] > 1e4
    assert information[0, 0] < 1e-3 * information[1, 1]
    strengths = np.linalg.eigvalsh(information)
    assert strengths[0] == pytest.approx(0.0, abs=1e-6)


def test_a_corner_holds_all_ways() -> None:
    information = firm_part(wall_information(drawn(True), corner(True, 9), IDENTITY))
    assert np.linalg.eigvalsh(information)[0] > 1e3


def test_what_fits_nowhere_says_nothing() -> None:
    away = wall_information(drawn(True), corner(True), Pose2(50.0, 0.0, 0.0))
    assert not away.any()
    beside = wall_information(drawn(True), corner(True), Pose2(0.5, 0.5, 0.0))
    assert np.trace(beside) < 0.2 * np.trace(wall_information(drawn(True), corner(True), IDENTITY))


def test_few_points_and_rough_things_are_no_walls() -> None:
    few = np.full(181, 8.0, np.float32)
    few[90:93] = 2.0
    rough = np.where(np.arange(181) % 2, 1.0, 1.3).astype(np.float32)
    for ranges in (few, rough):
        scan = LaserScan(ranges, -math.pi / 2, STEP, 8.0, 0.0)
        map_ = MatchMap()
        map_.insert(scan, IDENTITY)
        assert not wall_information(map_, scan, IDENTITY).any()
