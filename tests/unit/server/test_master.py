"""The server's core, by events alone: a team of two, an operator, an observer."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from protocol import messages as words
from protocol import operator_messages as asks
from protocol.body import Body
from protocol.effects import PeerLeft, Received, Rejected, Send, Stop
from protocol.messages import Message
from protocol.world_messages import Finished, Join
from tests.unit.rooms import heard, sent
from tests.unit.server.master_rig import POSES, Rig, begun, bid, notes, of_type, report


@pytest.fixture
def rig() -> Iterator[Rig]:
    """A team of which `robot1` is there, with a map of one scan."""
    made = begun()
    yield made
    made.master.executive.check_invariants()


# --- joining ---------------------------------------------------------------------------------


def test_the_server_joins_the_clock_once() -> None:
    rig = Rig()
    assert Send("clock", "world", Join(role="server")) in rig.tick()
    assert Send("clock", "world", Join(role="server")) not in rig.tick()


def test_a_robot_of_the_team_is_welcome() -> None:
    rig = Rig()
    rig.now = 3.0
    effects = rig.hello("robot1", start=[1.0, 2.0, 0.0], start_sigma_m=1.0)
    assert of_type(effects, words.Welcome, "robot1") == [
        words.Welcome(now_s=3.0, strategy="nearest")
    ]
    assert "robot1 is here" in notes(effects)
    assert rig.master.roster.states == {"robot1": "at work", "robot2": "never seen"}
    assert rig.master.pose_of("robot1") == (1.0, 2.0, 0.0)
    assert rig.master.pose_of("robot2") is None


def test_saying_hello_twice_changes_nothing() -> None:
    rig = Rig()
    rig.hello("robot1")
    again = rig.hello("robot1")
    assert of_type(again, words.Welcome, "robot1")
    assert notes(again) == ""


@pytest.mark.parametrize(
    ("name", "role", "why"),
    [
        ("robot9", "robot", "its robots are robot1, robot2"),
        ("robot1", "operator", "a robot's name"),
    ],
)
def test_who_does_not_belong_is_refused_with_the_mend(name: str, role: str, why: str) -> None:
    rig = Rig()
    (refused,) = sent(rig.hello(name, role), name)
    assert isinstance(refused, words.Refused)
    assert why in refused.reason
    assert rig.says(name, asks.PauseRequest(robot="robot1")) == []


def test_before_a_hello_nobody_is_heard(rig: Rig) -> None:
    assert rig.beat("robot2") == []
    assert rig.says("boss", asks.PauseRequest(robot="robot1")) == []


def test_what_is_not_for_the_master_is_passed_over(rig: Rig) -> None:
    beat = words.Heartbeat(T_odom_base=IDENTITY, path_map=np.zeros((0, 2), np.float32))
    assert rig.master.handle(heard("clock", "robot1", beat), 0.0) == []
    assert rig.master.handle(PeerLeft("fleet", "robot1"), 0.0) == []
    assert rig.says("robot1", asks.RobotLost(robot="robot2", state="lost")) == []


def test_a_frame_that_comes_twice_counts_once(rig: Rig) -> None:
    event = heard("fleet", "robot1", report(2, IDENTITY, rig.now), 50)
    assert rig.master.handle(event, rig.now) != []
    assert rig.master.handle(event, rig.now) == []


def test_a_restarted_robot_begins_its_reports_anew(rig: Rig) -> None:
    effects = rig.hello("robot1", incarnation=1)
    assert "robot1 is back" in notes(effects)
    assert of_type(effects, words.MapSnapshot, "robot1")[0].number == 1
    answer = rig.report("robot1", 1)
    assert of_type(answer, words.ReportsReceived) == [words.ReportsReceived(number=1)]


def test_an_observer_gets_the_map_and_all_that_is_published(rig: Rig) -> None:
    welcome = rig.hello("console", "observer")
    (snapshot,) = of_type(welcome, words.MapSnapshot, "console")
    assert snapshot.number == 1
    rig.hello("console", "observer")
    rig.beat("robot1")
    assert len(of_type(rig.tick(POSES), words.TeamPoses, "console")) == 1


def test_an_operator_gets_no_map(rig: Rig) -> None:
    assert [type(m) for m in sent(rig.hello("boss", "operator"))] == [words.Welcome]


# --- mapping ---------------------------------------------------------------------------------


def test_a_report_is_placed_and_confirmed(rig: Rig) -> None:
    effects = rig.report("robot1", 2, Pose2(0.2, 0.1, 0.1))
    assert of_type(effects, words.ReportsReceived, "robot1") == [words.ReportsReceived(number=2)]
    (update,) = of_type(effects, words.PoseUpdate, "robot1")
    assert update.matched
    assert update.number == 2
    assert update.T_map_odom.distance_to(IDENTITY) < 0.05


def test_a_gap_in_the_reports_is_told(rig: Rig) -> None:
    for number in (3, 1):
        assert sent(rig.report("robot1", number)) == [words.ReportsReceived(number=1)]
    assert len(rig.master.merger.nodes) == 1


def test_only_robots_report(rig: Rig) -> None:
    rig.hello("boss", "operator")
    assert rig.says("boss", report(1, IDENTITY, 0.0)) == []
    assert rig.beat("boss") == []
    assert rig.bid("boss", 1) == []


def test_a_teammate_never_becomes_a_wall(rig: Rig) -> None:
    """The second robot stands where the first one's beams would see it."""
    rig.hello("robot2", start=[0.8, 0.0, 0.0])
    rig.beat("robot2")
    rig.report("robot1", 2, Pose2(0.1, 0.0, 0.0))
    scan = rig.master.merger.nodes[-1].scan
    ahead = np.abs(scan.bearings) < 0.05
    assert (scan.ranges[~ahead] > 0.0).any()
    disc = rig.master._intake.discs("robot1", rig.now)
    assert [(d.x, d.y) for d in disc] == [(0.8, 0.0)]


