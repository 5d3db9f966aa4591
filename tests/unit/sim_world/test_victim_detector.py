from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from protocol.body import VictimDetector
from sim_world.scene import WallScene
from sim_world.victim_detector import DetectorSpec, detect, detector_of
from sim_world.walls import build_walls

# A room of 10 m by 10 m with a wall from (5, 0) to (5, 6).
ROOM = WallScene(
    build_walls([], [[0, 0, 10, 0], [10, 0, 10, 10], [10, 10, 0, 10], [0, 10, 0, 0], [5, 0, 5, 6]])
)
EXACT = DetectorSpec(6.0, math.radians(45.0), 0.0, 0.0, 0.0)


def seen(T_world_base: Pose2, *victims: tuple[float, float], spec: DetectorSpec = EXACT) -> list:
    places = np.array(victims, dtype=np.float64).reshape(-1, 2)
    return detect(T_world_base, ROOM, places, spec, np.random.default_rng(1)).tolist()


def test_a_body_has_no_detector_unless_it_is_given_a_range() -> None:
    assert detector_of(VictimDetector()) is None
    spec = detector_of(VictimDetector(range_m=5.0, field_of_view_deg=60.0, noise_bearing_deg=3.0))
    assert spec == DetectorSpec(5.0, math.radians(30.0), 0.2, 0.05, math.radians(3.0))


def test_places_are_told_in_the_base_frame_nearest_first() -> None:
    told = seen(Pose2(1.0, 2.0, math.pi / 2), (1.0, 6.0), (0.5, 4.0))
    assert np.allclose(told, [[2.0, 0.5], [4.0, 0.0]], atol=1e-6)


@pytest.mark.parametrize("victim", [(7.5, 2.0), (6.0, 2.0), (0.5, 2.0), (1.5, 4.0)])
def test_nobody_is_seen_out_of_reach_behind_walls_or_beside_the_view(victim) -> None:
    assert seen(Pose2(1.0, 2.0, 0.0), victim) == []


def test_who_looks_past_the_wall_sees_who_lies_behind_it() -> None:
    assert len(seen(Pose2(3.0, 8.0, 0.0), (7.0, 7.5))) == 1


def test_without_victims_there_is_nothing_to_see() -> None:
    assert detect(
        Pose2(1, 1, 0), ROOM, np.empty((0, 2)), EXACT, np.random.default_rng(1)
    ).shape == (
        0,
        2,
    )


def test_noise_and_oversights_are_as_stated() -> None:
    spec = DetectorSpec(6.0, math.pi, 0.3, 0.05, math.radians(2.0))
    victims = np.tile([[4.0, 2.0]], (4000, 1))
    told = detect(Pose2(1.0, 2.0, 0.0), ROOM, victims, spec, np.random.default_rng(2))
    assert len(told) / 4000 == pytest.approx(0.7, abs=0.03)
    distances, bearings = np.hypot(*told.T), np.arctan2(told[:, 1], told[:, 0])
    assert distances.mean() == pytest.approx(3.0, abs=0.02)
    assert distances.std() == pytest.approx(0.15, rel=0.1)
    assert bearings.std() == pytest.approx(math.radians(2.0), rel=0.1)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.5, 4.5), st.floats(0.5, 9.5), st.floats(-3.0, 3.0), st.floats(0.0, 8.0))
def test_the_same_draws_whatever_is_seen(x: float, y: float, theta: float, reach: float) -> None:
    victims = np.array([[2.0, 2.0], [8.0, 3.0], [6.0, 8.0]])
    one, other = np.random.default_rng(3), np.random.default_rng(3)
    detect(Pose2(x, y, theta), ROOM, victims, replace(EXACT, range_max=reach, miss=0.5), one)
    detect(Pose2(1.0, 1.0, 0.0), ROOM, victims, EXACT, other)
    assert one.random() == other.random()
