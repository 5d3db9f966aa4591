from __future__ import annotations

from protocol.world_messages import Through
from sim_world.agreement import Agreement

TEAM = ("ann", "bob", "cid")


def through(held: int, *shut_out: str) -> Through:
    return Through(through=True, held=held, shut_out=shut_out)


def test_it_is_over_when_all_that_are_there_are_through_and_hold_the_same() -> None:
    agreement = Agreement(100.0)
    assert agreement.over(TEAM, 0.0) == ""
    for name in TEAM[:2]:
        agreement.hear(name, through(5))
    assert agreement.over(TEAM, 1.0) == ""
    assert agreement.over(TEAM[:2], 1.0)
    agreement.hear("cid", through(6))
    assert agreement.over(TEAM, 2.0) == "", "it holds something else"
    agreement.hear("cid", through(5))
    assert "hold the same" in agreement.over(TEAM, 3.0)
    agreement.hear("ann", Through(through=False, held=5))
    assert agreement.over(TEAM, 4.0) == "", "one of them has learnt better"
    agreement.forget("ann")
    assert agreement.over(TEAM, 5.0) == ""
    assert agreement.over((), 6.0) == "", "nobody is there"


def test_those_that_never_come_to_hold_the_same_are_not_waited_for_for_ever() -> None:
    agreement = Agreement(100.0)
    for held, name in enumerate(TEAM):
        agreement.hear(name, through(held))
    assert agreement.over(TEAM, 10.0) == ""
    assert agreement.over(TEAM, 109.0) == ""
    assert "parted" in agreement.over(TEAM, 110.0)


def test_whom_most_do_not_listen_to_does_not_count() -> None:
    agreement = Agreement(100.0)
    agreement.hear("ann", through(5, "cid"))
    agreement.hear("bob", through(5))
    agreement.hear("cid", Through(through=False, held=9))
    assert agreement.over(TEAM, 0.0) == ""
    agreement.hear("bob", through(5, "cid"))
    assert agreement.over(TEAM, 1.0)
