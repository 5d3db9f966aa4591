"""Robots are placed by what they saw of each other, also by way of others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.mutual_sightings import MutualSightings
from mapping.placed_by_sight import seen_by_others

STARTS = {"a": Pose2(0.0, 0.0, 0.0), "b": Pose2(1.0, 0.2, 0.3), "c": Pose2(2.2, -0.1, -0.2)}
SEES = {"a": "b", "b": "ac", "c": "b"}


@dataclass(frozen=True)
class Frame:
    T_map_odom: Pose2
    told: tuple[float, float]
    aligned: bool


def frame(name: str, aligned: bool) -> Frame:
    start = STARTS[name]
    told = start if aligned else Pose2(start.x + 0.4, start.y - 0.3, start.theta + 0.2)
    return Frame(told, (1.0, 0.35), aligned)


def sightings() -> MutualSightings:
    seen = MutualSightings()
    for name, others in SEES.items():
        places = [STARTS[name].inverse().apply((STARTS[o].x, STARTS[o].y)) for o in others]
        for _ in range(2):
            seen.add(name, IDENTITY, np.zeros((3, 3)), np.array(places))
    return seen


def test_a_robot_is_placed_by_one_that_is_not_tied_itself() -> None:
    frames = {name: frame(name, name == "a") for name in STARTS}
    near = seen_by_others("b", frames, sightings())
    far = seen_by_others("c", frames, sightings())
    assert near is not None and far is not None
    for name, relation in (("b", near), ("c", far)):
        assert relation.T_a_b.distance_to(STARTS[name]) == pytest.approx(0.0, abs=1e-9)
        assert relation.T_a_b.theta == pytest.approx(STARTS[name].theta)
    assert far.covariance[2, 2] > near.covariance[2, 2]
    assert far.covariance[1, 1] > near.covariance[1, 1]


def test_nobody_is_placed_where_nobody_is_tied() -> None:
    frames = {name: frame(name, aligned=False) for name in STARTS}
    assert seen_by_others("c", frames, sightings()) is None
