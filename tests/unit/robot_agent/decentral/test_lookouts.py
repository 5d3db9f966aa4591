"""Robots tell each other whom they saw from their starts, and find their places by it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry import IDENTITY, Pose2, wrap_angle
from protocol.messages import ScanReport
from protocol.peer_messages import Lookout
from robot_agent.decentral.lookouts import Frame, Lookouts
from tests.unit.rooms import room, scan_in

ROOM = room()
ERRORS = (1.0, math.radians(20.0))
STARTS = {"a": IDENTITY, "b": Pose2(0.9, 0.3, 0.2), "c": Pose2(1.9, -0.2, -0.3)}
NONE = np.zeros((0, 2))


def sight(name: str, others: str) -> ScanReport:
    """A report of a robot at its start that sees some others."""
    places = [STARTS[name].inverse().apply((STARTS[o].x, STARTS[o].y)) for o in others]
    scan = scan_in(ROOM, STARTS[name])
    return ScanReport(
        number=1,
        stamp_s=0.0,
        ranges=scan.ranges,
        bearing_start_rad=scan.bearing_start,
        bearing_step_rad=scan.bearing_step,
        range_max_m=scan.range_max,
        T_base_laser=scan.T_base_laser,
        T_odom_base=IDENTITY,
        covariance=np.diag([1e-6, 1e-6, 1e-6]),
        track_odom=np.zeros((0, 4)),
        sightings_odom=np.array(places, dtype=np.float32).reshape(-1, 2),
    )


def lookouts(name: str, others: str) -> Lookouts:
    """What a robot knows that saw some others twice."""
    made = Lookouts(name, 1.0)
    for _ in range(2):
        made.see(sight(name, others))
    return made


def told_by(name: str, others: str, frame: Frame) -> Lookout:
    lookout = lookouts(name, others).due(frame, 0, 0.0)
    assert lookout is not None
    return lookout


def untied(name: str, dx: float = 0.5, dy: float = -0.4, turn: float = 0.2) -> Frame:
    start = STARTS[name]
    return Frame(Pose2(start.x + dx, start.y + dy, start.theta + turn), ERRORS, False)


KNOWN = Frame(STARTS["a"], ERRORS, True)


def test_one_that_saw_nothing_yet_tells_nothing() -> None:
    assert Lookouts("a", 1.0).due(KNOWN, 0, 0.0) is None


def test_what_it_saw_is_told_now_and_then() -> None:
    made = lookouts("a", "b")
    told = made.due(KNOWN, 2, 5.0)
    assert told is not None
    assert (told.life, told.tied, told.error_m) == (2, True, 1.0)
    assert told.discs_own == pytest.approx(np.array([[0.9, 0.3]]), abs=1e-6)
    assert told.place_own.tolist() == [[0.0, 0.0]]
    assert made.due(KNOWN, 2, 5.9) is None
    assert made.due(KNOWN, 2, 6.0) is not None


@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(-0.6, 0.6))
def test_two_that_see_each_other_know_how_they_stand(x: float, y: float, turn: float) -> None:
    mine = lookouts("b", "a")
    mine.hear("a", told_by("a", "b", KNOWN))
    guess = mine.guess(untied("b", x, y, turn))
    assert guess is not None and guess.seen
    assert guess.T_map_odom.distance_to(STARTS["b"]) < 1e-5
    assert abs(wrap_angle(guess.T_map_odom.theta - STARTS["b"].theta)) < 1e-5
    assert guess.sigmas[0] < 0.05


def test_one_between_need_not_know_its_place() -> None:
    mine = lookouts("c", "b")
    mine.hear("a", told_by("a", "b", KNOWN))
    assert mine.guess(untied("c")) is None
    mine.hear("b", told_by("b", "ac", untied("b", -0.6, 0.3, -0.2)))
    guess = mine.guess(untied("c"))
    assert guess is not None and guess.T_map_odom.distance_to(STARTS["c"]) < 1e-5


def test_where_nobody_knows_its_place_sight_tells_none() -> None:
    mine = lookouts("b", "a")
    mine.hear("a", told_by("a", "b", untied("a")))
    assert mine.guess(untied("b")) is None
    assert Lookouts("b", 1.0).guess(untied("b")) is None


def test_who_is_not_listened_to_any_more_is_forgotten() -> None:
    mine = lookouts("b", "a")
    mine.hear("a", told_by("a", "b", KNOWN))
    mine.forget("a")
    assert mine.guess(untied("b")) is None


def test_nonsense_is_not_taken() -> None:
    mine = lookouts("b", "a")
    far = told_by("a", "b", KNOWN).model_copy(
        update={"discs_own": np.array([[3e38, 0.0]], dtype=np.float32)}
    )
    mine.hear("a", far)
    mine.hear("b", told_by("b", "a", KNOWN))  # somebody that calls itself by this robot's name
    assert mine.guess(untied("b")) is None
    wide = told_by("a", "b", KNOWN).model_copy(update={"error_m": 1e300, "turn_variance": 1e300})
    mine.hear("a", wide)
    guess = mine.guess(untied("b"))
    assert guess is None or np.isfinite(guess.covariance).all()
