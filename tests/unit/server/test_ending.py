from __future__ import annotations

from tests.unit.server.executive_rig import Rig


def test_explored_when_nothing_was_left_for_a_while() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 0.1, 2))
    rig.bid("ben")
    rig.wait(4.0, "anna", "ben")
    assert not rig.executive.exhausted(rig.now)
    rig.wait(0.5, "anna", "ben")
    assert rig.executive.exhausted(rig.now)
    assert rig.executive.remaining()[0]["reason"] == "below the minimum gain"


def test_not_while_somebody_explores_or_a_place_rests() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 20, 2))
    rig.wait(0.4, "anna")
    rig.progress("anna", 2.0)
    rig.wait(5.0, "anna")
    assert not rig.executive.exhausted(rig.now)
    rig.end("anna")
    rig.wait(3.0, "anna")
    assert not rig.executive.exhausted(rig.now)


def test_not_before_new_bids_were_looked_at() -> None:
    rig = Rig("anna")
    rig.bid("anna")
    rig.wait(5.0, "anna")
    rig.new_map()
    assert not rig.executive.exhausted(rig.now)  # its bid is on an older map
    rig.bid("anna", (5, 20, 2))
    assert not rig.executive.exhausted(rig.now)
    rig.wait(0.4, "anna")
    assert rig.goals() == {"anna": 5}


def test_a_quiet_map_needs_no_new_bid() -> None:
    rig = Rig("anna")
    rig.bid("anna")
    rig.wait(1.0, "anna")
    rig.new_map()
    rig.wait(3.5, "anna")
    assert not rig.executive.exhausted(rig.now)
    rig.wait(1.0, "anna")
    assert rig.executive.exhausted(rig.now)


def test_a_map_that_never_rests_does_not_keep_it_going_for_ever() -> None:
    rig = Rig("anna")
    rig.bid("anna")
    for _ in range(10):
        rig.wait(1.0, "anna")
        rig.bid("anna")
        rig.wait(0.4, "anna")
        rig.new_map()
    assert rig.executive.exhausted(rig.now)


def test_a_robot_that_never_bids_is_not_waited_for_for_ever() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna")
    rig.wait(19.0, "anna", "ben")
    assert not rig.executive.exhausted(rig.now)
    rig.wait(2.0, "anna", "ben")
    assert rig.executive.exhausted(rig.now)
    assert rig.executive.stalled(rig.now) is None


def test_a_robot_whose_bids_stopped_is_not_waited_for_either() -> None:
    rig = Rig("anna", "ben", bid_patience_s=10.0)
    rig.bid("anna")
    rig.bid("ben", (5, 20, 2))
    rig.wait(0.4, "anna", "ben")
    rig.end("ben")
    rig.wait(0.1, "anna", "ben")
    rig.new_map()
    rig.bid("anna")
    rig.wait(15.0, "anna", "ben")
    assert rig.goals() == {"ben": 5}  # it was sent by its old bid in time
    rig.end("ben")
    rig.wait(10.0, "anna", "ben")
    assert rig.goals() == {}
    assert rig.executive.exhausted(rig.now)


def test_not_without_anybody_in_the_pool() -> None:
    rig = Rig("anna")
    rig.bid("anna")
    rig.wait(1.0, "anna")
    rig.take(rig.executive.pause("anna", rig.now).sends)
    rig.wait(10.0, "anna")
    assert not rig.executive.exhausted(rig.now)
    assert rig.executive.stalled(rig.now) is None
    rig.take(rig.executive.resume("anna", rig.now).sends)
    rig.wait(4.5, "anna")
    assert rig.executive.exhausted(rig.now)


def test_stalled() -> None:
    rig = Rig()
    assert rig.executive.stalled(0.0) == "no robot has joined"
    rig = Rig("anna")
    assert rig.executive.stalled(1.0) is None
    rig.wait(21.0, "anna")
    assert rig.executive.stalled(rig.now) == "no robot bids"
    rig.wait(6.0)
    assert rig.executive.stalled(rig.now) == "every robot is lost"
    assert not rig.executive.exhausted(rig.now)


def test_old_bids_alone_end_nothing() -> None:
    rig = Rig("anna")
    rig.bid("anna")
    rig.wait(1.0, "anna")
    rig.new_map()
    rig.wait(25.0, "anna")
    assert not rig.executive.exhausted(rig.now)
    assert rig.executive.stalled(rig.now) == "no robot bids"


def test_a_visit_under_way_is_waited_for() -> None:
    rig = Rig("anna", "ben")
    rig.bid("anna")
    rig.bid("ben")
    rig.wait(4.5, "anna", "ben")
    assert rig.executive.exhausted(rig.now)
    assert rig.executive.visit("ben", 1.0, 1.0, rig.now).accepted
    assert not rig.executive.exhausted(rig.now)
    assert rig.executive.free("anna", rig.now)
    assert not rig.executive.free("ben", rig.now)
    assert not rig.executive.free("carol", rig.now)
