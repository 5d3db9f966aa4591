from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coordination.strategies.minpos import MinPos
from mapping.geometry import IDENTITY, Pose2
from protocol import messages as words
from robot_agent.agent import Agent
from robot_agent.decentral.choosing import Choosing
from robot_agent.decentral.settings import DecisionSettings
from robot_agent.settings import RobotSettings
from tests.unit.protocol.test_crew import beacon
from tests.unit.robot_agent.test_agent import Rig, with_map

SETTINGS = DecisionSettings(here_s=10.0, lost_s=60.0, quiet_s=4.0, agreed_s=3.0, rest_s=10.0)
HELD = 77


def bid(*places: tuple[float, float], losses: bool = False) -> words.Bid:
    at = np.array(places, dtype=np.float32).reshape(-1, 2)
    ones = np.ones(len(at), dtype=np.float32)
    return words.Bid(
        number=1,
        map_number=1,
        T_map_base=IDENTITY,
        places_map=at,
        gains=5.0 * ones,
        costs_m=np.hypot(at[:, 0], at[:, 1]),
        rectangles_map=np.column_stack((at - 1.0, at + 1.0)).astype(np.float32),
        unreachable_map=np.zeros((0, 2), dtype=np.float32),
        losses=2.0 * ones if losses else np.zeros(0, dtype=np.float32),
    )


def choosing() -> Choosing:
    return Choosing(Agent("me", RobotSettings()), MinPos.from_settings({}), SETTINGS)


def idle(since: float = 0.0) -> Choosing:
    """One that found nothing worth a trip."""
    made = choosing()
    assert made.bid(bid(), since) is None
    return made


def done(award: words.Award | None) -> words.TaskEnd:
    assert award is not None
    return words.TaskEnd(task=award.task, outcome="done")


# --- tasks ---------------------------------------------------------------------------------------


def test_it_is_busy_with_what_it_chose_and_idle_when_nothing_is_left() -> None:
    mine = choosing()
    assert (mine.busy, mine.idle) == (False, False)
    award = mine.bid(bid((1.0, 0.0)), 0.0)
    assert (mine.busy, mine.idle) == (True, False)
    assert mine.ended(done(award), 5.0) is None
    assert (mine.busy, mine.idle) == (False, True)
    assert mine.due == 15.0
    assert mine.last[0] is not None and len(mine.last[0]) == 1


def test_a_place_that_has_rested_is_looked_at_again() -> None:
    mine = choosing()
    first = mine.bid(bid((1.0, 0.0)), 0.0)
    assert first is not None
    mine.ended(done(first), 5.0)
    assert mine.idle_word(14.9, (0.0, 0.0)) is None
    again = mine.idle_word(15.0, (0.0, 0.0))
    assert again is not None and again.task > first.task
    mine.ended(done(again), 20.0)
    assert mine.due == 30.0
    last = mine.idle_word(30.0, (0.0, 0.0))
    mine.ended(done(last), 40.0)
    assert mine.idle_word(50.0, (0.0, 0.0)) is None  # that was the last try
    assert mine.due is None


def test_what_waits_for_a_busy_robot_does_not_wake_it_all_the_time() -> None:
    mine = choosing()
    mine.ended(done(mine.bid(bid((1.0, 0.0)), 0.0)), 5.0)
    assert mine.bid(bid((9.0, 0.0)), 6.0) is not None
    assert mine.idle_word(15.0, None) is None
    assert mine.due is None or mine.due > 15.0


def test_places_are_left_to_teammates_that_are_here_and_nearer() -> None:
    rig = with_map()
    rig.live(0.5)
    mine = Choosing(rig.agent, MinPos.from_settings({}), SETTINGS)
    two = bid((1.05, 0.05), (-0.45, 0.05))
    two = two.model_copy(update={"T_map_base": rig.agent.pose_map()})
    mine.crew.hear("robot1", beacon(0.0), 0.5, 0.5)  # itself is no teammate
    mine.crew.hear("robot2", beacon(-0.45), 0.5, 0.5)
    mine.crew.hear("robot3", beacon(0.9, through=True), 0.5, 0.5)
    award = mine.bid(two, 1.0)
    assert award is not None and award.goal_map[0] == pytest.approx(1.05)
    alone = Choosing(rig.agent, MinPos.from_settings({}), SETTINGS)
    alone.crew.hear("robot2", beacon(-0.45), 0.5, 0.5)
    award = alone.bid(two, 20.0)  # not heard for too long
    assert award is not None and award.goal_map[0] == pytest.approx(-0.45)


