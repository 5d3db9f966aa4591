"""Three robots in a row that see their neighbours from where they start, for tests."""

from __future__ import annotations

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from mapping.mutual_sightings import MutualSightings

STARTS = {"a": Pose2(0.0, 0.0, 0.0), "b": Pose2(1.0, 0.2, 0.3), "c": Pose2(2.2, -0.1, -0.2)}
SEES = {"a": "b", "b": "ac", "c": "b"}
ERRORS = (1.0, 0.35)


def told_start(name: str, exactly: bool) -> Pose2:
    """Where a robot was told that it starts: there, or somewhat beside it."""
    start = STARTS[name]
    return start if exactly else Pose2(start.x + 0.4, start.y - 0.3, start.theta + 0.2)


def sightings() -> MutualSightings:
    """What they saw of each other, twice."""
    seen = MutualSightings()
    for name, others in SEES.items():
        places = [STARTS[name].inverse().apply((STARTS[o].x, STARTS[o].y)) for o in others]
        for _ in range(2):
            seen.add(name, IDENTITY, np.zeros((3, 3)), np.array(places))
    return seen
