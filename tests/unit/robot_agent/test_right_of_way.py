"""Who makes way."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Floats, Pose2
from robot_agent.navigation_settings import RightOfWaySettings
from robot_agent.right_of_way import RightOfWay, Rival, Sighting, Teammate

SETTINGS = RightOfWaySettings()


def sighting(name: str, path: Floats, busy: bool = True, since: float = 0.0) -> Sighting:
    x, y = float(path[0, 0]), float(path[0, 1])
    mate = Teammate(name, Pose2(x, y, 0.0), 0.0, 0.25, path, busy)
    return Sighting(mate, x, y, 0.0, 0.0, path, since, False)


def line(*points: tuple[float, float]) -> Floats:
    return np.array(points, dtype=np.float64)


def rivals(
    name: str, path: Floats, other: Sighting, now: float = 0.0, busy: bool = True
) -> list[Rival]:
    return RightOfWay(name, SETTINGS).rivals(now, path, 0.25, busy, 0.0, [other])


EAST, WEST = line((0, 0), (8, 0)), line((8, 0), (0, 0))


def test_head_on_the_later_name_makes_way() -> None:
    assert rivals("a", EAST, sighting("b", WEST)) == []
    (rival,) = rivals("b", WEST, sighting("a", EAST))
    assert not rival.joining
    assert 2.0 < rival.mine < 4.5 and abs(rival.mine - rival.theirs) <= 1.6


def test_who_is_not_busy_makes_way_whatever_its_name() -> None:
    assert rivals("b", WEST, sighting("a", EAST, busy=False)) == []
    assert len(rivals("a", EAST, sighting("b", WEST), busy=False)) == 1


def test_who_stays_is_no_rival_but_is_asked_to_move() -> None:
    assert rivals("b", EAST, sighting("a", line((3, 0)))) == []
    assert len(rivals("b", line((3, 0)), sighting("a", EAST), busy=False)) == 1
    assert rivals("b", line((3, 2)), sighting("a", EAST), busy=False) == []


def test_ways_that_cross_far_apart_in_time_are_free() -> None:
    near = line((2, -2), (2, 6))
    far = line((7, -1), (7, 6))
    assert len(rivals("b", EAST, sighting("a", near))) == 1
    assert rivals("b", EAST, sighting("a", far)) == []


def test_who_ends_in_the_way_is_met_later_too() -> None:
    ends = line((6, -1), (6, 0))
    assert len(rivals("b", EAST, sighting("a", ends))) <= 1
    stops_here = line((3, -1), (3, 0))
    assert len(rivals("b", EAST, sighting("a", stops_here))) == 1


def test_followers_are_no_rivals_but_joining_ways_are() -> None:
    behind = line((-3, 0), (5, 0))
    assert rivals("b", EAST, sighting("a", behind)) == []
    assert rivals("b", behind, sighting("a", EAST)) == []
    beside = line((0.2, 0.5), (8, 0.0))
    (rival,) = rivals("b", EAST, sighting("a", beside))
    assert rival.joining
    assert rivals("a", beside, sighting("b", EAST)) == []


def test_who_comes_later_to_the_joint_waits() -> None:
    late = line((-0.5, 0.3), (8, 0.0))
    (rival,) = rivals("a", late, sighting("b", EAST))
    assert rival.joining
    assert rivals("b", EAST, sighting("a", late)) == []


@given(
    st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=2, max_size=4),
    st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=2, max_size=4),
    st.booleans(),
    st.booleans(),
)
@settings(max_examples=40, deadline=None)
def test_never_do_both_go_first(p: list, q: list, busy_a: bool, busy_b: bool) -> None:
    a, b = line(*p), line(*q)
    b_yields = rivals("b", b, sighting("a", a, busy_a), busy=busy_b)
    a_yields = rivals("a", a, sighting("b", b, busy_b), busy=busy_a)
    met = RightOfWay("x", SETTINGS)._meeting(np.ascontiguousarray(a), 0.25, sighting("b", b))
    if met is None:
        return
    # Both may wait for a moment where ways join; they never both drive on.
    if b_yields and a_yields:
        assert b_yields[0].joining or a_yields[0].joining


def test_a_jam_swaps_the_roles_by_the_common_clock_and_ends_when_it_is_over() -> None:
    near = line((2.0, 0), (0, 0))
    low, high = RightOfWay("b", SETTINGS), RightOfWay("a", SETTINGS)
    history = []
    for tick in range(0, 260):
        now = 0.1 * tick
        b = low.rivals(now, near, 0.25, True, 0.0, [sighting("a", EAST)])
        a = high.rivals(now, EAST, 0.25, True, 0.0, [sighting("b", near)])
        assert len(a) + len(b) == 1
        history.append(len(a))
    assert history[0] == 0 and 1 in history
    assert low._encounters
    assert low.rivals(60.0, near, 0.25, True, 0.0, []) == [] and not low._encounters


def test_far_apart_nobody_is_jammed() -> None:
    low = RightOfWay("b", SETTINGS)
    for tick in range(300):
        assert low.rivals(0.1 * tick, WEST, 0.25, True, 0.0, [sighting("a", EAST)])