def test_changes_of_the_map_are_numbered_and_go_to_everybody(rig: Rig) -> None:
    rig.hello("console", "observer")
    rig.report("robot1", 2, Pose2(0.2, 0.1, 0.1))
    effects = rig.tick(0.6)
    for name in ("robot1", "console"):
        assert [delta.number for delta in of_type(effects, words.MapDelta, name)] == [2]
    assert of_type(rig.tick(0.6), words.MapDelta) == []


def test_the_whole_map_is_sent_to_who_asks_once_there_is_one(rig: Rig) -> None:
    (snapshot,) = sent(rig.says("robot1", words.MapRequest(have=0)), "robot1")
    assert isinstance(snapshot, words.MapSnapshot)
    early = Rig()
    early.hello("robot1")
    assert early.says("robot1", words.MapRequest(have=0)) == []


def test_the_team_hears_where_everybody_is(rig: Rig) -> None:
    rig.beat("robot1", Pose2(0.5, 0.0, 0.0), speed=0.2)
    (poses,) = of_type(rig.tick(POSES), words.TeamPoses, "robot1")
    assert poses.robots == ("robot1",)
    assert poses.poses_map[0, 1:3] == pytest.approx([0.5, 0.0])
    assert poses.path_lengths == (1,)
    silent = Rig()
    silent.hello("robot1")
    assert of_type(silent.tick(POSES), words.TeamPoses) == []


def test_where_one_does_not_fit_is_told_to_all_of_its_size_or_more(rig: Rig) -> None:
    rig.hello("robot2", body=Body(radius_m=0.15).model_dump())
    word = words.TightPlace(place_map=(1.0, 2.0))
    assert rig.says("robot1", word) == []
    assert rig.says("robot2", word) == [Send("fleet", "robot1", word)]
    rig.hello("console", "observer")
    assert rig.says("console", word) == []


# --- silence and rubbish -----------------------------------------------------------------------


def test_a_silent_robot_is_lost_until_it_speaks_again(rig: Rig) -> None:
    rig.hello("console", "observer")
    effects = rig.tick(6.0)
    assert "robot1 is silent" in notes(effects)
    lost = asks.RobotLost(robot="robot1", state="lost")
    assert of_type(effects, asks.RobotLost, "console") == [lost]
    assert rig.master.roster.states["robot1"].startswith("lost at 6.")
    back = rig.beat("robot1")
    assert "speaks again" in notes(back)
    assert rig.master.roster.states["robot1"] == "at work"
    assert of_type(back, asks.RobotLost)[0].state == "back"


def test_rubbish_is_counted_and_named_once_and_the_books_stay_small() -> None:
    rig = Rig()
    first = rig.master.handle(Rejected("fleet", "evil", "not msgpack: X"), 0.0)
    assert notes(first) == "dropped a frame of evil: not msgpack: X"
    assert rig.master.handle(Rejected("fleet", "evil", "not msgpack: Y"), 0.0) == []
    for k in range(300):
        rig.master.handle(Rejected("fleet", "evil", f"new fault {k}"), 0.0)
    assert rig.master.faults.counts["evil", "not msgpack"] == 2
    assert len(rig.master.faults.counts) == 101
    assert sum(rig.master.faults.counts.values()) == 302


# --- tasks and operators ------------------------------------------------------------------------


def award_of(rig: Rig) -> words.Award:
    """Let `robot1` bid and win."""
    rig.bid("robot1", 1)
    effects = [effect for _ in range(10) for effect in rig.tick(0.1)]
    award: words.Award = of_type(effects, words.Award, "robot1")[0]
    return award


