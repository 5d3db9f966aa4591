"""Small logs for tests of their readers."""

from __future__ import annotations

from functools import cache

import numpy as np


def flaser(k: int, beams: int = 180, stamp: float | None = None, x: float | None = None) -> str:
    """Return the k-th FLASER line of a robot that drives straight ahead at 1 m/s, 5 Hz."""
    x = 0.2 * k if x is None else x
    stamp = 1000.0 + 0.2 * k if stamp is None else stamp
    pose = f"{x:.6f} 0.500000 0.100000"
    return (
        f"FLASER {beams} {_ranges(k, beams)} {pose} {pose} {stamp:.6f} nohost {stamp - 1000.0:.6f}"
    )


@cache
def _ranges(k: int, beams: int) -> str:
    ranges = 2.0 + np.random.default_rng(k).uniform(0.0, 6.0, beams)
    return " ".join(f"{value:.2f}" for value in ranges)


def robotlaser(
    readings: str = "1.0 2.0 81.83",
    maximum: str = "81.91",
    laser: str = "1.1 2.0 0.0",
    robot: str = "1.0 2.0 0.0",
    remissions: str = "0",
) -> str:
    """Return a ROBOTLASER1 line."""
    return (
        f"ROBOTLASER1 0 -0.5 1.0 0.5 {maximum} 0.01 0 {len(readings.split())} {readings} "
        f"{remissions} {laser} {robot} 0.3 0.0 0.4 0.4 1e6 1000.5 nohost 0.5"
    )


def log(count: int) -> list[str]:
    """Return a whole small log."""
    return ["# a comment", *(flaser(k) for k in range(count))]
