"""When a robot believes that it knows where its own map lies in the team's."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import IDENTITY, Pose2, wrap_angle
from mapping.grid import GridGeometry
from mapping.placed_by_sight import Guess
from protocol.messages import ScanReport
from protocol.world_messages import Joined
from robot_agent.decentral.alignment import Fit, Placed
from robot_agent.decentral.settings import TyingSettings
from robot_agent.decentral.tying import (
    Standing,
    Tying,
    Whereabouts,
    contradicts,
    doubts,
    is_taken,
    left_at,
    told_at_start,
)
from sim_world.scene import GridScene
from tests.unit.robot_agent.decentral.peer_rig import seen_by, sync_of
from tests.unit.rooms import room, scan_in

ROOM = room()
SEEN = [Pose2(0.2 * k, 0.1 * k, 0.3 * k) for k in range(5)]
SETTINGS = TyingSettings()
SURE = Fit(IDENTITY, 200, 0.97, 0.95, 0.01, 0.003, 0.2)


def corridor() -> GridScene:
    """A corridor without any door, 2 m wide, whose ends are out of sight from its middle."""
    solid = np.zeros((22, 400), dtype=np.bool_)
    solid[[0, -1], :] = True
    return GridScene(solid, GridGeometry(0.1, -20.0, -1.1, *solid.shape))


CORRIDOR = corridor()


def report(number: int, scene: GridScene, T_map_base: Pose2, T_map_own: Pose2) -> ScanReport:
    """What a robot that knows its own way exactly reports from a place."""
    scan = scan_in(scene, T_map_base, float(number))
    return ScanReport(
        number=number,
        stamp_s=scan.stamp,
        ranges=scan.ranges,
        bearing_start_rad=scan.bearing_start,
        bearing_step_rad=scan.bearing_step,
        range_max_m=scan.range_max,
        T_base_laser=scan.T_base_laser,
        T_odom_base=T_map_own.inverse() @ T_map_base,
        covariance=np.diag([1e-6, 1e-6, 1e-6]),
        track_odom=np.zeros((0, 4)),
    )


def seen(scene: GridScene, *poses: Pose2) -> list[Placed]:
    return [(scan_in(scene, pose), pose) for pose in poses]


def told(T_map_own: Pose2, place: float = 0.5, turn: float = math.radians(10.0)) -> Guess:
    return Whereabouts(T_map_own, (place, turn)).guess


def looked(scene: GridScene, T_map_own: Pose2, looks: int = 6) -> Tying:
    """One that turned on the spot where its own map begins."""
    tying = Tying(SETTINGS)
    for k in range(looks):
        turned = T_map_own @ Pose2(0.0, 0.0, wrap_angle(0.9 * k))
        tying.add(report(k + 1, scene, turned, T_map_own))
    return tying


def tries(
    tying: Tying,
    scans: list[Placed],
    *guesses: Guess,
    count: int = 2,
    mates: tuple[Standing, ...] = (),
) -> Pose2 | None:
    """What the last of some tries finds."""
    found = None
    for k in range(count):
        found = tying.attempt(scans, guesses, mates, 0.1, 7, float(k))
    return found


# --- the rules -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"points": 29}, "it saw too little"),
        ({"share": 0.84}, "walls are missing"),
        ({"known": 0.69}, "too little is known there"),
        ({"sigma": 0.04}, "it may be elsewhere along the walls"),
        ({"turn_sigma": 0.02}, "it may be turned"),
        ({"rival": 0.61}, "another place fits about as well"),
    ],
)
def test_each_doubt_has_a_name(change: dict[str, float], why: str) -> None:
    assert doubts(SURE, SETTINGS) == ()
    assert doubts(replace(SURE, **change), SETTINGS) == (why,)


def test_where_others_saw_it_walls_need_not_say_where_along_them_it_is() -> None:
    along = replace(SURE, sigma=0.09, known=0.3)
    assert len(doubts(along, SETTINGS)) == 2
    assert doubts(along, SETTINGS, seen=True) == ()
    assert doubts(replace(along, sigma=0.11), SETTINGS, seen=True) != ()


def test_no_two_robots_stand_in_one_place() -> None:
    mate = Standing(1.0, 1.0, 0.25)
    assert is_taken(Pose2(1.2, 1.0, 2.0), [mate])
    assert not is_taken(Pose2(1.3, 1.0, 2.0), [mate])
    assert doubts(SURE, SETTINGS, taken=True) == ("a teammate stands there",)


def test_only_what_is_known_contradicts() -> None:
    assert contradicts(replace(SURE, points=40, share=0.4), SETTINGS)
    assert contradicts(replace(SURE, points=0, share=0.0, known=0.8), SETTINGS)
    assert not contradicts(replace(SURE, points=0, share=0.0, known=0.0), SETTINGS)
    assert not contradicts(replace(SURE, points=5, share=0.4, known=0.1), SETTINGS)
    assert not contradicts(SURE, SETTINGS)


# --- where it is thought to be ------------------------------------------------------------------


def test_starts_are_told_with_both_errors_in_three_sigmas() -> None:
    joined = Joined(
        lockstep=True, now_s=0.0, step_s=0.1, start=SEEN[1], start_sigma_m=0.9, start_sigma_deg=9.0
    )
    about = told_at_start(joined)
    assert about.T_map_own == SEEN[1]
    assert about.sigma == pytest.approx((0.6, math.radians(6.0)))
    assert about.guess.sigmas == pytest.approx(about.sigma)
    assert told_at_start(joined.model_copy(update={"start": None})).T_map_own == IDENTITY


def test_one_started_anew_is_where_it_wrote_down_that_it_was() -> None:
    sync, started = sync_of(life=1), Whereabouts(IDENTITY, (0.1, 0.1))
    assert left_at(sync, SEEN[2], SEEN[1], started).T_map_own == SEEN[2]
    assert left_at(sync, None, None, started).T_map_own == IDENTITY
    assert left_at(sync, None, None, started).sigma[0] > 0.5
    message = seen_by("bob", SEEN[1], SEEN[3]).model_copy(update={"author": "me"})
    sync.handle("bob", message, 1.0)  # type: ignore[arg-type]
    assert left_at(sync, None, None, started).T_map_own.distance_to(SEEN[3]) < 2e-3
    assert left_at(sync, None, SEEN[1], started).T_map_own == SEEN[1]


# --- looking ------------------------------------------------------------------------------------


def test_it_looks_when_there_is_something_new_and_not_too_often() -> None:
    tying = looked(ROOM, SEEN[1], SETTINGS.scans - 1)
    assert not tying.due(7, 5.0)
    tying.add(report(9, ROOM, SEEN[1], SEEN[1]))
    assert tying.due(7, 5.0)
    tries(tying, [], told(SEEN[1]))
    assert not tying.due(7, 99.0)  # nothing new
    assert tying.due(8, 9.0)  # others saw something
    tying.add(report(10, ROOM, SEEN[1], SEEN[1]))
    assert not tying.due(7, 1.5)
    assert tying.due(7, 2.0)
    assert [r.number for r in tying.take()] == [1, 2, 3, 9, 10]
    assert tying.waiting == []


def test_where_it_was_found_once_it_looks_again_though_nothing_new_comes() -> None:
    tying = looked(ROOM, SEEN[1])
    tries(tying, seen(ROOM, *SEEN), told(SEEN[1]), count=1)
    assert not tying.due(7, 5.0)
    assert tying.due(7, 12.0)


def test_a_place_counts_that_comes_again() -> None:
    tying = looked(ROOM, SEEN[2])
    assert tries(tying, seen(ROOM, *SEEN), told(SEEN[1]), count=1) is None
    found = tries(tying, seen(ROOM, *SEEN), told(SEEN[1]), count=1)
    assert found is not None and found.distance_to(SEEN[2]) < 0.05


@pytest.mark.slow  # as plain Python
@settings(deadline=None, max_examples=25)
@given(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(-0.6, 0.6), st.sampled_from(range(5)))
def test_whatever_start_it_was_told_it_finds_its_place_or_claims_none(
    x: float, y: float, turn: float, stop: int
) -> None:
    true = SEEN[stop] @ Pose2(0.15, -0.1, 0.2)
    start = Pose2(true.x + x, true.y + y, wrap_angle(true.theta + turn))
    found = tries(looked(ROOM, true), seen(ROOM, *SEEN), told(start, 0.6, 0.25))
    if found is not None:
        assert found.distance_to(true) < 0.08
        assert abs(wrap_angle(found.theta - true.theta)) < math.radians(2.0)


@pytest.mark.slow  # as plain Python
@settings(deadline=None, max_examples=15)
@given(st.floats(-1.0, 1.0), st.floats(-0.2, 0.2), st.floats(-0.3, 0.3))
def test_along_a_bare_corridor_no_place_is_claimed_but_where_others_saw_it(
    x: float, y: float, turn: float
) -> None:
    true = Pose2(1.0, 0.1, 0.4)
    others = seen(CORRIDOR, *(Pose2(0.5 * k, 0.0, 0.0) for k in range(-4, 5)))
    start = Pose2(true.x + x, true.y + y, true.theta + turn)
    tying = looked(CORRIDOR, true)
    assert tries(tying, others, told(start), count=3) is None
    assert "it may be elsewhere along the walls" in tying.doubts
    sight = Guess(Pose2(1.02, 0.08, 0.38), np.diag([4e-4, 4e-4, 1e-3]), seen=True)
    found = tries(tying, others, sight, told(start))
    assert found is not None and found.distance_to(true) < 0.05
    assert abs(found.theta - true.theta) < math.radians(1.0)


def test_without_walls_in_reach_it_is_where_others_saw_it_after_some_tries() -> None:
    tying = looked(ROOM, SEEN[1])
    far = Guess(Pose2(60.0, 0.0, 0.0), np.diag([4e-4, 4e-4, 1e-3]), seen=True)
    least = SETTINGS.sight_tries
    assert tries(tying, seen(ROOM, *SEEN), far, told(SEEN[1]), count=least - 1) is None
    assert tries(tying, seen(ROOM, *SEEN), far, count=1) == far.T_map_odom
    tying = looked(ROOM, SEEN[1])
    elsewhere = Guess(Pose2(60.5, 0.0, 0.0), far.covariance, seen=True)
    assert tries(tying, seen(ROOM, *SEEN), far, count=least - 1) is None
    assert tries(tying, seen(ROOM, *SEEN), elsewhere, count=least - 1) is None, "it has moved"


def test_where_walls_contradict_what_others_saw_what_it_was_told_counts() -> None:
    tying = looked(ROOM, SEEN[1])
    wrong = Guess(Pose2(1.4, -0.3, 1.2), np.diag([1e-4, 1e-4, 1e-4]), seen=True)
    found = tries(tying, seen(ROOM, *SEEN), wrong, told(SEEN[0]))
    assert found is not None and found.distance_to(SEEN[1]) < 0.05


def test_it_is_not_where_a_teammate_stands() -> None:
    tying = looked(ROOM, SEEN[1])
    mate = Standing(SEEN[1].x, SEEN[1].y, 0.25)
    assert tries(tying, seen(ROOM, *SEEN), told(SEEN[0]), mates=(mate,)) is None
    assert tying.doubts == ("a teammate stands there",)
