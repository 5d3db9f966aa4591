"""Made-up observations and changes of mind of two robots."""

from __future__ import annotations

from typing import Any

import numpy as np


def observation(t_s: float, robot: str, number: int, x: float) -> dict[str, Any]:
    return {
        "t_s": t_s,
        "robot": robot,
        "number": number,
        "ranges": np.array([1.0, 2.0, 3.0], dtype=np.float32),
        "pose": np.array([x, 0.0, 0.0]),
        "bearing_start": -0.1,
        "bearing_step": 0.1,
        "range_max": 20.0,
    }


def repositioning(t_s: float, robot: str, xs: list[float]) -> dict[str, Any]:
    return {"t_s": t_s, "robot": robot, "poses": np.array([(x, 1.0, 0.0) for x in xs])}


SEEN = [
    observation(1.0, "ada", 0, 10.0),
    observation(1.0, "bob", 0, 20.0),
    observation(2.0, "ada", 1, 11.0),
    observation(3.0, "bob", 1, 21.0),
]
