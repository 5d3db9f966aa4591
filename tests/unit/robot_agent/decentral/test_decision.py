from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coordination.bid import RobotBid
from coordination.strategies.minpos import MinPos
from coordination.strategy import load_strategy
from mapping.geometry import IDENTITY, Floats
from protocol.messages import Award, TaskEnd
from robot_agent.decentral.claims import Claim
from robot_agent.decentral.decision import Decision
from robot_agent.decentral.settings import DecisionSettings

SETTINGS = DecisionSettings(tried_radius_m=0.75, max_tries=3, rest_s=10.0)
EAST, WEST, NORTH = (5.0, 0.0), (-4.0, 0.0), (0.0, 6.0)
ALL = (EAST, WEST, NORTH)


def decision(settings: DecisionSettings = SETTINGS) -> Decision:
    return Decision("me", MinPos.from_settings({}), settings)


def bid(*places: tuple[float, float], gain: float = 5.0) -> RobotBid:
    """A bid of a robot at the origin with a straight way to everywhere."""
    at = np.array(places, dtype=np.float64).reshape(-1, 2)
    return RobotBid(
        "me",
        1,
        1,
        IDENTITY,
        at,
        np.full(len(at), gain),
        np.hypot(at[:, 0], at[:, 1]),
        np.column_stack((at - 1.0, at + 1.0)),
        np.zeros((0, 2)),
        np.zeros(len(at)),
    )


def ways(*costs: float) -> Floats:
    return np.array(costs)


def end(award: Award, outcome: str = "done", reason: str = "") -> TaskEnd:
    return TaskEnd.model_validate({"task": award.task, "outcome": outcome, "reason": reason})


def awarded(award: Award | None) -> Award:
    assert award is not None
    return award


def test_alone_it_goes_to_the_nearest_place() -> None:
    mind = decision()
    award = awarded(mind.bid(bid(*ALL), {}, 0.0))
    assert (award.kind, award.goal_map, award.lease_s) == ("explore", WEST, SETTINGS.lease_s)
    assert mind.region is not None and mind.region.goal == WEST
    assert mind.idle_since is None


def test_it_leaves_to_a_teammate_what_that_is_nearer_to() -> None:
    award = awarded(decision().bid(bid(*ALL), {"bob": ways(9.0, 1.0, 9.0)}, 0.0))
    assert award.goal_map == EAST


def test_a_teammate_without_a_way_does_not_count() -> None:
    award = awarded(decision().bid(bid(WEST), {"bob": ways(math.inf)}, 0.0))
    assert award.goal_map == WEST


def test_the_same_place_is_awarded_once() -> None:
    mind = decision()
    first = awarded(mind.bid(bid(*ALL), {}, 0.0))
    assert mind.bid(bid(*ALL), {}, 1.0) is None
    assert mind.bid(bid(EAST, (-4.05, 0.0)), {}, 2.0) is None
    assert mind.region is not None and mind.region.goal == WEST
    assert awarded(mind.bid(bid(EAST), {}, 3.0)).task > first.task


def test_one_that_got_nowhere_does_not_try_all_again() -> None:
    mind = decision()
    mind.ended(end(awarded(mind.bid(bid(WEST), {}, 0.0)), "failed", "stuck"), 5.0)
    assert mind.again({}, 100.0) is None
    assert mind.idle_since == 100.0


def test_a_place_it_failed_at_is_tried_again_only_when_nothing_else_is_left() -> None:
    mind = decision()
    mind.ended(end(awarded(mind.bid(bid(*ALL), {}, 0.0)), "failed", "stuck"), 5.0)
    assert mind.region is None
    second = awarded(mind.again({}, 6.0))
    assert second.goal_map == EAST
    mind.ended(end(second), 7.0)
    third = awarded(mind.bid(bid(WEST, NORTH), {}, 8.0))
    assert third.goal_map == NORTH
    mind.ended(end(third), 9.0)
    chance = awarded(mind.bid(bid(WEST), {}, 10.0))
    assert chance.goal_map == WEST
    mind.ended(end(chance, "failed", "stuck"), 11.0)
    assert mind.bid(bid(WEST), {}, 12.0) is None
    assert mind.idle_since == 12.0


def test_a_place_it_visited_rests_and_may_be_tried_again() -> None:
    mind = decision()
    mind.ended(end(awarded(mind.bid(bid(WEST), {}, 0.0))), 5.0)
    assert mind.again({}, 6.0) is None
    assert mind.next_awake(6.0) == 15.0
    assert awarded(mind.again({}, 15.0)).goal_map == WEST
    assert mind.idle_since is None


def test_a_place_it_found_no_way_to_rests_and_may_be_tried_again() -> None:
    mind = decision()
    mind.ended(end(awarded(mind.bid(bid(WEST), {}, 0.0)), "unreachable"), 5.0)
    assert mind.again({}, 6.0) is None
    assert awarded(mind.again({}, 15.0)).goal_map == WEST


def test_the_end_of_another_task_means_nothing() -> None:
    mind = decision()
    award = awarded(mind.bid(bid(WEST), {}, 0.0))
    mind.ended(end(award.model_copy(update={"task": award.task + 1})), 1.0)
    assert mind.region is not None


