from __future__ import annotations

from protocol.messages import Award
from tests.unit.server.executive_rig import Rig, awards, terminations


def team() -> Rig:
    rig = Rig("anna", "ben")
    rig.bid("anna", (5, 20, 2))
    rig.bid("ben", (5, 20, 8))
    rig.wait(0.4)
    assert rig.goals() == {"anna": 5}
    return rig


def test_a_visit_ends_the_task_is_covered_for_and_leads_back() -> None:
    rig = team()
    accepted, text, sends = rig.executive.visit("anna", 40.0, 1.0, rig.now)
    rig.take(sends)
    assert accepted and text == "anna goes to (40.00, 1.00)"
    assert awards(sends) == [("anna", "visit", 40), ("ben", "explore", 5)]
    assert terminations(sends) == []
    assert rig.executive.mode("anna") == "visit"
    assert not rig.executive.exhausted(rig.now)
    rig.progress("anna", 30.0)
    rig.end("anna")
    assert rig.executive.mode("anna") == "pool"
    rig.bid("anna", (9, 20, 8))
    rig.wait(0.4)
    assert rig.goals() == {"anna": 9, "ben": 5}


def test_a_visit_is_tried_again_and_failure_leads_back_too() -> None:
    rig = team()
    rig.take(rig.executive.visit("anna", 40.0, 1.0, rig.now).sends)
    assert awards(rig.end("anna", "failed", "stuck")) == [("anna", "visit", 40)]
    rig.end("anna", "failed", "stuck")
    assert rig.executive.mode("anna") == "visit"
    rig.end("anna", "failed", "stuck")
    assert rig.executive.mode("anna") == "pool"


def test_a_place_out_of_reach_is_not_tried_again() -> None:
    rig = team()
    rig.take(rig.executive.visit("anna", 40.0, 1.0, rig.now).sends)
    rig.end("anna", "unreachable")
    assert rig.executive.mode("anna") == "pool"


def test_a_robot_lost_on_a_visit_is_with_the_team_when_it_is_back() -> None:
    rig = team()
    rig.take(rig.executive.visit("anna", 40.0, 1.0, rig.now).sends)
    rig.take(rig.executive.robot_lost("anna", rig.now))
    assert rig.executive.mode("anna") == "lost"
    rig.take(rig.executive.contact("anna", rig.now))
    assert rig.executive.mode("anna") == "pool"


def test_a_second_visit_replaces_the_first() -> None:
    rig = team()
    rig.take(rig.executive.visit("anna", 40.0, 1.0, rig.now).sends)
    rig.take(rig.executive.visit("anna", 50.0, 1.0, rig.now).sends)
    assert rig.goals("visit") == {"anna": 50}
    rig.end("anna")
    assert rig.executive.mode("anna") == "pool"


def test_a_pause_holds_until_it_is_resumed() -> None:
    rig = team()
    accepted, text, sends = rig.executive.pause("anna", rig.now)
    rig.take(sends)
    assert accepted and text == "anna is paused"
    assert [(to, kind) for to, kind, _ in awards(sends)] == [("anna", "pause"), ("ben", "explore")]
    rig.progress("anna", 0.0)
    assert rig.executive.pause("anna", rig.now) == (True, "anna is paused already", [])
    rig.wait(60.0, "anna", "ben", step=1.0)
    assert rig.goals("pause").keys() == {"anna"}
    rig.bid("anna", (9, 20, 1))
    rig.wait(0.4, "anna", "ben")
    assert "anna" not in rig.goals()
    sends = rig.take(rig.executive.resume("anna", rig.now).sends)
    assert awards(sends) == [("anna", "explore", 9)]
    assert rig.executive.resume("anna", rig.now).text == "anna is with the team already"


def test_a_lost_robot_is_paused_when_it_is_back() -> None:
    rig = team()
    rig.take(rig.executive.robot_lost("anna", rig.now))
    accepted, text, sends = rig.executive.pause("anna", rig.now)
    assert accepted and "when it is back" in text
    assert awards(rig.take(sends)) == []
    assert awards(rig.take(rig.executive.contact("anna", rig.now)))[0][:2] == ("anna", "pause")


def test_a_lost_robot_cannot_be_sent_or_driven() -> None:
    rig = team()
    rig.take(rig.executive.robot_lost("anna", rig.now))
    assert not rig.executive.visit("anna", 1.0, 1.0, rig.now).accepted
    assert "lost" in rig.executive.drive("anna", 1.0, 0.0, rig.now).text


def test_a_drive_runs_on_with_every_word_and_halts_without() -> None:
    rig = team()
    sends = rig.take(rig.executive.drive("anna", 0.3, 0.1, rig.now).sends)
    assert awards(sends)[0][:2] == ("anna", "drive")
    task = rig.task("anna")
    for _ in range(6):
        rig.wait(0.5, "anna", "ben")
        (send,) = rig.take(rig.executive.drive("anna", 0.2, 0.0, rig.now).sends)
        assert isinstance(send.message, Award)
        assert (send.message.task, send.message.speed_m_s) == (task, 0.2)
    assert terminations(rig.wait(1.5, "anna", "ben")) == [("anna", task)]
    assert rig.executive.mode("anna") == "drive"  # nobody takes it out of the operator's hand
    rig.bid("anna", (9, 20, 1))
    rig.wait(0.4, "anna", "ben")
    assert "anna" not in rig.goals()
    rig.take(rig.executive.resume("anna", rig.now).sends)
    assert rig.goals()["anna"] == 9


def test_a_robot_lost_while_driven_stays_in_the_operators_hand() -> None:
    rig = team()
    rig.take(rig.executive.drive("anna", 0.3, 0.1, rig.now).sends)
    rig.take(rig.executive.robot_lost("anna", rig.now))
    rig.take(rig.executive.contact("anna", rig.now))
    assert rig.executive.mode("anna") == "drive"


def test_a_pause_may_follow_a_drive_and_a_visit_a_pause() -> None:
    rig = team()
    rig.take(rig.executive.drive("anna", 0.3, 0.1, rig.now).sends)
    rig.take(rig.executive.pause("anna", rig.now).sends)
    assert rig.executive.mode("anna") == "pause"
    rig.take(rig.executive.visit("anna", 3.0, 0.0, rig.now).sends)
    assert rig.executive.mode("anna") == "visit"
    rig.take(rig.executive.resume("anna", rig.now).sends)
    assert rig.executive.mode("anna") == "pool"


def test_unknown_robots_are_named() -> None:
    rig = team()
    executive = rig.executive
    for reply in (
        executive.visit("zoe", 0.0, 0.0, 0.0),
        executive.pause("zoe", 0.0),
        executive.resume("zoe", 0.0),
        executive.drive("zoe", 0.0, 0.0, 0.0),
    ):
        assert not reply.accepted
        assert reply.text == "there is no robot 'zoe' in this team; its robots: anna, ben"
