"""Where teammates are by now."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import Pose2
from robot_agent.right_of_way import Teammate
from robot_agent.sightings import TeammateTracks


def mate(x: float, stamp: float, path: list[tuple[float, float]] = (), theta: float = 0.0):
    return Teammate("b", Pose2(x, 0.0, theta), stamp, 0.25, np.array(path).reshape(-1, 2), True)


def test_one_heard_of_once_stands_where_it_was() -> None:
    (seen,) = TeammateTracks(5.0).sightings(1.0, [mate(2.0, 0.5)])
    assert (seen.x, seen.y, seen.vx, seen.vy) == (2.0, 0.0, 0.0, 0.0)
    assert seen.stays and not seen.silent and seen.stands_since == 0.5


def test_a_moving_one_is_carried_on_along_its_path() -> None:
    tracks = TeammateTracks(5.0)
    tracks.sightings(0.0, [mate(0.0, 0.0)])
    path = [(0.0, 0.0), (0.7, 0.0), (0.7, 1.0)]
    (seen,) = tracks.sightings(1.8, [mate(0.5, 1.0, path)])
    assert (seen.x, seen.y) == pytest.approx((0.7, 0.2))
    assert (seen.vx, seen.vy) == pytest.approx((0.0, 0.5))
    assert np.allclose(seen.path_map, [(0.7, 0.2), (0.7, 1.0)])
    assert not seen.stays


def test_carrying_on_ends_with_the_path_and_after_a_while() -> None:
    tracks = TeammateTracks(5.0)
    tracks.sightings(0.0, [mate(0.0, 0.0)])
    last = mate(0.5, 1.0, [(0.8, 0.0)])
    assert tracks.sightings(3.0, [last])[0].x == pytest.approx(0.8)
    away = mate(1.0, 2.0, [(9.0, 0.0)])
    tracks.sightings(2.0, [away])
    assert tracks.sightings(6.0, [away])[0].x == pytest.approx(1.5)


def test_without_a_path_it_goes_on_as_it_looks() -> None:
    tracks = TeammateTracks(5.0)
    tracks.sightings(0.0, [mate(0.0, 0.0)])
    (seen,) = tracks.sightings(1.4, [mate(0.0, 1.0, theta=0.0)])
    assert seen.vx == 0.0
    (seen,) = tracks.sightings(2.4, [mate(0.5, 2.0, theta=math.pi / 2)])
    assert (seen.x, seen.y) == pytest.approx((0.5, 0.2)) and seen.stays


def test_the_silent_are_obstacles() -> None:
    tracks = TeammateTracks(5.0)
    tracks.sightings(0.0, [mate(0.0, 0.0)])
    last = mate(0.5, 1.0, [(0.5, 0.0), (9.0, 0.0)])
    (seen,) = tracks.sightings(6.5, [last])
    assert seen.silent and seen.stays and (seen.x, seen.vx) == (0.5, 0.0)


def test_since_when_it_stands() -> None:
    tracks = TeammateTracks(50.0)
    for stamp, x, since in ((0.0, 0.0, 0.0), (1.0, 0.2, 0.0), (2.0, 0.5, 2.0), (9.0, 0.6, 2.0)):
        assert tracks.sightings(stamp, [mate(x, stamp)])[0].stands_since == since
    # The same stamp told twice changes no speed.
    assert tracks.sightings(9.0, [mate(0.6, 9.0)])[0].vx == 0.0


def test_order_is_by_name() -> None:
    others = [Teammate(name, Pose2(0, 0, 0), 0.0, 0.25, np.empty((0, 2)), False) for name in "cab"]
    seen = TeammateTracks(5.0).sightings(0.0, others)
    assert [s.teammate.name for s in seen] == ["a", "b", "c"]
