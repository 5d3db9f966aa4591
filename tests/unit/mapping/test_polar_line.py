from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.polar_line import (
    BEAMS,
    LINE,
    MX,
    MY,
    PXX,
    PXY,
    PYY,
    RANGE,
    SPREAD,
    inverse_at,
    observe,
    predict,
    set_line,
    slope_at,
    turned,
)

FAR = 40.0
SIGMA = 0.03


def wall_range(bearing: float, normal: float = 0.4, distance: float = 2.0) -> float:
    return distance / math.cos(bearing - normal)


def seen(beams: int, noise: float = 0.0, seed: int = 1) -> np.ndarray:
    """A line shaped by beams a degree apart on one wall."""
    rng = np.random.default_rng(seed)
    line = np.zeros(LINE)
    first = 1.0 / wall_range(0.0)
    set_line(line, 1.0, 1.0, 0.0, (first, (SIGMA * first**2) ** 2), (0.0, 4.0))
    for i in range(1, beams):
        c, s = math.cos(math.radians(i)), math.sin(math.radians(i))
        predict(line, c, s, SIGMA**2, FAR)
        reading = wall_range(math.radians(i)) + noise * rng.standard_normal()
        observe(line, c, s, reading, SIGMA**2)
    return line


def test_a_line_through_a_point_predicts_it_with_its_doubt():
    line = np.zeros(LINE)
    set_line(line, 1.0, 1.0, 0.0, (0.5, 0.01**2), (0.3, 1.0))
    predict(line, 1.0, 0.0, SIGMA**2, FAR)
    assert line[RANGE] == pytest.approx(2.0)
    assert line[SPREAD] == pytest.approx(math.hypot(SIGMA, 0.01 * 4.0))
    assert inverse_at(line, 1.0, 0.0, FAR) == pytest.approx((0.5, 0.01**2))
    assert slope_at(line, 1.0, 0.0)[0] == pytest.approx(0.3)


def test_a_wall_is_foretold_after_some_beams():
    line = seen(30)
    bearing = math.radians(31.0)
    predict(line, math.cos(bearing), math.sin(bearing), SIGMA**2, FAR)
    assert line[RANGE] == pytest.approx(wall_range(bearing), abs=0.005)
    assert line[BEAMS] == 29
    assert slope_at(line, 1.0, 0.0)[0] == pytest.approx(math.tan(0.4), abs=0.02)


def test_the_spread_is_that_of_the_readings():
    bearing = math.radians(20.0)
    c, s = math.cos(bearing), math.sin(bearing)
    offs = []
    for seed in range(200):
        line = seen(20, SIGMA, seed)
        predict(line, c, s, SIGMA**2, FAR)
        noise = SIGMA * np.random.default_rng(1000 + seed).standard_normal()
        offs.append((wall_range(bearing) + noise - line[RANGE]) / line[SPREAD])
    assert 0.8 < float(np.std(offs)) < 1.2


def test_a_wall_never_met_is_as_far_as_can_be():
    line = seen(10)
    predict(line, math.cos(2.5), math.sin(2.5), SIGMA**2, FAR)
    assert line[RANGE] == pytest.approx(FAR)
    assert line[SPREAD] <= FAR


@pytest.mark.parametrize("slope", [0.7, -2.0])
def test_turned_by_a_right_angle_and_parallel(slope):
    square, _ = turned((slope, 0.01), True, 0.01)
    assert math.atan(slope) - math.atan(square) == pytest.approx(math.copysign(math.pi / 2, slope))
    same, variance = turned((slope, 0.01), False, 0.01)
    assert same == slope
    assert variance == pytest.approx(0.01 + (0.01 * (1 + slope**2)) ** 2)


@pytest.mark.parametrize("slope", [0.0, -1e-9, 1e-9])
def test_a_wall_seen_edgeways_is_steep_within_reason(slope):
    square, variance = turned((slope, 1.0), True, 0.01)
    assert abs(square) == pytest.approx(50.0)
    assert math.isfinite(variance)


def test_a_wall_behind_has_the_slope_of_one_in_front():
    line = np.zeros(LINE)
    set_line(line, 1.0, 1.0, 0.0, (0.5, 1e-4), (0.3, 1e-4))
    ahead, behind = slope_at(line, 0.8, 0.6), slope_at(line, -0.8, -0.6)
    assert ahead == pytest.approx(behind)
    # Seen edgeways, and for a line that is none.
    normal = np.array([line[MX], line[MY]]) / np.hypot(line[MX], line[MY])
    for c, s in ((-normal[1], normal[0]), (normal[1], -normal[0])):
        assert 999.0 < abs(slope_at(line, c, s)[0]) < math.inf
    line[:] = 0.0
    assert np.isfinite(slope_at(line, 1.0, 0.0)).all()


def test_nothing_gets_out_of_hand():
    line = seen(5)
    line[[PXX, PXY, PYY]] = 1e30, -2e30, 1e30
    predict(line, 0.6, 0.8, SIGMA**2, FAR)
    observe(line, 0.6, 0.8, 1e-4, SIGMA**2)
    assert np.isfinite(line).all()
    assert line[PXY] ** 2 <= line[PXX] * line[PYY] * (1.0 + 1e-9)
    assert np.isfinite([line[MX], line[MY]]).all()
    slope, variance = turned(slope_at(line, 0.6, 0.8), False, 0.01)
    assert abs(slope) <= 1000.0
    assert variance <= 1e6
