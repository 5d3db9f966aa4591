"""No sequence of events breaks the executive, and nothing gets lost in it.

Robots here say anything at any time: bids that come late or twice, words about tasks of long ago,
silence, restarts; operators interfere. Afterwards the team behaves, and the mission must come to
its end: every task ended, and every place done, offered again or given up.
"""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coordination.strategy import STRATEGIES
from mapping.geometry import Floats
from protocol.body import Body
from tests.unit.server.executive_rig import Rig, bid_of

ROBOTS = ("anna", "ben", "carl")

robots = st.sampled_from(ROBOTS)
rows = st.lists(
    st.tuples(st.integers(0, 8).map(lambda x: 3.0 * x), st.integers(0, 30), st.integers(0, 20)),
    max_size=5,
    unique_by=lambda row: row[0],
)
numbers = st.integers(0, 12)
outcomes = st.sampled_from(["done", "unreachable", "failed"])
events = st.one_of(
    st.tuples(st.just("bid"), robots, rows, st.integers(-2, 3), st.integers(-2, 0)),
    st.tuples(st.just("progress"), robots, st.integers(-1, 12), st.integers(0, 20)),
    st.tuples(st.just("end"), robots, st.integers(-1, 12), outcomes),
    st.tuples(st.just("lost"), robots),
    st.tuples(st.just("contact"), robots),
    st.tuples(st.just("join"), robots),
    st.tuples(st.just("visit"), robots, numbers),
    st.tuples(st.just("pause"), robots),
    st.tuples(st.just("resume"), robots),
    st.tuples(st.just("drive"), robots),
    st.tuples(st.just("map")),
    st.tuples(st.just("time"), st.sampled_from([0.1, 0.3, 1.0, 4.0, 6.0, 21.0, 61.0])),
)


def choose(idle: tuple[Any, ...], places: Floats, gains: Floats) -> dict[str, tuple[float, float]]:
    """Send all idle robots past the last place."""
    return {robot.robot: (float(places[:, 0].max()) + 2.0, 0.0) for robot in idle}


def apply(rig: Rig, event: tuple[Any, ...]) -> None:
    """Let one event happen; a task number of -1 means the robot's own."""
    kind, *rest = event
    executive, now = rig.executive, rig.now
    if kind == "time":
        rig.wait(rest[0], step=rest[0])
    elif kind == "map":
        rig.new_map()
    elif kind == "bid":
        robot, places, ahead, older = rest
        rig.numbers += 1
        number, on = max(rig.numbers + ahead, 0), max(rig.map_number + older, 0)
        rig.take(executive.bid(bid_of(robot, places, number, on), now))
    elif kind in ("progress", "end"):
        robot, number, what = rest
        task = rig.task(robot) if number < 0 else number
        if task is None:
            return
        if kind == "progress":
            rig.take(executive.progress(robot, task, float(what), now))
        else:
            rig.take(executive.task_ended(robot, task, what, "", now))
    elif kind == "join":
        rig.take(executive.robot_joined(rest[0], Body(), now))
    elif kind == "lost":
        rig.take(executive.robot_lost(rest[0], now))
    elif kind == "contact":
        rig.take(executive.contact(rest[0], now))
    else:
        more = {"visit": [*rest[1:], 0.0], "drive": [0.2, 0.1]}.get(kind, [])
        rig.take(getattr(executive, kind)(rest[0], *more, now).sends)


def behave(rig: Rig) -> None:
    """Let all robots be there and do what they are told until nothing is left.

    Every place stays a frontier whatever is done: the worst case, which only giving up ends.
    """
    for robot in ROBOTS:
        rig.take(rig.executive.robot_joined(robot, Body(), rig.now))
        rig.take(rig.executive.resume(robot, rig.now).sends)
    rig.new_map()
    rig.numbers = 100
    for _ in range(150):
        for robot in ROBOTS:
            task = rig.task(robot)
            if task is not None:
                rig.end(robot, "failed" if task % 2 else "done")
            rig.bid(robot, (3.0, 20, 3), (9.0, 5, 9))
        rig.wait(1.0, *ROBOTS, step=0.5)
        if rig.executive.exhausted(rig.now):
            return
    raise AssertionError("the mission has no end")


def check_record(rig: Rig) -> None:
    """Every task was awarded once and ended once; what failed was offered again or given up."""
    record = rig.executive.happenings
    of_kind: dict[str, list[Any]] = {}
    for happening in record:
        of_kind.setdefault(str(happening["event"]), []).append(happening)
    awarded = [h["task"] for h in of_kind.get("awarded", [])]
    ends = ("done", "failed", "expired", "terminated")
    ended = [h["task"] for end in ends for h in of_kind.get(end, [])]
    live = [task.id for task in rig.executive.tasks()]
    assert sorted(ended + live) == sorted(awarded)
    again = [h["task"] for event in ("announced", "given up") for h in of_kind.get(event, [])]
    for end in ("failed", "expired"):
        for happening in of_kind.get(end, []):
            assert happening["kind"] != "explore" or happening["task"] in again
    times = [h["t_s"] for h in record]
    assert times == sorted(times)


@pytest.mark.parametrize("strategy", sorted(STRATEGIES))
@settings(deadline=None, max_examples=40)
@given(script=st.lists(events, max_size=40))
def test_no_sequence_of_events_breaks_it(strategy: str, script: list[tuple[Any, ...]]) -> None:
    rig = Rig(*ROBOTS, strategy=strategy, choose=choose)
    for event in script:
        apply(rig, event)
        deadline = rig.executive.next_deadline()
        if deadline is not None and deadline > rig.now:
            rig.now = deadline
            rig.take(rig.executive.tick(deadline))
    check_record(rig)
    behave(rig)
    check_record(rig)


@settings(deadline=None, max_examples=20)
@given(script=st.lists(events, max_size=25))
def test_the_same_events_have_the_same_effects(script: list[tuple[Any, ...]]) -> None:
    rigs = [Rig(*ROBOTS, choose=choose) for _ in range(2)]
    for rig in rigs:
        for event in script:
            apply(rig, event)
    first, second = rigs
    assert first.sent == second.sent
    assert first.executive.happenings == second.executive.happenings


@settings(deadline=None, max_examples=20)
@given(script=st.lists(events, max_size=25))
def test_a_tick_leaves_nothing_due(script: list[tuple[Any, ...]]) -> None:
    rig = Rig(*ROBOTS, choose=choose)
    for event in script:
        apply(rig, event)
        rig.take(rig.executive.tick(rig.now))
        deadline = rig.executive.next_deadline()
        assert deadline is None or deadline > rig.now
