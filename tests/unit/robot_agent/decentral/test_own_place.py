"""How a robot comes to know where its own map lies in the team's."""

from __future__ import annotations

import math

from mapping.geometry import IDENTITY, Pose2
from protocol.messages import ScanReport
from protocol.peer_messages import LastHeard
from protocol.world_messages import Joined
from robot_agent.decentral.own_place import OwnPlace
from robot_agent.decentral.settings import TyingSettings
from tests.unit.robot_agent.decentral.peer_rig import ROOM, seen_by, sync_of
from tests.unit.robot_agent.decentral.test_lookouts import KNOWN, sight, told_by
from tests.unit.robot_agent.decentral.test_mending import OTHERS
from tests.unit.robot_agent.decentral.test_tying import report

SETTINGS = TyingSettings()
TRUE = Pose2(0.3, 0.2, 0.2)


def placed(reference: bool = False, first: bool = True, start: Pose2 = IDENTITY) -> OwnPlace:
    place = OwnPlace(sync_of("b"), SETTINGS, reference)
    joined = Joined(
        lockstep=True, now_s=0.0, step_s=0.1, start=start, start_sigma_m=1.0, start_sigma_deg=20.0
    )
    place.begin(joined, first)
    return place


def turns(place: OwnPlace, first: int = 1, looks: int = 6) -> None:
    for number in range(first, first + looks):
        place.wait(look(number), 0.1 * number)


def look(number: int) -> ScanReport:
    return report(number, ROOM, TRUE @ Pose2(0.0, 0.0, 0.5 * number), TRUE)


def test_the_first_is_where_it_was_told_by_definition() -> None:
    place = placed(reference=True, start=TRUE)
    assert place.T_map_own == TRUE
    assert place.whereabouts.sigma == (0.0, 0.0)
    assert not place.due(1, 9.0)
    assert not place.mend_due(1, 9.0)  # nobody is before it
    assert not placed(reference=True, first=False).T_map_own


def test_what_it_was_told_counts_after_it_waited_for_others_to_see_it() -> None:
    place = placed()
    assert place.whereabouts.sigma[0] > 0.5
    turns(place)
    assert list(place.guesses(SETTINGS.sight_wait_s)) == []
    (guess,) = place.guesses(SETTINGS.sight_wait_s + 1.0)
    assert not guess.seen
    assert place.find(OTHERS, (), 0.1, 1, 20.0) == []
    assert place.due(1, 22.0) is False
    turns(place, first=7)
    assert place.due(1, 22.0)
    assert len(place.find(OTHERS, (), 0.1, 1, 22.0)) == 12
    assert place.T_map_own is not None and place.T_map_own.distance_to(TRUE) < 0.05
    assert place.whereabouts.T_map_own == place.T_map_own


def test_who_started_anew_does_not_wait_nor_is_it_where_others_saw_it() -> None:
    place = placed(first=False)
    place.see(sight("b", "a"))
    place.see(sight("b", "a"))
    place.lookouts.hear("a", told_by("a", "b", KNOWN))
    assert [guess.seen for guess in place.guesses(0.0)] == [False]
    assert place.lookout_due(1.0) is None


def test_where_others_saw_it_comes_first() -> None:
    place = placed()
    place.see(sight("b", "a"))
    place.see(sight("b", "a"))
    place.lookouts.hear("a", told_by("a", "b", KNOWN))
    assert [guess.seen for guess in place.guesses(99.0)] == [True]
    place.wait(look(1), 0.0)
    assert [guess.seen for guess in place.guesses(99.0)] == [True, False]
    lookout = place.lookout_due(1.0)
    assert lookout is not None and not lookout.tied


def test_once_it_knows_it_looks_whether_that_is_true() -> None:
    place = placed()
    assert not place.mend([], [], 0.1, 0.0)
    turns(place)
    assert not place.mend_due(1, 20.0)
    place.T_map_own = Pose2(TRUE.x + 0.05, TRUE.y, TRUE.theta + math.radians(1.0))
    assert place.mend_due(1, 20.0)
    own = [(scan, TRUE.inverse() @ pose) for scan, pose in OTHERS]
    assert place.mend(own, OTHERS, 0.1, 20.0)
    assert place.T_map_own.distance_to(TRUE) < 0.03
    assert not place.mend(own, OTHERS, 0.1, 30.0)


def test_who_started_anew_is_about_where_others_last_heard_it() -> None:
    place = OwnPlace(sync_of("b", life=1), SETTINGS, reference=False)
    place.begin(Joined(lockstep=True, now_s=0.0, step_s=0.1), first=False)
    place.hear(LastHeard(life=0, stamp_s=5.0, T_map_base=TRUE))
    place.hear(LastHeard(life=0, stamp_s=4.0, T_map_base=IDENTITY))
    place.hear(LastHeard(life=1, stamp_s=9.0, T_map_base=IDENTITY))  # that is this very life
    assert place.whereabouts.T_map_own == TRUE
    assert place.whereabouts.sigma[0] > 0.5


def long_after(place: OwnPlace, *heard: str) -> float:
    """Let a robot wait for as long as it may, and hear some just then; return when that is [s]."""
    turns(place)
    now = 0.1 + SETTINGS.settle_s
    for name in heard:
        place._sync.hear(name, now)
    return now


def test_the_first_by_name_of_those_that_are_there_stands_in_for_the_first_robot() -> None:
    place = placed(start=TRUE)
    now = long_after(place, "c", "server", "d")
    assert not place.settle_due(now - 0.1)
    assert place.settle_due(now)
    assert len(place.settle(now)) == 6
    assert place.T_map_own == TRUE
    assert place.whereabouts.sigma == (0.0, 0.0), "the map is where it says"
    assert not place.settle_due(now + 1.0)


def test_nobody_stands_in_while_another_may_know_better() -> None:
    place = placed()
    assert not place.settle_due(long_after(place, "a", "c"))
    place = placed(first=False)  # it was started anew, the others began without it
    assert not place.settle_due(long_after(place, "c"))
    place = placed()
    now = long_after(place, "bob")
    place._sync.handle("bob", seen_by("bob", TRUE), now)
    assert not place.settle_due(now), "somebody told what it saw, and where"
