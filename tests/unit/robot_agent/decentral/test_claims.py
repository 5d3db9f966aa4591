from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coordination.bid import RobotBid
from mapping.geometry import IDENTITY
from robot_agent.decentral.claims import Claim, ClaimTerms, claimed, way_or_flight

TERMS = ClaimTerms(apart=2.0, overlap=0.8, tie=0.5)
HERE, NEAR_BY, FAR = (5.0, 0.0), (6.5, 0.0), (20.0, 0.0)


def bid(*places: tuple[float, float], cost: float = 10.0, half: float = 1.0) -> RobotBid:
    at = np.array(places, dtype=np.float64).reshape(-1, 2)
    return RobotBid(
        "me", 1, 1, IDENTITY, at,
        np.full(len(at), 5.0),
        np.full(len(at), cost),
        np.column_stack((at - half, at + half)),
        np.zeros((0, 2)),
        np.zeros(len(at)),
    )  # fmt: skip


def taken(own: RobotBid, *claims: Claim, nearest: float = math.inf) -> list[bool]:
    return claimed(own, np.full(len(own), nearest), claims, TERMS).tolist()


def test_without_claims_all_is_free() -> None:
    assert taken(bid(HERE, FAR)) == [False, False]
    assert taken(bid(), Claim("bob", HERE, 1.0)) == []


def test_what_is_near_a_claimed_goal_is_left_to_who_comes_first() -> None:
    assert taken(bid(HERE, NEAR_BY, FAR), Claim("bob", HERE, 4.0)) == [True, True, False]
    assert taken(bid(HERE, NEAR_BY, FAR), Claim("bob", HERE, 14.0)) == [False, False, False]


@pytest.mark.parametrize(("robot", "way", "theirs"), [
    ("abe", 10.4, True), ("abe", 10.6, False), ("zoe", 9.6, False), ("zoe", 9.4, True),
])  # fmt: skip
def test_of_two_that_are_as_near_the_smaller_name_comes_first(
    robot: str, way: float, theirs: bool
) -> None:
    assert taken(bid(HERE), Claim(robot, HERE, way)) == [theirs]


def test_a_region_seen_from_the_goal_is_left_too_unless_one_is_nearest_to_it() -> None:
    wide = bid(HERE, (8.0, 0.0), FAR, half=16.0)  # 29/32 of the second lies in the first
    claim = Claim("bob", HERE, 4.0)
    assert taken(wide, claim, nearest=9.0) == [True, True, False]
    assert taken(wide, claim, nearest=11.0) == [True, False, False]


def test_of_a_goal_where_the_map_shows_nothing_no_region_is_known() -> None:
    wide = bid(FAR, half=100.0)
    assert taken(wide, Claim("bob", HERE, 4.0), nearest=0.0) == [False]


def test_as_the_crow_flies_where_no_way_is_known() -> None:
    assert way_or_flight(7.0, HERE, FAR) == 7.0
    assert way_or_flight(math.inf, HERE, FAR) == 15.0


WAYS = st.lists(st.floats(0.0, 30.0), min_size=2, max_size=4)


@given(WAYS)
def test_of_all_that_head_for_one_place_exactly_one_goes_on(ways: list[float]) -> None:
    """Unless ways differ by about the tie: then more may turn away, but never all keep it."""
    names = [f"robot{k}" for k in range(len(ways))]
    keeps = []
    for name, way in zip(names, ways, strict=True):
        own = replace(bid(HERE, cost=way), robot=name)
        others = [Claim(n, HERE, w) for n, w in zip(names, ways, strict=True) if n != name]
        keeps.append(not taken(own, *others)[0])
    assert sum(keeps) <= 1
    apart = sorted(ways)
    if apart[1] - apart[0] > TERMS.tie:
        assert keeps[ways.index(apart[0])]
