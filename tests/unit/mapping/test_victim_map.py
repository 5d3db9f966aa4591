from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.victim_map import Sighting, Victim, find_victims, sighting_at

GATE = 1.0
LYING = ((0.0, 0.0), (6.0, 0.0), (6.0, 5.0))


def tour(seed: int, count: int = 30) -> list[Sighting]:
    """Sightings of three people by two robots."""
    rng = np.random.default_rng(seed)
    seen = []
    for k in range(count):
        x, y = LYING[int(rng.integers(3))]
        dx, dy = (0.15 * rng.standard_normal(2)).tolist()
        distance = float(rng.uniform(0.5, 5.0))
        seen.append(Sighting(f"robot{k % 2 + 1}", float(k // 2), x + dx, y + dy, distance))
    return seen


def test_nobody_was_seen() -> None:
    assert find_victims([], GATE) == ()


def test_a_sighting_lies_where_pose_and_point_say() -> None:
    seen = sighting_at("robot1", 2.5, Pose2(1.0, 2.0, math.pi / 2), np.float32([3.0, 4.0]))
    assert (seen.robot, seen.stamp) == ("robot1", 2.5)
    assert (seen.x, seen.y, seen.distance) == pytest.approx((-3.0, 5.0, 5.0))


def test_who_saw_a_victim_first_when_and_how_often() -> None:
    seen = [
        Sighting("robot2", 7.0, 0.2, 0.0),
        Sighting("robot1", 5.0, 9.0, 9.0),
        Sighting("robot1", 3.0, 0.0, 0.0),
    ]
    first, second = find_victims(seen, GATE)
    assert (first.x, first.y) == pytest.approx((0.1, 0.0))
    assert (first.seen_by, first.first_seen, first.sightings) == ("robot1", 3.0, 2)
    assert second == Victim(9.0, 9.0, "robot1", 5.0, 1)


def test_sightings_from_afar_count_less() -> None:
    near, far = Sighting("a", 1.0, 0.0, 0.0, 0.5), Sighting("b", 2.0, 0.8, 0.0, 8.0)
    (victim,) = find_victims([near, far], GATE)
    assert 0.0 < victim.x < 0.1


def test_victims_that_grow_together_are_one() -> None:
    """Two beginnings just out of the gate of each other, and what is between them."""
    places = (0.0, 1.02, 0.3, 0.5, 0.7, 0.5)
    seen = [Sighting("a", float(k), x, 0.0) for k, x in enumerate(places)]
    (victim,) = find_victims(seen, GATE)
    assert (victim.first_seen, victim.sightings) == (0.0, 6)
    assert victim.x == pytest.approx(sum(places) / 6)


def test_corrected_poses_move_the_victims() -> None:
    before = [sighting_at("a", 1.0, Pose2(0.0, 0.0, 0.0), [2.0, 0.0])]
    after = [sighting_at("a", 1.0, Pose2(5.0, 0.0, 0.0), [2.0, 0.0])]
    assert find_victims(before, GATE)[0].x == 2.0
    assert find_victims(after, GATE)[0].x == 7.0


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 1000), st.randoms(use_true_random=False))
def test_all_who_hold_the_same_sightings_find_the_same_victims(seed: int, shuffle) -> None:
    seen = tour(seed)
    other = [*seen, *seen[:7]]
    shuffle.shuffle(other)
    assert find_victims(other, GATE) == find_victims(seen, GATE)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 1000))
def test_people_who_lie_far_apart_are_all_found_where_they_lie(seed: int) -> None:
    seen = tour(seed, 60)
    victims = find_victims(seen, GATE)
    assert sum(victim.sightings for victim in victims) == 60
    assert len(victims) == 3
    for x, y in LYING:
        assert min(math.hypot(v.x - x, v.y - y) for v in victims) < 0.2
    assert [v.first_seen for v in victims] == sorted(v.first_seen for v in victims)
