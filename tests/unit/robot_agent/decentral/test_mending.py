"""A robot that is tied a little wrong, or quite, finds out and mends it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import IDENTITY, Pose2, wrap_angle
from mapping.placed_by_sight import Guess
from robot_agent.decentral.alignment import Placed
from robot_agent.decentral.mending import Mending
from robot_agent.decentral.settings import TyingSettings
from robot_agent.decentral.tying import Whereabouts
from tests.unit.robot_agent.decentral.test_tying import CORRIDOR
from tests.unit.rooms import room, scan_in

ROOM = room()
SETTINGS = TyingSettings()
OTHERS = [
    (scan_in(ROOM, pose), pose) for pose in (Pose2(0.2 * k, 0.1 * k, 0.3 * k) for k in range(5))
]
TRUE = Pose2(0.3, 0.2, 0.2)
WAY = [Pose2(0.15 * k, 0.05 * k, 0.4 * k) for k in range(8)]
OWN = [(scan_in(ROOM, pose), TRUE.inverse() @ pose) for pose in WAY]


def look(
    thought: Pose2,
    own: Sequence[Placed] = OWN,
    others: Sequence[Placed] = OTHERS,
    guesses: Sequence[Guess] = (),
    times: int = 1,
) -> Pose2 | None:
    mending, found = Mending(SETTINGS), None
    for _ in range(times):
        found = mending.look(own, others, thought, guesses, 0.1)
    return found


def test_it_looks_when_something_is_new_and_not_too_often() -> None:
    mending = Mending(SETTINGS)
    assert mending.due(1, 0.0)
    assert not mending.due(1, 9.0)
    assert mending.due(2, 9.0)
    assert not mending.due(3, 9.0 + 0.5 * SETTINGS.mend_period_s)


def test_where_it_is_right_nothing_moves() -> None:
    assert look(TRUE) is None


@settings(deadline=None, max_examples=15)
@given(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06), st.floats(-0.03, 0.03))
def test_a_small_error_is_mended_or_left_but_never_made_worse(
    x: float, y: float, turn: float
) -> None:
    thought = Pose2(TRUE.x + x, TRUE.y + y, TRUE.theta + turn)
    better = look(thought)
    if better is not None:
        assert better.distance_to(TRUE) < 0.03
        assert abs(wrap_angle(better.theta - TRUE.theta)) < math.radians(0.6)


def test_a_degree_too_much_is_mended() -> None:
    better = look(Pose2(TRUE.x + 0.05, TRUE.y, TRUE.theta + math.radians(1.0)))
    assert better is not None and better.distance_to(TRUE) < 0.03


def test_where_nobody_was_there_is_nothing_to_compare() -> None:
    far = [(scan, Pose2(30.0, 0.0, 0.0) @ pose) for scan, pose in OTHERS]
    wrong = Pose2(TRUE.x + 0.05, TRUE.y, TRUE.theta)
    assert look(wrong, others=far) is None
    assert look(wrong, others=[]) is None
    assert look(wrong, own=OWN[:2]) is None


def test_along_a_corridor_nothing_moves() -> None:
    others = [
        (scan_in(CORRIDOR, pose), pose) for pose in (Pose2(0.5 * k, 0.0, 0.0) for k in range(5))
    ]
    own = [(scan_in(CORRIDOR, pose), pose) for pose in (Pose2(0.3 * k, 0.1, 0.0) for k in range(6))]
    assert look(Pose2(0.05, 0.0, 0.0), own, others) is None


@pytest.mark.parametrize("start", [TRUE, Pose2(0.6, -0.1, 0.35)])
def test_a_wrong_tie_is_found_and_the_place_searched_for_anew(start: Pose2) -> None:
    wrong = Pose2(TRUE.x + 0.9, TRUE.y - 0.7, TRUE.theta + 0.7)
    guesses = [Whereabouts(start, (0.4, 0.2)).guess]
    assert (
        look(wrong, guesses=guesses) is None
    )  # it may be that others are wrong: once is not enough
    found = look(wrong, guesses=guesses, times=SETTINGS.wrong_looks)
    assert found is not None and found.distance_to(TRUE) < 0.05


def test_a_wrong_tie_stays_while_no_better_place_is_sure() -> None:
    wrong = Pose2(TRUE.x + 0.9, TRUE.y - 0.7, TRUE.theta + 0.7)
    nowhere = Whereabouts(Pose2(40.0, 0.0, 0.0), (0.1, 0.05)).guess
    assert look(wrong, guesses=[nowhere], times=3) is None
    assert look(wrong, times=3) is None


def test_a_look_that_fits_again_lets_go_of_the_doubt() -> None:
    mending = Mending(SETTINGS)
    wrong = Pose2(TRUE.x + 0.9, TRUE.y - 0.7, TRUE.theta + 0.7)
    guesses = [Whereabouts(IDENTITY, (0.4, 0.2)).guess]
    for thought in (wrong, TRUE, wrong):
        assert mending.look(OWN, OTHERS, thought, guesses, 0.1) is None
