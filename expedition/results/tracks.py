"""Trajectories as tables: (n, 4) rows of stamp [s], x, y [m], theta [rad]."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry import Floats, Pose2


def as_track(track: Floats | None) -> Floats:
    """Return `track` as a table (n, 4), without rows that are not finite."""
    if track is None:
        return np.empty((0, 4))
    table = np.asarray(track, dtype=np.float64).reshape(-1, 4)
    return table[np.isfinite(table).all(axis=1)]


def path_length(track: Floats | None) -> float:
    """Return the length [m] of the way along `track`."""
    steps = np.diff(as_track(track)[:, 1:3], axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def at_stamps(track: Floats, stamps: Floats) -> Floats:
    """Return `track` interpolated at `stamps` (n,), angles the short way; ends are held.

    An empty track has no poses at any time: the result is empty, too.
    """
    table = as_track(track)
    if len(table) == 0:
        return table
    table = table[np.argsort(table[:, 0], kind="stable")]
    theta = np.interp(stamps, table[:, 0], np.unwrap(table[:, 3]))
    return np.column_stack(
        (
            stamps,
            np.interp(stamps, table[:, 0], table[:, 1]),
            np.interp(stamps, table[:, 0], table[:, 2]),
            np.arctan2(np.sin(theta), np.cos(theta)),
        )
    )


def mapped(T_a_b: Pose2, track_b: Floats) -> Floats:
    """Return a track of frame b in frame a."""
    table = as_track(track_b).copy()
    table[:, 1:3] = T_a_b.apply(table[:, 1:3])
    theta = table[:, 3] + T_a_b.theta
    table[:, 3] = np.arctan2(np.sin(theta), np.cos(theta))
    return table


def thinned(track: Floats, tolerance: float) -> Floats:
    """Return the rows of `track` that a drawing needs.

    Left out is every pose from which the line between its kept neighbours stays within `tolerance`
    [m]. First and last pose stay.

    Source: Reumann & Witkam 1974, the strip algorithm: linear time, good enough for pictures.
    """
    table = as_track(track)
    if len(table) < 3:
        return table
    points: list[tuple[float, float]] = [(x, y) for x, y in table[:, 1:3].tolist()]
    keep = [0]
    ahead: tuple[float, float] | None = None  # the strip's direction from the last kept point
    farthest = 0.0
    for i in range(1, len(points)):
        x0, y0 = points[keep[-1]]
        dx, dy = points[i][0] - x0, points[i][1] - y0
        if ahead is not None:
            along = dx * ahead[0] + dy * ahead[1]
            off = abs(dx * ahead[1] - dy * ahead[0])
            if off <= tolerance and along >= farthest - tolerance:
                farthest = max(farthest, along)
                continue
            keep.append(i - 1)
            dx, dy = points[i][0] - points[i - 1][0], points[i][1] - points[i - 1][1]
        length = math.hypot(dx, dy)
        ahead = (dx / length, dy / length) if length > tolerance else None
        farthest = length
    keep.append(len(points) - 1)
    return table[keep]
