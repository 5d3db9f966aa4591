from __future__ import annotations

import math

import numpy as np
import pytest

from expedition.experiments.scan_entropy import noise_bytes, scan_bytes


def test_the_noise_of_a_scan_takes_about_120_bytes() -> None:
    assert noise_bytes(361, 0.03, 0.02) == pytest.approx(118.8, abs=0.1)
    # One cell as wide as the spread leaves nothing to tell.
    assert noise_bytes(361, 1.0, math.sqrt(2.0 * math.pi * math.e)) == pytest.approx(0.0)


def test_scans_of_a_wall_take_a_little_more_than_their_noise() -> None:
    rng = np.random.default_rng(1)
    told = [
        {
            "t_s": float(k),
            "ranges": rng.normal(3.0, 0.03, 361).astype(np.float32),
            "bearing_start": -0.5 * math.pi,
            "bearing_step": math.pi / 360,
            "range_max": 20.0,
        }
        for k in range(5)
    ]
    row = scan_bytes(told, 0.03)
    assert row["entropy"] < row["scan"] < 1.6 * row["entropy"]
    assert scan_bytes([], 0.03) == {"scan": None, "entropy": None}
