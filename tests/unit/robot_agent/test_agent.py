"""A robot's core, by events alone: body frames and the server's words in, effects out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2, wrap_angle
from protocol import messages as words
from protocol.body import Body, Lidar
from protocol.effects import Effect, Note, PeerLeft, Rejected, Send, Stop
from protocol.messages import Message
from protocol.world_messages import (
    BodyFrame,
    Join,
    Joined,
    JoinRefused,
    MotionCommand,
    Ping,
    Shutdown,
)
from robot_agent.agent import Agent
from robot_agent.settings import RobotSettings
from tests.unit.robot_agent.test_explorer import hall, unknown_beyond
from tests.unit.robot_agent.test_team_view import poses
from tests.unit.rooms import BEAMS, RANGE_MAX, heard, room, sent

ROOM = room()
BODY = Body(radius_m=0.2, lidar=Lidar(field_of_view_deg=360.0, beams=BEAMS, range_max_m=RANGE_MAX))
DT = 0.1


class Rig:
    """A robot whose body obeys at once, in a room that it sees without noise."""

    def __init__(self, look_around: bool = True, **settings: Any) -> None:
        values = {"look_around": look_around, "mapping": {"resolution_m": 0.1}} | settings
        values.setdefault("navigation", {"planning_map": {"resolution_m": 0.1}})
        self.agent = Agent("robot1", RobotSettings.model_validate(values))
        self.now = 0.0
        self.instant = 0
        self.T_world_base = IDENTITY
        self.command = (0.0, 0.0)

    def body(self, message: Message) -> list[Effect]:
        return self.agent.handle(heard("body", "world", message), self.now)

    def server(self, message: Message) -> list[Effect]:
        return self.agent.handle(heard("radio", "server", message), self.now)

    def join(self, welcome: bool = True, aligned: bool = True, **fields: Any) -> list[Effect]:
        """Switch the body on; let the server welcome the robot and place it in its map."""
        self.agent.tick(0.0)
        values = {"lockstep": True, "now_s": 0.0, "step_s": DT, "body": BODY} | fields
        effects = self.body(Joined(**values))
        if welcome:
            self.server(words.Welcome(now_s=0.0))
        if aligned:
            self.place(True)
        return effects

    def place(self, matched: bool, T_map_odom: Pose2 = IDENTITY) -> None:
        self.server(
            words.PoseUpdate(number=1, T_map_odom=T_map_odom, uncertainty_m=0.1, matched=matched)
        )

    def live(self, seconds: float = DT) -> list[Effect]:
        """Some control periods; a sweep at every other instant."""
        effects: list[Effect] = []
        for _ in range(round(seconds / DT)):
            self.instant += 1
            self.now = round(self.instant * DT, 6)
            speed, rate = self.command
            self.T_world_base = self.T_world_base @ Pose2(speed * DT, 0.0, wrap_angle(rate * DT))
            effects += self.body(self.frame(self.instant % 2 == 1))
            for word in sent(effects, "world")[-1:]:
                if isinstance(word, MotionCommand):
                    self.command = (word.speed_m_s, word.turn_rate_rad_s)
        return effects

    def frame(self, sweep: bool) -> BodyFrame:
        lidar = BODY.lidar
        bearings = lidar.bearing_start + lidar.bearing_step * np.arange(lidar.beams)
        ranges = ROOM.cast(self.T_world_base, bearings, RANGE_MAX).astype(np.float32)
        return BodyFrame(
            stamp_s=self.now,
            T_wheel_base=self.T_world_base,
            bumped=False,
            ranges=ranges if sweep else np.zeros(0, dtype=np.float32),
        )


def of_type(effects: list[Effect], kind: type[Message]) -> list[Any]:
    return [message for message in sent(effects) if isinstance(message, kind)]


# --- joining ---------------------------------------------------------------------------------


def test_a_robot_knocks_at_the_worlds_door_until_it_opens() -> None:
    agent = Agent("robot1", RobotSettings(), incarnation=3)
    assert agent.next_deadline() == 0.0
    assert agent.tick(0.0) == [Send("body", "world", Join(role="robot", incarnation=3))]
    assert agent.next_deadline() == 1.0
    assert len(agent.tick(1.0)) == 1


def test_then_it_introduces_itself_to_the_server_until_it_is_welcome() -> None:
    rig = Rig()
    start = Pose2(1.0, 2.0, 0.5)
    effects = rig.join(welcome=False, aligned=False, start=start, start_sigma_m=1.0)
    (hello,) = of_type(effects, words.Hello)
    assert (hello.role, hello.body, hello.start, hello.start_sigma_m) == ("robot", BODY, start, 1.0)
    assert rig.agent.pose_map() == start
    assert of_type(rig.agent.tick(1.0), words.Hello) == [hello]
    rig.server(words.Welcome(now_s=0.0))
    assert rig.agent.tick(2.0) == []


def test_a_second_joined_changes_nothing() -> None:
    rig = Rig()
    rig.join()
    assert rig.body(Joined(lockstep=True, now_s=0.0, step_s=DT)) == []


def test_one_without_a_described_body_has_the_usual_one() -> None:
    rig = Rig()
    rig.join(body=None)
    assert rig.agent.pose_map() == IDENTITY
    assert of_type(rig.live(), MotionCommand)


@pytest.mark.parametrize("refusal", [JoinRefused(reason="taken"), words.Refused(reason="taken")])
def test_a_robot_that_is_refused_gives_up_and_says_why(refusal: Message) -> None:
    rig = Rig()
    assert rig.body(refusal) == [Note("error", "taken"), Stop("refused: taken")]


def test_when_the_world_shuts_down_it_is_over() -> None:
    assert Rig().body(Shutdown()) == [Stop("over")]


def test_before_it_has_a_body_it_understands_nothing() -> None:
    rig = Rig()
    for message in (
        hall(),
        unknown_beyond(1),
        words.ReportsReceived(number=1),
        words.Award(task=1, kind="pause", goal_map=(0.0, 0.0), lease_s=1.0),
        words.Terminate(task=1),
        words.MissionEnd(ended="explored"),
    ):
        assert rig.server(message) == []
    assert rig.body(rig.frame(True)) == []
    assert rig.agent.pose_map() == IDENTITY


def test_what_it_need_not_know_is_passed_over_and_rubbish_counted() -> None:
    rig = Rig()
    assert rig.body(Ping()) == []
    assert rig.agent.handle(PeerLeft("radio", "server"), 0.0) == []
    (note,) = rig.agent.handle(Rejected("radio", "evil", "not msgpack"), 0.0)
    assert isinstance(note, Note)
    assert "evil" in note.text
    assert rig.agent.handle(Rejected("radio", "evil", "not msgpack"), 0.0) == []


# --- looking around, mapping, reporting ---------------------------------------------------------


def test_it_turns_on_the_spot_until_it_has_seen_all_round_and_is_placed() -> None:
    rig = Rig()
    rig.join(aligned=False)
    effects = rig.live(6.0)
    commands = of_type(effects, MotionCommand)
    assert all(c.speed_m_s == 0.0 and c.turn_rate_rad_s > 0.5 for c in commands)
    rig.place(True)
    rig.live(0.2)
    assert rig.command == (0.0, 0.0)
    assert rig.agent.pose_map().distance_to(rig.T_world_base) < 0.05


def test_without_a_server_it_stands_still() -> None:
    rig = Rig()
    rig.join(welcome=False, aligned=False)
    effects = rig.live(1.0)
    assert {c.turn_rate_rad_s for c in of_type(effects, MotionCommand)} == {0.0}
    assert of_type(effects, words.ScanReport) == []


def test_it_reports_and_sends_again_what_the_server_does_not_confirm() -> None:
    rig = Rig(mapping={"resolution_m": 0.1, "report_every": 1, "news_every": 1})
    rig.join(aligned=False)
    reports = of_type(rig.live(1.0), words.ScanReport)
    assert [report.number for report in reports] == [1, 2, 3, 4, 5]
    again = of_type(rig.agent.tick(5.0), words.ScanReport)
    assert [report.number for report in again] == [1, 2, 3, 4, 5]
    lacking = rig.server(words.ReportsReceived(number=2))
    rig.now = 9.0
    lacking = rig.server(words.ReportsReceived(number=2))
    assert [report.number for report in of_type(lacking, words.ScanReport)] == [3, 4, 5]
    rig.server(words.ReportsReceived(number=5))
    assert rig.agent.tick(20.0) == []


def test_it_tells_now_and_then_where_it_is() -> None:
    rig = Rig(look_around=False)
    rig.join()
    beats = of_type(rig.live(1.0), words.Heartbeat)
    assert len(beats) == 4
    assert beats[-1].T_odom_base.distance_to(rig.T_world_base) < 0.05


def test_where_its_map_lies_in_the_teams_moves_its_pose() -> None:
    rig = Rig(look_around=False)
    rig.join()
    rig.live(0.3)
    rig.place(False, Pose2(2.0, 0.0, 0.0))
    assert rig.agent.pose_map().x == pytest.approx(rig.T_world_base.x + 2.0, abs=0.05)


def test_a_teammate_in_view_is_kept_out_of_the_map() -> None:
    rig = Rig(look_around=False, mapping={"resolution_m": 0.1, "report_every": 1})
    rig.join()
    rig.server(poses("robot1", "robot2", "robot3"))  # at (1, 0) and (2, 0): on the ray ahead
    (report,) = of_type(rig.live(0.1), words.ScanReport)
    bearings = BODY.lidar.bearing_start + BODY.lidar.bearing_step * np.arange(BEAMS)
    assert math.isclose(bearings[BEAMS // 2], 0.0, abs_tol=1e-9)
    points = np.column_stack((report.ranges * np.cos(bearings), report.ranges * np.sin(bearings)))
    near = np.hypot(points[:, 0] - 2.0, points[:, 1]) < 0.3
    assert not (near & (report.ranges > 0.0)).any()


# --- the team's map and tasks -------------------------------------------------------------------


def with_map(**settings: Any) -> Rig:
    rig = Rig(look_around=False, **settings)
    rig.join()
    rig.live(0.2)
    rig.server(hall())
    rig.server(unknown_beyond(2))
    return rig


def test_it_bids_on_the_teams_map_as_soon_as_it_is_placed() -> None:
    rig = with_map()
    (bid,) = of_type(rig.live(0.5), words.Bid)
    assert bid.map_number == 2
    assert len(bid.places_map) > 0
    unplaced = Rig(look_around=False)
    unplaced.join(aligned=False)
    unplaced.server(hall())
    assert of_type(unplaced.live(0.5), words.Bid) == []


def test_where_a_teammate_does_not_fit_it_does_not_go_either() -> None:
    rig = with_map()
    (before,) = of_type(rig.live(0.5), words.Bid)
    assert len(before.places_map) > 0
    for y in np.arange(-0.8, 0.9, 0.2):
        rig.server(words.TightPlace(place_map=(1.3, float(y))))
    assert rig.agent._body_parts is not None
    assert (rig.agent._body_parts[1]._tried == 2).any()
    assert [bid.map_number for bid in of_type(rig.live(1.0), words.Bid)] == [2]
    Rig().server(words.TightPlace(place_map=(1.3, 0.0)))  # not switched on: no map to note it in


def test_it_drives_where_it_is_sent_and_back_to_rest_when_told() -> None:
    rig = with_map()
    rig.server(words.Award(task=1, kind="visit", goal_map=(1.0, 0.0), lease_s=9.0))
    effects = rig.live(2.0)
    assert rig.T_world_base.x > 0.2
    assert of_type(effects, words.TaskProgress)
    assert any(beat.moving for beat in of_type(effects, words.Heartbeat))
    rig.server(words.Terminate(task=1))
    rig.live(0.2)
    assert rig.command == (0.0, 0.0)
    (end,) = of_type(
        rig.server(words.Award(task=1, kind="visit", goal_map=(1.0, 0.0), lease_s=9.0)),
        words.TaskEnd,
    )
    assert end.reason == "ended before"


def test_a_missed_change_of_the_map_is_asked_for_but_not_too_often() -> None:
    rig = with_map()
    (request,) = of_type(rig.server(unknown_beyond(9)), words.MapRequest)
    assert request.have == 2
    assert rig.server(unknown_beyond(10)) == []
    rig.now += 2.0
    assert of_type(rig.server(unknown_beyond(11)), words.MapRequest)


def test_a_damaged_map_is_dropped_and_named() -> None:
    broken = np.zeros(9, dtype=np.uint8)
    for message in (
        hall().model_copy(update={"cells": broken, "number": 50}),
        unknown_beyond(3).model_copy(update={"cells": broken}),
    ):
        (note,) = with_map().server(message)
        assert isinstance(note, Note)
        assert "dropped" in note.text


def test_when_the_mission_ends_it_sends_what_it_holds_and_rests() -> None:
    rig = with_map()
    rig.server(words.Award(task=1, kind="visit", goal_map=(1.0, 0.0), lease_s=9.0))
    rig.live(0.5)
    end = words.MissionEnd(ended="explored")
    assert len(of_type(rig.server(end), words.ScanReport)) == 1
    assert rig.server(end) == []
    late = words.Award(task=2, kind="visit", goal_map=(1.0, 0.0), lease_s=9.0)
    assert rig.server(late) == []
    effects = rig.live(0.5)
    assert rig.command == (0.0, 0.0)
    assert of_type(effects, words.Bid) == []
    # It tells which map it holds, so that one can see whether all hold the same.
    assert len(of_type(effects, words.Heartbeat)[-1].map_digest) == 64


def test_one_that_saw_nothing_yet_has_nothing_to_send_at_the_end() -> None:
    rig = Rig()
    rig.join()
    assert rig.server(words.MissionEnd(ended="operator")) == []
