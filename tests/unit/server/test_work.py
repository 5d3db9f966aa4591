from __future__ import annotations

import pytest

from protocol.body import Body
from protocol.messages import Award, Terminate
from server.executive_settings import ExecutiveSettings
from server.pool import Member
from server.work import Work


@pytest.fixture
def work() -> Work:
    return Work(ExecutiveSettings(lease_s=10.0, drive_s=1.0))


@pytest.fixture
def anna(work: Work) -> Member:
    return Member("anna", Body(), work.new_robot("anna", 0.0), 0.0)


def test_an_award_says_all(work: Work, anna: Member) -> None:
    leaf = work.leaf("anna", "explore", (1.0, 2.0), gain=9.0)
    assert work.flush() == [] and not work.live_tasks()
    anna.node.add(leaf, 0.0)
    (send,) = work.flush()
    assert (send.channel, send.to) == ("fleet", "anna")
    assert send.message == Award(task=1, kind="explore", goal_map=(1.0, 2.0), lease_s=10.0)
    assert work.flush() == []
    assert work.live_tasks() == [leaf.task]


def test_a_termination_before_an_award_is_left_out(work: Work, anna: Member) -> None:
    anna.node.add(work.leaf("anna", "explore", (1.0, 2.0)), 0.0)
    work.flush()
    work.take_back(anna, "sent elsewhere", 1.0)
    anna.node.add(work.leaf("anna", "explore", (5.0, 2.0)), 1.0)
    work.dismiss("ben", 7)
    sends = work.flush()
    assert [send.to for send in sends] == ["anna", "ben"]
    assert isinstance(sends[0].message, Award) and isinstance(sends[1].message, Terminate)
    work.take_back(anna, "over", 2.0)
    assert [send.message for send in work.flush()] == [Terminate(task=2)]


def test_leases_by_kind(work: Work, anna: Member) -> None:
    lengths = {}
    for kind in ("explore", "visit", "wait", "drive", "pause"):
        anna.node.add(work.leaf("anna", kind, (0.0, 0.0)), 0.0)  # type: ignore[arg-type]
        (send,) = work.flush()
        assert isinstance(send.message, Award)
        lengths[kind] = send.message.lease_s
        work.take_back(anna, "next", 0.0)
        work.flush()
    assert lengths.pop("pause") > 3600.0
    assert lengths == {"explore": 10.0, "visit": 10.0, "wait": 10.0, "drive": 1.0}


def test_a_robot_at_its_waiting_place_may_stay(work: Work, anna: Member) -> None:
    leaf = work.leaf("anna", "wait", (0.0, 0.0))
    anna.node.add(leaf, 0.0)
    work.progress(leaf, 3.0, 0.0)
    work.progress(leaf, 0.2, 1.0)
    for t in range(2, 60):
        work.contact(anna, float(t))
        work.tick(float(t))
    assert leaf.running
    work.tick(70.0)
    assert not leaf.running and work.happenings[-1]["reason"] == "silent for 11 s"


def test_sendings_become_rarer(work: Work, anna: Member) -> None:
    anna.node.add(work.leaf("anna", "pause", (0.0, 0.0)), 0.0)
    work.flush()
    times = []
    for _ in range(6):
        deadline = work.next_deadline()
        assert deadline is not None
        work.contact(anna, deadline)
        work.tick(deadline)
        if work.flush():
            times.append(deadline)
    assert times == [1.0, 3.0, 7.0, 15.0, 23.0] or times[:3] == [1.0, 3.0, 7.0]


def test_no_tasks_no_deadline(work: Work, anna: Member) -> None:
    assert work.next_deadline() is None
    work.contact(anna, 1.0)
    work.expire(anna, "lost", 1.0)
    assert work.happenings == []


def test_an_award_is_on_record_with_what_it_should_bring_and_cost(work: Work, anna: Member) -> None:
    anna.node.add(work.leaf("anna", "explore", (1.0, 2.0), gain=12.25, cost=6.5), 0.0)
    (award,) = [event for event in work.happenings if event["event"] == "awarded"]
    assert (award["gain_m2"], award["cost_m"]) == (12.25, 6.5)