def test_a_bid_wins_a_task_and_the_robot_sees_it_through(rig: Rig) -> None:
    award = award_of(rig)
    assert (award.kind, award.goal_map) == ("explore", (1.0, 0.0))
    rig.says("robot1", words.TaskProgress(task=award.task, remaining_m=0.5))
    assert rig.master.executive.busy("robot1")
    rig.says("robot1", words.TaskEnd(task=award.task, outcome="done"))
    assert not rig.master.executive.busy("robot1")


def test_a_slow_robots_way_is_dearer() -> None:
    rig = Rig(cost_weights={"robot1": 2.0})
    rig.hello("robot1")
    rig.bid("robot1", 1)
    member = rig.master.executive._pool.get("robot1")
    assert member is not None
    assert member.bid is not None
    assert member.bid.cost_weight == 2.0


def test_a_bid_that_contradicts_itself_is_dropped(rig: Rig) -> None:
    effects = rig.says("robot1", bid(1, 1, 1.0, 20.0, places=2))
    assert "dropped a bid of robot1" in notes(effects)


@pytest.mark.parametrize(
    ("request_", "text"),
    [
        (asks.VisitRequest(robot="robot1", x_m=1.0, y_m=0.0), "goes to (1.00, 0.00)"),
        (asks.PauseRequest(robot="robot1"), "is paused"),
        (asks.ResumeRequest(robot="robot1"), "with the team already"),
        (asks.DriveRequest(robot="robot1", speed_m_s=0.1, turn_rate_rad_s=0.0), "drives at 0.10"),
    ],
)
def test_an_operators_word_is_carried_out_and_answered(
    rig: Rig, request_: Message, text: str
) -> None:
    rig.hello("boss", "operator")
    (answer,) = of_type(rig.says("boss", request_), asks.Answer, "boss")
    assert answer.accepted
    assert text in answer.text


def test_a_word_about_a_robot_nobody_knows_is_refused(rig: Rig) -> None:
    rig.hello("boss", "operator")
    (answer,) = of_type(rig.says("boss", asks.PauseRequest(robot="robot7")), asks.Answer)
    assert not answer.accepted
    assert "robot1" in answer.text


# --- the end -----------------------------------------------------------------------------------


def test_the_time_limit_ends_the_mission_and_the_server_leaves_after_last_words() -> None:
    rig = Rig(time_limit=2.0)
    rig.hello("robot1")
    rig.hello("console", "observer")
    assert rig.master.ended is None
    effects = rig.tick(2.0)
    for name in ("robot1", "console"):
        (end,) = of_type(effects, words.MissionEnd, name)
        assert end.ended == "time_limit"
    assert rig.report("robot1", 1) != []  # last words are heard
    effects = rig.tick(1.0)
    assert effects[-2:] == [
        Send("clock", "world", Finished(ended="time_limit", reason="2 s are over")),
        Stop("time_limit"),
    ]
    assert rig.master.roster.states == {"robot1": "finished", "robot2": "never seen"}
    rig.now += 1.0
    assert rig.report("robot1", 2) == []


def test_a_request_to_stop_ends_the_mission_once(rig: Rig) -> None:
    rig.hello("boss", "operator")
    effects = rig.says("boss", asks.StopRequest())
    assert of_type(effects, asks.Answer, "boss")[0].accepted
    assert of_type(effects, words.MissionEnd, "robot1")[0].reason == "asked for by boss"
    again = rig.says("boss", asks.StopRequest(ended="coverage"))
    assert of_type(again, words.MissionEnd) == []
    assert rig.master.ended == "operator"


def test_when_nothing_is_left_the_mission_is_over(rig: Rig) -> None:
    for k in range(200):
        rig.bid("robot1", k + 1, gain=0.0)
        rig.beat("robot1")
        rig.tick(0.5)
        if rig.master.ended:
            break
    assert rig.master.ended == "explored"
    assert rig.master.reason == "nothing useful is left"


def test_without_any_robot_left_the_mission_fails_after_a_while(rig: Rig) -> None:
    rig.tick(6.0)
    rig.beat("robot1")
    rig.tick(0.1)
    rig.tick(6.0)
    rig.tick(59.0)
    assert rig.master.ended is None
    rig.tick(2.0)
    assert (rig.master.ended, rig.master.reason) == ("failed", "all robots are lost")


def test_the_next_deadline_is_the_nearest_of_all(rig: Rig) -> None:
    due = rig.master.next_deadline()
    assert due is not None
    assert rig.now < due <= rig.now + 0.5
    assert isinstance(heard("fleet", "a", words.Terminate(task=1)), Received)