def placed(rig: Rig, *places: tuple[float, float]) -> words.Bid:
    """A bid of the robot where it stands."""
    return bid(*places).model_copy(update={"T_map_base": rig.agent.pose_map()})


EAST, WEST = (1.05, 0.05), (-0.45, 0.05)


def in_hall() -> tuple[Rig, Choosing]:
    rig = with_map()
    rig.live(0.5)
    settings = SETTINGS.model_copy(update={"claim_tie_m": 0.1})  # the hall is small
    return rig, Choosing(rig.agent, MinPos.from_settings({}), settings)


def goal_of(award: words.Award | None) -> tuple[float, float]:
    assert award is not None and award.kind == "explore"
    return award.goal_map


def test_one_that_finds_nothing_does_not_keep_others_from_anything() -> None:
    rig, mine = in_hall()
    mine.crew.hear("robot2", beacon(-0.45, idle=True), 0.5, 0.5)
    assert goal_of(mine.bid(placed(rig, EAST, WEST), 1.0)) == pytest.approx(WEST)


def test_who_is_heading_somewhere_comes_to_other_places_after_that() -> None:
    rig, mine = in_hall()
    mine.crew.hear("robot2", beacon(-0.45, busy=True, goal_map=(1.2, 0.9)), 0.5, 0.5)
    assert goal_of(mine.bid(placed(rig, EAST, WEST), 1.0)) == pytest.approx(WEST)


def test_with_all_left_to_a_teammate_it_waits_out_of_the_way_and_looks_again() -> None:
    rig, mine = in_hall()
    assert mine.bid(placed(rig, WEST), 1.0) is not None
    assert mine.goal == pytest.approx(WEST)
    newer, award = mine.hear("robot2", beacon(-0.45, busy=True, goal_map=WEST), 1.5, 1.5)
    assert newer and award is not None and award.kind == "wait"
    assert (mine.busy, mine.idle, mine.goal) == (False, False, None)
    assert mine.due == 1.5 + SETTINGS.wait_period_s
    assert mine.hear("robot2", beacon(-0.4, busy=True, goal_map=WEST), 2.0, 2.0) == (True, None)
    assert mine.idle_word(mine.due, (9.0, 9.0)) is None  # nothing has changed
    assert mine.due == 1.5 + 2.0 * SETTINGS.wait_period_s
    assert mine.idle_word(mine.due, None) is None
    # Not heard any more, the teammate keeps nobody from going there.
    assert goal_of(mine.idle_word(mine.due, None)) == pytest.approx(WEST)


def test_when_a_teammate_turns_idle_it_goes_where_that_did_not() -> None:
    rig, mine = in_hall()
    mine.crew.hear("robot2", beacon(-0.45, busy=True, goal_map=WEST), 0.5, 0.5)
    award = mine.bid(placed(rig, WEST), 1.0)
    assert award is not None and award.kind == "wait"
    _, award = mine.hear("robot2", beacon(-0.45, idle=True), 2.0, 2.0)
    assert goal_of(award) == pytest.approx(WEST)
    assert mine.hear("robot2", beacon(-0.45, idle=False), 1.0, 2.5) == (False, None)


@pytest.mark.parametrize("enough", [True, False])
def test_what_teammates_looked_at_in_vain_often_enough_is_given_up_by_all(enough: bool) -> None:
    rig, mine = in_hall()
    x, count = WEST[0] + 0.6, SETTINGS.max_tries - (not enough)
    for k, goal in enumerate([(9.0, 9.0), None, None][:count]):
        for at, heading in ((1.0, WEST), (2.0, goal)):
            now = 3.0 * k + at
            mine.hear("robot2", beacon(x, busy=True, goal_map=heading), now, now)
    mine.hear("robot2", beacon(x, idle=True), 15.0, 15.0)
    award = mine.bid(placed(rig, WEST), 20.0)
    assert (award is None) == enough == mine.idle


