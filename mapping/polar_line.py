"""A straight wall as a laser sees it: 1/range is linear in cosine and sine of the bearing.

A line is m = (m_x, m_y) with m . p = 1 for all its points p [m], in the laser's frame turned to the
first beam. It is estimated by a Kalman filter with one reading at a time. Only + - * / and sqrt are
used: see `normal_table` for why.

A line is kept as one row of an array, (LINE,); the constants here say what is where.
"""

from __future__ import annotations

import math

from mapping.compiled import compiled
from mapping.geometry import Floats

WEIGHT, MX, MY, PXX, PXY, PYY, BEAMS, RANGE, SPREAD = 0, 1, 2, 3, 4, 5, 6, 7, 8
LINE = 9
"""Weight, m and its covariance, beams that shaped it, predicted range [m] and its spread [m]."""

# A wall at a right angle to one that is met head-on is seen edgeways: no steeper than this.
_HEAD_ON = 0.02
# No wall begins steeper, nor is a slope less certain: no bytes, however made up, get out of hand.
_STEEPEST = 1000.0
_NOWHERE = 1e-12


@compiled
def predict(line: Floats, c: float, s: float, variance: float, farthest: float) -> None:
    """Put into `line` the range that it predicts, and the standard deviation of a reading there.

    Args:
        line: (LINE,).
        c: cosine of the bearing.
        s: its sine.
        variance: of the range noise [m2].
        farthest: a line that is met farther away, or never, is taken to be there [m].
    """
    inverse = max(c * line[MX] + s * line[MY], 1.0 / farthest)
    spread = c * c * line[PXX] + 2.0 * c * s * line[PXY] + s * s * line[PYY]
    square = 1.0 / (inverse * inverse)
    line[RANGE] = 1.0 / inverse
    total = variance + square * square * max(spread, 0.0)
    line[SPREAD] = math.sqrt(min(total, farthest * farthest))


@compiled
def observe(line: Floats, c: float, s: float, reading: float, variance: float) -> None:
    """Correct `line` by a reading [m] on it, after `predict` for the same beam."""
    # The geometric mean of both ranges keeps the innovation, in sigmas, that of the ranges.
    inverse_square = 1.0 / (reading * line[RANGE])
    innovation = (line[RANGE] - reading) * inverse_square
    across_x = line[PXX] * c + line[PXY] * s
    across_y = line[PXY] * c + line[PYY] * s
    total = max(c * across_x + s * across_y, 0.0) + variance * inverse_square * inverse_square
    gain_x, gain_y = across_x / total, across_y / total
    line[MX] += gain_x * innovation
    line[MY] += gain_y * innovation
    line[PXX] = max(line[PXX] - gain_x * across_x, 0.0)
    line[PYY] = max(line[PYY] - gain_y * across_y, 0.0)
    most = math.sqrt(line[PXX] * line[PYY])
    line[PXY] = min(max(line[PXY] - gain_x * across_y, -most), most)
    line[BEAMS] += 1.0


@compiled
def set_line(
    line: Floats,
    weight: float,
    c: float,
    s: float,
    inverse: tuple[float, float],
    slope: tuple[float, float],
) -> None:
    """Make `line` one through a point, with a slope, both uncertain.

    Args:
        line: (LINE,), written.
        weight: its weight.
        c: cosine of the bearing of the point.
        s: its sine.
        inverse: 1 / range of the point [1/m] and the variance of that.
        slope: by which share of itself 1 / range grows with the bearing [1/rad]: the tangent of the
            angle of incidence; and its variance.
    """
    q, q_variance = inverse
    t, t_variance = slope
    along_x, along_y = c - t * s, s + t * c
    turn = q * q * t_variance
    line[WEIGHT] = weight
    line[MX], line[MY] = q * along_x, q * along_y
    line[PXX] = q_variance * along_x * along_x + turn * s * s
    line[PXY] = q_variance * along_x * along_y - turn * s * c
    line[PYY] = q_variance * along_y * along_y + turn * c * c
    line[BEAMS] = 0.0


@compiled
def inverse_at(line: Floats, c: float, s: float, farthest: float) -> tuple[float, float]:
    """Return 1 / range [1/m] of a line at a bearing, and its variance; that is bounded."""
    variance = c * c * line[PXX] + 2.0 * c * s * line[PXY] + s * s * line[PYY]
    inverse = max(c * line[MX] + s * line[MY], 1.0 / farthest)
    return inverse, min(max(variance, 0.0), inverse * inverse)


@compiled
def slope_at(line: Floats, c: float, s: float) -> tuple[float, float]:
    """Return the slope that the direction of a line has at a bearing, and its variance.

    It is met there or not: a wall on the other side has the slope of one parallel to it on this.
    """
    along = c * line[MX] + s * line[MY]
    across = c * line[MY] - s * line[MX]
    least = max(abs(across) / _STEEPEST, _NOWHERE)
    if abs(along) < least:
        along = least if along >= 0.0 else -least
    slope = across / along
    square = max(line[MX] * line[MX] + line[MY] * line[MY], _NOWHERE)
    turning = (
        line[MY] * line[MY] * line[PXX]
        - 2.0 * line[MX] * line[MY] * line[PXY]
        + line[MX] * line[MX] * line[PYY]
    )
    by_angle = 1.0 + slope * slope
    return slope, by_angle * by_angle * max(turning, 0.0) / (square * square)


@compiled
def turned(slope: tuple[float, float], quarter: bool, doubt: float) -> tuple[float, float]:
    """Return the slope of a wall parallel, or at a right angle, to one, at the same bearing.

    Args:
        slope: of the one, and its variance.
        quarter: at a right angle.
        doubt: standard deviation of how far walls are from it [rad].
    """
    t, variance = slope
    if quarter:
        if abs(t) < _HEAD_ON:
            t = _HEAD_ON if t >= 0.0 else -_HEAD_ON
        variance = variance / (t * t * t * t)
        t = -1.0 / t
    t = min(max(t, -_STEEPEST), _STEEPEST)
    by_angle = (1.0 + t * t) * doubt
    return t, min(variance + by_angle * by_angle, _STEEPEST * _STEEPEST)
