from __future__ import annotations

import pytest

from mapping.geometry import Pose2
from protocol.effects import Send
from protocol.messages import MapRequest, ReportsReceived
from sim_world.witnesses import Witnesses
from tests.unit.sim_world.test_judge import delta, judge, whole_truth

TRUTH = {"ann": Pose2(0.0, 0.0, 0.0)}


def asked(have: int, name: str) -> list[Send]:
    return [Send("body", name, MapRequest(have=have))]


def test_with_nobody_there_nobody_is_asked() -> None:
    assert Witnesses(judge()).ask([]) == []


def test_the_first_is_asked_for_what_changed_since_it_was_heard() -> None:
    witnesses = Witnesses(judge())
    assert witnesses.ask(["ann", "bob"]) == asked(0, "ann")
    witnesses.hear("ann", whole_truth(7), TRUTH, 0.0)
    assert witnesses.ask(["ann", "bob"]) == asked(7, "ann")
    witnesses.hear("ann", delta(8, 0, 0, 2, 2), TRUTH, 0.0)
    assert witnesses.ask(["ann", "bob"]) == asked(8, "ann")


def test_another_one_is_asked_for_everything() -> None:
    the_judge = judge()
    witnesses = Witnesses(the_judge)
    witnesses.ask(["ann"])
    witnesses.hear("ann", whole_truth(7), TRUTH, 0.0)
    assert witnesses.ask(["bob"]) == asked(0, "bob")
    witnesses.hear("bob", whole_truth(3), TRUTH, 0.0)
    assert the_judge.number == 3
    assert witnesses.ask(["bob"]) == asked(3, "bob")


def test_what_nobody_asked_for_does_not_count() -> None:
    the_judge = judge()
    witnesses = Witnesses(the_judge)
    witnesses.hear("ann", whole_truth(7), TRUTH, 0.0)
    witnesses.ask(["ann"])
    witnesses.hear("bob", whole_truth(7), TRUTH, 0.0)
    witnesses.hear("ann", ReportsReceived(number=3), TRUTH, 0.0)
    assert the_judge.geometry is None


def test_what_is_no_map_is_refused() -> None:
    witnesses = Witnesses(judge())
    witnesses.ask(["ann"])
    witnesses.hear("ann", whole_truth(1), TRUTH, 0.0)
    with pytest.raises(ValueError, match="not believed"):
        witnesses.hear("ann", delta(2, 10**6, 10**6, 2, 2), TRUTH, 0.0)