def test_a_teammate_that_is_far_away_or_goes_on_from_there_was_in_no_place_in_vain() -> None:
    rig, mine = in_hall()
    on = (WEST[0] - 1.0, WEST[1])
    for k in range(2 * SETTINGS.max_tries):
        x, goal, life = [(WEST[0] + 1.5, None, 0), (WEST[0], on, 0), (WEST[0], None, k + 1)][k % 3]
        before = beacon(x, busy=True, goal_map=WEST, life=0 if k % 3 < 2 else k)
        mine.hear("robot2", before, 3.0 * k + 1.0, 3.0 * k + 1.0)
        mine.hear("robot2", beacon(x, goal_map=goal, life=life), 3.0 * k + 2.0, 3.0 * k + 2.0)
    mine.hear("robot2", beacon(x, idle=True), 90.0, 90.0)
    assert goal_of(mine.bid(placed(rig, WEST), 91.0)) == pytest.approx(WEST)


def test_what_comes_up_for_others_on_its_way_home_does_not_turn_it_round() -> None:
    rig, mine = in_hall()
    mine.bid(placed(rig), 0.0)
    home = mine.idle_word(5.0, (9.0, 9.0))
    assert home is not None and home.kind == "wait"
    mine.crew.hear("robot2", beacon(-0.45, busy=True, goal_map=WEST), 5.5, 5.5)
    assert mine.bid(placed(rig, WEST), 6.0) is None
    assert not mine.idle
    assert mine.due == 6.0 + SETTINGS.wait_period_s


def test_one_that_waits_at_home_is_not_sent_out_to_wait() -> None:
    rig, mine = in_hall()
    mine.bid(placed(rig), 0.0)
    assert mine.idle_word(5.0, (0.0, 0.0)) is None
    mine.crew.hear("robot2", beacon(-0.45, busy=True, goal_map=WEST), 5.5, 5.5)
    assert mine.bid(placed(rig, WEST), 6.0) is None


def test_one_that_is_through_is_not_disturbed_by_what_others_are_at() -> None:
    mine = idle()
    mine.through = True
    assert mine.hear("bob", beacon(busy=True), 1.0, 1.0) == (True, None)


def test_a_task_that_does_not_get_on_is_over() -> None:
    mine = choosing()
    award = mine.bid(bid((9.0, 0.0)), 0.0)
    assert award is not None
    mine.progress(words.TaskProgress(task=award.task, remaining_m=9.0), 1.0)
    assert mine.due == 1.0 + SETTINGS.patience_s
    assert mine.overdue(20.0) is None
    over = mine.overdue(21.0)
    assert over is not None and over.task == award.task


# --- going home ----------------------------------------------------------------------------------


def test_one_that_finds_nothing_for_a_while_drives_home_once() -> None:
    mine = idle(since=1.0)
    assert mine.idle_word(4.9, (3.0, 0.0)) is None
    award = mine.idle_word(5.0, (3.0, 0.0))
    assert award is not None and (award.kind, award.goal_map) == ("wait", (3.0, 0.0))
    assert mine.idle_word(6.0, (3.0, 0.0)) is None
    assert mine.ended(done(award), 20.0) is None
    assert mine.idle_word(21.0, (3.0, 0.0)) is None


@pytest.mark.parametrize("home", [None, (0.5, 0.5)])
def test_one_that_is_at_home_or_knows_of_none_stays(home: tuple[float, float] | None) -> None:
    assert idle().idle_word(50.0, home) is None


# --- the end -------------------------------------------------------------------------------------


def through(mine: Choosing, now: float) -> bool:
    mine.agree(HELD, now)
    return mine.through


def agreed_at(mine: Choosing, until: float, **told: object) -> float | None:
    """When it says that the mission is over, told all the time the same by bob."""
    for k in range(round(until) + 1):
        if told:
            mine.crew.hear(
                "bob", beacon(**{"idle": True, "held": HELD, **told}), float(k), float(k)
            )
        if through(mine, float(k)):
            return float(k)
    return None


