"""Who saw whom at the start."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.mutual_sightings import MutualSightings

NONE = np.zeros((3, 3))


def look(starts: dict[str, Pose2], sees: Mapping[str, Sequence[str]]) -> MutualSightings:
    """What robots see of each other: `sees` has the names of the others."""
    sightings = MutualSightings()
    for name, seen in sees.items():
        T_odom_map = starts[name].inverse()
        places = [T_odom_map.apply((starts[other].x, starts[other].y)) for other in seen]
        for _ in range(2):
            sightings.add(name, IDENTITY, NONE, np.array(places).reshape(-1, 2))
    return sightings


def told(starts: dict[str, Pose2]) -> dict[str, Pose2]:
    """The same starts a good deal off."""
    offsets = [(0.9, -0.8, 0.3), (-0.7, 0.9, -0.25), (0.5, 0.6, 0.2)]
    return {
        name: Pose2(pose.x + dx, pose.y + dy, pose.theta + turn)
        for (name, pose), (dx, dy, turn) in zip(starts.items(), offsets, strict=False)
    }


def assert_true(sightings: MutualSightings, starts: dict[str, Pose2], count: int) -> None:
    relations = sightings.relations(told(starts), 3.0, 0.7)
    assert len(relations) == count
    for (a, b), relation in relations.items():
        true = starts[a].inverse() @ starts[b]
        assert relation.T_a_b.distance_to(true) < 1e-6
        assert math.remainder(relation.T_a_b.theta - true.theta, math.tau) == pytest.approx(0.0)
        assert np.linalg.eigvalsh(relation.covariance)[0] > 0.0


def test_two_that_see_each_other_are_related() -> None:
    starts = {"a": Pose2(2.0, 2.0, 0.7), "b": Pose2(2.8, 2.0, -0.2)}
    assert_true(look(starts, {"a": "b", "b": "a"}), starts, 2)


def test_three_in_a_row_do_not_take_the_outer_two_for_neighbours() -> None:
    starts = {"a": Pose2(10.0, 1.0, 1.6), "b": Pose2(10.8, 1.0, 1.6), "c": Pose2(9.2, 1.0, 1.6)}
    assert_true(look(starts, {"a": "bc", "b": "a", "c": "a"}), starts, 4)


def test_three_in_a_triangle_are_told_apart() -> None:
    starts = {"a": Pose2(2.0, 2.0, 0.8), "b": Pose2(2.8, 2.0, 0.8), "c": Pose2(2.0, 2.8, 0.8)}
    assert_true(look(starts, {"a": "bc", "b": "ac", "c": "ab"}), starts, 6)


def test_one_sided_sightings_relate_nobody() -> None:
    starts = {"a": Pose2(0.0, 0.0, 0.0), "b": Pose2(1.0, 0.0, 0.0)}
    assert_true(look(starts, {"a": "b", "b": ""}), starts, 0)
    assert_true(look(starts, {"a": "b"}), starts, 0)


def test_what_can_be_explained_in_two_ways_is_not_explained() -> None:
    starts = {"a": Pose2(0.0, 0.0, 0.0), "b": Pose2(1.0, 0.0, 0.0)}
    sightings = look(starts, {"a": "b", "b": "a"})
    for _ in range(2):
        sightings.add("a", IDENTITY, NONE, np.array([[math.cos(0.3), math.sin(0.3)]]))
    assert sightings.relations(starts, 3.0, 0.7) == {}


def test_what_was_told_rules_out_what_is_too_far_off() -> None:
    starts = {"a": Pose2(0.0, 0.0, 0.0), "b": Pose2(1.0, 0.0, 0.0)}
    sightings = look(starts, {"a": "b", "b": "a"})
    far = {"a": IDENTITY, "b": Pose2(9.0, 0.0, 0.0)}
    turned = {"a": IDENTITY, "b": Pose2(1.0, 0.0, 2.0)}
    assert sightings.relations(far, 3.0, 0.7) == {}
    assert sightings.relations(turned, 3.0, 0.7) == {}


def test_only_sightings_from_the_start_count() -> None:
    starts = {"a": Pose2(0.0, 0.0, 0.0), "b": Pose2(1.0, 0.0, 0.0)}
    sightings = look(starts, {"b": "a"})
    sightings.add("a", IDENTITY, NONE, np.zeros((0, 2)))
    for _ in range(3):
        sightings.add("a", Pose2(2.0, 0.0, 0.0), NONE, np.array([[1.0, 0.0]]))
    assert sightings.relations(starts, 3.0, 0.7) == {}
    sightings = look(starts, {"a": "b", "b": "a"})
    sightings.forget("a")
    assert sightings.relations(starts, 3.0, 0.7) == {}


def test_who_sees_discs_everywhere_relates_to_nobody() -> None:
    sightings = MutualSightings()
    ring = [[math.cos(k / 6), math.sin(k / 6)] for k in range(40)]
    for name in ("a", "b"):
        for _ in range(2):
            sightings.add(name, IDENTITY, NONE, np.array(ring))
    starts = {"a": Pose2(0.0, 0.0, 0.0), "b": Pose2(1.0, 0.0, 0.0)}
    assert sightings.relations(starts, 3.0, 0.7) == {}


def crowd(jitter: float, seed: int) -> dict[str, Pose2]:
    """Ten robots, two by two, about 0.8 m apart."""
    rng = np.random.default_rng(seed)
    places = [(0.8 * (k % 4), 0.8 * (k // 4)) for k in range(10)]
    return {
        f"robot{k}": Pose2(x + dx, y + dy, 0.0)
        for k, ((x, y), (dx, dy)) in enumerate(
            zip(places, rng.uniform(-jitter, jitter, (10, 2)), strict=True)
        )
    }


def in_view(starts: dict[str, Pose2], name: str) -> list[str]:
    """Whom a robot sees: those that nobody stands in front of."""
    here = starts[name]
    bearings = {}
    for other, pose in starts.items():
        if other != name:
            away = here.distance_to(pose)
            bearings[other] = (away, math.atan2(pose.y - here.y, pose.x - here.x))
    return [
        other
        for other, (away, bearing) in bearings.items()
        if all(
            nearer >= away or abs(math.remainder(bearing - in_front, math.tau)) > 0.25 / nearer
            for nearer, in_front in bearings.values()
        )
    ]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_ten_that_stand_close_are_told_apart_or_left_alone(jitter: float, seed: int) -> None:
    starts = crowd(jitter, seed)
    sightings = look(starts, {name: in_view(starts, name) for name in starts})
    rng = np.random.default_rng(seed)
    errors = rng.uniform(-1.0, 1.0, (10, 3)) * (1.0, 1.0, math.radians(20.0))
    told = {
        name: Pose2(pose.x + dx, pose.y + dy, turn)
        for (name, pose), (dx, dy, turn) in zip(starts.items(), errors.tolist(), strict=True)
    }
    relations = sightings.relations(told, 3.0, 2.0 * math.radians(20.0))
    for (a, b), relation in relations.items():
        assert relation.T_a_b.distance_to(starts[a].inverse() @ starts[b]) < 1e-6
    if jitter:
        assert len({a for a, _ in relations}) == 10


def test_what_a_robot_tells_that_it_saw_is_taken_as_if_it_had_been_seen_here() -> None:
    starts = {"a": Pose2(2.0, 2.0, 0.7), "b": Pose2(2.8, 2.0, -0.2)}
    mine = look(starts, {"a": "b"})
    theirs = look(starts, {"b": "a"}).lookout("b")
    assert theirs is not None and mine.lookout("b") is None
    mine.put("b", theirs.place_odom, theirs.turn_variance, theirs.discs)
    assert_true(mine, starts, 2)