def test_with_nothing_worth_a_trip_it_is_idle_since_then() -> None:
    mind = decision()
    assert mind.again({}, 1.0) is None and mind.idle_since is None  # it has not looked yet
    assert len(mind.asked) == 0
    assert mind.bid(bid(WEST, gain=0.1), {}, 2.0) is None
    assert mind.bid(bid(), {}, 3.0) is None
    assert mind.idle_since == 2.0
    assert mind.last[0] is not None and len(mind.last[0]) == 0
    mind.bid(bid(WEST), {}, 4.0)
    assert mind.idle_since is None


def test_it_does_not_go_far_for_what_is_not_worth_it_any_more() -> None:
    mind = decision()
    award = awarded(mind.bid(bid(WEST), {}, 0.0))
    assert mind.bid(bid(), {}, 1.0) is None
    assert mind.region is not None  # maps flicker
    assert mind.bid(bid(WEST), {}, 2.0) is None
    assert mind.bid(bid(), {}, 3.0) is None
    assert mind.bid(bid(), {}, 3.0 + SETTINGS.quiet_s - 0.1) is None
    assert mind.region is not None
    gone = 3.0 + SETTINGS.quiet_s
    assert mind.bid(bid(), {}, gone) is None
    assert mind.region is None and mind.idle_since == gone
    mind.ended(end(award), gone + 1.0)
    assert mind.idle_since == gone


def test_when_almost_there_it_goes_on_though_its_place_is_gone_from_the_bid() -> None:
    """The robot's software itself sees when there is nothing left to look at."""
    mind = decision()
    award = awarded(mind.bid(bid((1.9, 0.0)), {}, 0.0))
    assert mind.bid(bid(), {}, 1.0) is None
    assert mind.region is not None and mind.idle_since is None
    mind.ended(end(award), 2.0)
    assert mind.again({}, 2.0) is None
    assert mind.idle_since == 2.0


def test_it_waits_at_home_and_sets_out_again_for_news() -> None:
    mind = decision()
    mind.bid(bid(), {}, 0.0)
    home = mind.go_home((1.0, 2.0), 1.0)
    assert (home.kind, home.goal_map) == ("wait", (1.0, 2.0))
    assert mind.homing and mind.region is None
    mind.ended(end(home), 9.0)
    assert mind.homing
    award = awarded(mind.bid(bid(EAST), {}, 10.0))
    assert award.task > home.task
    assert not mind.homing


def test_who_does_not_get_home_stays_after_some_tries_until_it_has_been_elsewhere() -> None:
    mind = decision()
    mind.bid(bid(), {}, 0.0)
    for _ in range(SETTINGS.max_tries):
        assert not mind.homing
        home = mind.go_home((1.0, 2.0), 1.0)
        assert mind.homing
        mind.ended(end(home, "failed"), 9.0)
    assert mind.homing
    mind.bid(bid(EAST), {}, 10.0)
    assert not mind.homing


def test_who_runs_to_and_fro_between_two_ways_home_gives_up() -> None:
    mind = decision()
    mind.bid(bid(), {}, 0.0)
    home = mind.go_home((1.0, 2.0), 0.0)
    for now, left in ((1.0, 9.0), (5.0, 8.0), (10.0, 30.0), (20.0, 25.0)):
        mind.progress(home.task, left, now)
    assert mind.overdue(5.0 + SETTINGS.patience_s) is not None
    award = awarded(mind.bid(bid(WEST), {}, 30.0))
    for now, left in ((31.0, 9.0), (35.0, 8.0), (40.0, 30.0), (50.0, 25.0)):
        mind.progress(award.task, left, now)
    assert mind.overdue(35.0 + SETTINGS.patience_s) is None


# --- what is left to others ----------------------------------------------------------------------


def test_where_a_teammate_is_heading_and_comes_first_it_does_not_go() -> None:
    mind = decision()
    award = awarded(mind.bid(bid(*ALL), {}, 0.0, [Claim("bob", (-4.0, 0.5), 2.0)]))
    assert award.goal_map == EAST
    other = decision()
    assert awarded(other.bid(bid(*ALL), {}, 0.0, [Claim("bob", WEST, 9.0)])).goal_map == WEST


def test_with_all_left_to_others_it_stands_by_and_is_not_idle() -> None:
    mind = decision()
    assert mind.bid(bid(WEST), {}, 0.0, [Claim("bob", WEST, 2.0)]) is None
    assert mind.stands_by and mind.region is None and mind.idle_since is None
    wait = mind.wait_at((0.0, 0.0), 1.0)
    assert wait.kind == "wait" and not mind.homing
    mind.ended(end(wait, "failed"), 2.0)
    assert mind.stands_by
    assert awarded(mind.again({}, 3.0)).goal_map == WEST  # the teammate has given up
    assert not mind.stands_by