def test_alone_it_is_over_when_nothing_was_found_for_long_enough() -> None:
    mine = idle()
    assert agreed_at(mine, 20.0) == SETTINGS.quiet_s + SETTINGS.agreed_s
    assert mine.through
    assert through(mine, 30.0)
    assert mine.idle_word(30.0, (9.0, 9.0)) is None


def test_who_has_not_looked_yet_or_is_at_something_is_not_through() -> None:
    assert agreed_at(choosing(), 30.0) is None
    mine = choosing()
    mine.bid(bid((1.0, 0.0)), 0.0)
    assert agreed_at(mine, 30.0) is None


def test_it_is_not_over_while_a_place_rests() -> None:
    mine = choosing()
    mine.ended(done(mine.bid(bid((1.0, 0.0)), 0.0)), 5.0)
    assert agreed_at(mine, 14.0) is None


def test_it_is_over_when_all_are_idle_and_hold_the_same() -> None:
    assert agreed_at(idle(), 20.0, idle=True) == 7.0
    assert agreed_at(idle(), 20.0, idle=False) is None
    assert agreed_at(idle(), 20.0, held=HELD + 1) is None


def test_one_that_is_away_is_waited_for_until_it_is_lost() -> None:
    mine = idle()
    mine.crew.hear("bob", beacon(idle=True, held=HELD), 0.0, 0.0)
    ends = agreed_at(mine, 100.0)
    # Heard at 0 s, it counts as here until 10 s: long enough to agree.
    assert ends == 7.0
    mine = idle()
    mine.crew.hear("bob", beacon(idle=False, held=HELD), 0.0, 0.0)
    assert agreed_at(mine, 100.0) == 61.0 + SETTINGS.agreed_s


def test_it_hangs_on_nobodys_last_word_for_longer_than_that_one_is_here() -> None:
    mine = idle(since=5.0)
    mine.crew.hear("bob", beacon(idle=True, held=HELD), 0.0, 0.0)
    assert agreed_at(mine, 100.0) == 61.0 + SETTINGS.agreed_s


TOLD = st.lists(
    st.tuples(
        st.sampled_from(["bob", "cy"]),
        st.booleans(),
        st.sampled_from([HELD, 5]),
        st.sampled_from([0, 1, 3, 8, 70]),
    ),
    max_size=25,
)


@given(TOLD)
def test_it_is_agreed_only_if_all_that_are_waited_for_said_so_for_long_enough(
    told: list[tuple[str, bool, int, int]],
) -> None:
    mine = idle()
    heard: dict[str, tuple[float, bool]] = {}
    now, since = 0.0, None
    for name, is_idle, held, pause in told:
        mine.crew.hear(name, beacon(idle=is_idle, held=held), now, now)
        if heard.get(name, (-1.0, False))[0] < now:
            heard[name] = now, is_idle and held == HELD
        for _ in range(pause + 1):
            waited_for = [word for word in heard.values() if now - word[0] <= SETTINGS.lost_s]
            ready = now >= SETTINGS.quiet_s and all(
                yes and now - at <= SETTINGS.here_s for at, yes in waited_for
            )
            since = None if not ready else (now if since is None else since)
            expected = since is not None and now - since >= SETTINGS.agreed_s
            assert through(mine, now) == expected
            now += 1.0


def test_a_pose_of_a_teammate_comes_from_its_newest_beacon() -> None:
    mine = choosing()
    mine.crew.hear("bob", beacon(1.0), 1.0, 1.0)
    mine.crew.hear("bob", beacon(2.0), 2.0, 2.0)
    assert mine.crew.beacons["bob"].T_map_base == Pose2(2.0, 0.0, 0.0)


def test_one_that_does_not_know_where_it_is_is_never_through() -> None:
    made = idle()
    made.lost = True
    assert not made.idle
    for now in (4.0, 8.0, 20.0):
        made.agree(HELD, now)
    assert not made.through
    made.lost = False
    assert made.idle
    for now in (21.0, 25.0):
        made.agree(HELD, now)
    assert made.through
