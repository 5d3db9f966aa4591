"""Robots are placed by what they saw of each other, also by way of others."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from mapping.geometry import Pose2
from mapping.placed_by_sight import seen_by_others
from tests.unit.seen_starts import ERRORS, STARTS, sightings, told_start


@dataclass(frozen=True)
class Frame:
    T_map_odom: Pose2
    told: tuple[float, float]
    aligned: bool


def frame(name: str, aligned: bool) -> Frame:
    told = told_start(name, exactly=aligned)
    return Frame(told, ERRORS, aligned)


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
