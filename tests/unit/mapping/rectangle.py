"""A lidar in a rectangular room, by plain geometry: what the estimators are tested against."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan


def rectangle_scan(
    T_room_base: Pose2,
    *,
    width: float = 4.0,
    height: float = 3.0,
    beams: int = 61,
    field_of_view: float = 2.0 * math.pi,
    range_max: float = 8.0,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
    T_base_laser: Pose2 = IDENTITY,
) -> LaserScan:
    """Return a scan taken inside the room 0 <= x <= width, 0 <= y <= height."""
    T_room_laser = T_room_base @ T_base_laser
    start, step = -0.5 * field_of_view, field_of_view / beams
    ranges = np.empty(beams)
    for i in range(beams):
        angle = T_room_laser.theta + start + i * step
        c, s = math.cos(angle), math.sin(angle)
        along_x = ((width if c > 0 else 0.0) - T_room_laser.x) / c if abs(c) > 1e-9 else 1e9
        along_y = ((height if s > 0 else 0.0) - T_room_laser.y) / s if abs(s) > 1e-9 else 1e9
        ranges[i] = min(along_x, along_y)
    hits = ranges < range_max
    if rng is not None:
        ranges[hits] += noise * rng.standard_normal(int(hits.sum()))
    measured = np.minimum(ranges, range_max).astype(np.float32)
    return LaserScan(measured, start, step, range_max, 0.0, T_base_laser)


def corridor_scan(T_map_base: Pose2, *, half_width: float = 1.0, beams: int = 61) -> LaserScan:
    """Return a scan in a corridor along x that never ends; walls at y = +- half_width."""
    return rectangle_scan(
        Pose2(T_map_base.x + 500.0, T_map_base.y + half_width, T_map_base.theta),
        width=1000.0,
        height=2.0 * half_width,
        beams=beams,
        range_max=4.0,
    )