def test_one_that_was_idle_for_a_while_is_settled_until_it_explores_again() -> None:
    mind = decision()
    claim = [Claim("bob", WEST, 2.0)]
    mind.bid(bid(), {}, 0.0)
    mind.bid(bid(WEST), {}, SETTINGS.quiet_s - 0.1, claim)
    assert mind.stands_by and not mind.settled
    mind.bid(bid(), {}, 10.0)
    mind.bid(bid(WEST), {}, 10.0 + SETTINGS.quiet_s, claim)
    assert mind.stands_by and mind.settled
    mind.bid(bid(WEST), {}, 20.0)
    assert not mind.settled


def test_it_turns_round_when_a_teammate_comes_there_first() -> None:
    mind = decision()
    first = awarded(mind.bid(bid(WEST), {}, 0.0))
    assert mind.bid(bid(WEST), {}, 1.0, [Claim("bob", WEST, 2.0)]) is None
    assert mind.stands_by and mind.region is None
    mind.ended(end(first.model_copy(update={"task": first.task}), "failed"), 2.0)
    assert mind.bid(bid(WEST), {}, 3.0) is not None  # that it did not get there means nothing


def test_what_the_map_has_lost_is_not_left_to_others() -> None:
    mind = decision()
    awarded(mind.bid(bid((0.0, -1.5)), {}, 0.0))
    assert mind.bid(bid(EAST), {}, 1.0, [Claim("bob", EAST, 0.1)]) is None
    assert mind.region is not None and not mind.stands_by


def test_how_far_it_is_by_now_counts_when_it_decides_anew() -> None:
    claim = [Claim("bob", WEST, 3.0)]
    mind = decision()
    assert mind.bid(bid(WEST), {}, 0.0, claim) is None
    assert mind.again({}, 1.0, claim, ways(math.inf)) is None  # as far as it was
    assert awarded(mind.again({}, 2.0, claim, ways(1.0))).goal_map == WEST


# --- patience ------------------------------------------------------------------------------------


def test_a_task_without_progress_has_failed() -> None:
    mind = decision()
    assert mind.patient_until is None and mind.overdue(1e9) is None
    award = awarded(mind.bid(bid(WEST), {}, 10.0))
    assert mind.patient_until == 10.0 + SETTINGS.patience_s
    mind.progress(award.task, 4.0, 15.0)
    mind.progress(award.task, 3.0, 20.0)
    mind.progress(award.task + 1, 1.0, 30.0)
    late = 20.0 + SETTINGS.patience_s
    assert mind.overdue(late - 0.1) is None
    over = mind.overdue(late)
    assert over is not None and (over.task, over.outcome) == (award.task, "failed")
    mind.ended(over, late)
    assert mind.overdue(1e9) is None
    mind.progress(award.task, 1.0, late)


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("bid"), st.sets(st.sampled_from(ALL)).map(sorted)),
        st.tuples(st.just("done"), st.just([])),
        st.tuples(st.just("failed"), st.just([])),
        st.tuples(st.just("again"), st.just([])),
    ),
    max_size=40,
)


@settings(max_examples=60)
@given(STEPS, st.integers(1, 3), st.booleans())
def test_what_holds_whatever_happens(
    steps: list[tuple[str, list[tuple[float, float]]]], most: int, company: bool
) -> None:
    """Tasks count up; what was given up is never awarded; idle only if all that is left failed."""
    mind = decision(SETTINGS.model_copy(update={"max_tries": most}))
    tries = dict.fromkeys(ALL, 0)
    rests_until = dict.fromkeys(ALL, -math.inf)
    failed: set[tuple[float, float]] = set()
    offered: list[tuple[float, float]] = []
    at_hand: Award | None = None
    number = 0
    for now, (what, places) in enumerate(steps):
        if what in ("done", "failed"):
            if at_hand is None:
                continue
            goal, outcome = at_hand.goal_map, end(at_hand, what)
            mind.ended(outcome, float(now))
            tries[goal] += 1
            if what == "done":
                rests_until[goal] = max(rests_until[goal], now + SETTINGS.rest_s)
            else:
                failed.add(goal)
            at_hand = None
            assert mind.region is None
        offered = places if what == "bid" else offered
        costs = {"bob": np.ones(len(offered))} if company else {}
        made = mind.bid(bid(*offered), costs, float(now)) if what == "bid" else None
        award = made if what == "bid" else mind.again(costs, float(now))
        open_now = [p for p in offered if tries[p] < most and now >= rests_until[p]]
        if award is not None:
            assert award.task > number
            number, at_hand = award.task, award
            assert award.kind == "explore" and award.goal_map in open_now
        if mind.region is None and at_hand is not None:
            assert at_hand.goal_map not in open_now  # gone from the map: it turns round
            at_hand = None
        assert (mind.region is None) == (at_hand is None)
        if mind.idle_since is not None:
            assert at_hand is None and all(p in failed for p in open_now)


@pytest.mark.parametrize("name", ["auction", "nearest", "minpos"])
def test_any_strategy_will_do(name: str) -> None:
    mind = Decision("me", load_strategy(name), SETTINGS)
    assert awarded(mind.bid(bid(*ALL), {"bob": ways(9.0, 9.0, 9.0)}, 0.0)).goal_map == WEST
