from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from protocol.body import Body, Lidar
from protocol.messages import Award, Message, TaskEnd, TaskProgress
from robot_agent.navigation import Navigator
from robot_agent.navigation_settings import NavigationSettings
from robot_agent.planning_map import PlanningMap
from robot_agent.settings import TaskSettings
from robot_agent.task_work import TaskWork, WorkStep, frontier_near
from tests.unit.robot_agent.test_explorer import BODY, explorer_in, hall

NO_POINTS = np.zeros((0, 2))
NARROW = Body(radius_m=0.2, lidar=Lidar(field_of_view_deg=90.0))
_, HALL = explorer_in(hall())
OPEN_END = (1.8, 0.0)


class Rig:
    """Work in the hall, at a place that the test chooses."""

    def __init__(self, body: Body = BODY, planning_map: PlanningMap = HALL) -> None:
        settings = NavigationSettings()
        self.work = TaskWork(Navigator(body, settings, "robot1"), body, TaskSettings())
        self.map = planning_map

    def award(self, kind: str, task: int = 1, now: float = 0.0, **fields: object) -> list[Message]:
        values: dict[str, object] = {"goal_map": (1.0, 0.0), "lease_s": 9.0} | fields
        return self.work.award(Award.model_validate({"task": task, "kind": kind, **values}), now)

    def step(self, now: float = 0.0, T_map_base: Pose2 = IDENTITY) -> WorkStep:
        return self.work.step(now, T_map_base, NO_POINTS, (), False, self.map)


def test_without_a_task_a_robot_stands_still_and_bids() -> None:
    rig = Rig()
    step = rig.step()
    assert (step.speed, step.turn_rate, step.news) == (0.0, 0.0, [])
    assert rig.work.wants_bids
    assert rig.work.idle


@pytest.mark.parametrize(
    ("kind", "bids", "idle"),
    [
        ("explore", True, False),
        ("wait", True, True),
        ("visit", False, False),
        ("drive", False, False),
        ("pause", False, False),
    ],
)
def test_who_may_bid_at_what_work(kind: str, bids: bool, idle: bool) -> None:
    rig = Rig()
    rig.award(kind)
    assert (rig.work.wants_bids, rig.work.idle) == (bids, idle)


def test_a_visit_is_driven_told_of_and_ended() -> None:
    rig = Rig()
    assert rig.award("visit") == []
    first = rig.step(0.0)
    assert first.speed > 0.0 or first.turn_rate != 0.0
    (progress,) = first.news
    assert isinstance(progress, TaskProgress)
    assert progress.remaining_m == pytest.approx(1.0, abs=0.3)
    assert rig.step(0.5).news == []
    assert len(rig.step(1.1).news) == 1
    there = rig.step(2.0, Pose2(1.0, 0.0, 0.0))
    assert there.news == [TaskEnd(task=1, outcome="done", reason="")]
    assert rig.step(2.1).news == []


def test_a_place_that_cannot_be_reached_is_told() -> None:
    rig = Rig()
    rig.award("visit", goal_map=(-0.95, 0.95))
    news: list[Message] = []
    for k in range(200):
        news += rig.step(0.1 * k).news
        if any(isinstance(word, TaskEnd) for word in news):
            break
    end = news[-1]
    assert isinstance(end, TaskEnd)
    assert end.outcome in ("unreachable", "failed")


def test_a_robot_that_is_stuck_says_so() -> None:
    rig = Rig()
    rig.award("visit", goal_map=OPEN_END)
    award = rig.work._award
    assert award is not None
    assert rig.work._news(award, "stuck", 1.0, 0.0) == [
        TaskEnd(task=1, outcome="failed", reason="stuck")
    ]


def test_an_ended_task_that_is_awarded_again_is_told_as_done() -> None:
    rig = Rig()
    rig.award("visit")
    rig.work.terminate(7)
    assert not rig.work.idle
    rig.work.terminate(1)
    assert rig.work.idle
    assert rig.award("visit") == [TaskEnd(task=1, outcome="done", reason="ended before")]


def test_a_late_copy_of_an_older_award_is_passed_over() -> None:
    rig = Rig()
    rig.award("visit", task=5)
    rig.award("pause", task=4)
    assert rig.work._award is not None
    assert rig.work._award.task == 5


def test_an_award_in_hand_goes_on() -> None:
    rig = Rig()
    rig.award("visit")
    rig.step(0.0)
    rig.award("visit", now=0.5)
    assert rig.step(0.5).news == []


def test_halting_without_a_task_is_nothing() -> None:
    rig = Rig()
    rig.work.halt()
    assert rig.award("visit", task=0) == []


def test_a_pause_stands_still_and_reports() -> None:
    rig = Rig()
    rig.award("visit", task=1)
    rig.award("pause", task=2)
    step = rig.step(0.0)
    assert (step.speed, step.turn_rate) == (0.0, 0.0)
    assert step.news == [TaskProgress(task=2, remaining_m=0.0)]


def test_an_operators_hand_is_felt_within_limits_and_let_go_in_time() -> None:
    rig = Rig()
    rig.award("drive", speed_m_s=9.0, turn_rate_rad_s=-9.0)
    step = rig.step(0.0)
    assert (step.speed, step.turn_rate) == (0.5, -1.2)
    assert isinstance(step.news[0], TaskProgress)
    assert rig.step(1.1).speed == 0.0
    rig.award("drive", now=1.2, speed_m_s=-0.1, turn_rate_rad_s=0.0)
    assert rig.step(1.3).speed == -0.1


def test_a_frontier_is_reached_and_looked_over() -> None:
    rig = Rig()
    rig.award("explore", goal_map=OPEN_END)
    driving = rig.step(0.0)
    assert isinstance(driving.news[0], TaskProgress)
    facing = rig.step(0.1, Pose2(1.6, 0.0, 0.0))
    assert facing.news == [TaskEnd(task=1, outcome="done", reason="")]


def test_a_robot_turns_until_its_lidar_faces_what_is_left() -> None:
    rig = Rig(NARROW)
    rig.award("explore", goal_map=OPEN_END)
    for theta in (math.pi - 0.1, 0.5 * math.pi):
        step = rig.step(0.0, Pose2(1.6, 0.0, theta))
        assert step.speed == 0.0
        assert step.turn_rate < 0.0
        assert step.news == []
    done = rig.step(0.2, Pose2(1.6, 0.0, 0.0))
    assert [word.type for word in done.news] == ["task_end"]


def test_a_frontier_that_others_have_seen_meanwhile_is_done() -> None:
    rig = Rig()
    rig.award("explore", goal_map=(0.0, 0.0))
    step = rig.step(0.0)
    assert step.news == [TaskEnd(task=1, outcome="done", reason="seen already")]


def test_what_is_left_of_a_frontier() -> None:
    found = frontier_near(HALL, OPEN_END, 1.0, 4)
    assert found is not None
    assert found == pytest.approx((1.95, 0.0), abs=0.15)
    assert frontier_near(HALL, (0.0, 0.0), 0.5, 4) is None
    assert frontier_near(HALL, (500.0, 0.0), 0.5, 4) is None
    assert frontier_near(HALL, (1.55, 0.95), 0.35, 4) is None
