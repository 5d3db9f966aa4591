from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from coordination.bid import RobotBid
from coordination.task import Point
from mapping.geometry import IDENTITY
from protocol.crew import Crew
from protocol.peer_messages import Beacon
from robot_agent.agent import Agent
from robot_agent.decentral.settings import DecisionSettings
from robot_agent.decentral.standing_by import StandingBy
from robot_agent.planning_map import PlanningMap
from tests.unit.protocol.test_crew import beacon
from tests.unit.robot_agent.test_agent import with_map

SETTINGS = DecisionSettings(wait_period_s=5.0, wait_move_m=0.5, here_s=10.0)
HERE = (0.0, 0.0)


def hall() -> PlanningMap:
    rig = with_map()
    agent = rig.agent
    assert isinstance(agent, Agent) and agent.planning_map is not None
    return agent.planning_map


def left(*places: Point) -> RobotBid:
    at = np.array(places, dtype=np.float64).reshape(-1, 2)
    ones = np.ones(len(at))
    boxes = np.column_stack((at - 1.0, at + 1.0))
    return RobotBid("me", 1, 1, IDENTITY, at, ones, ones, boxes, np.zeros((0, 2)), ones)


def place(
    by: StandingBy, planning_map: PlanningMap, bid: RobotBid, crew: Crew, now: float
) -> Point | None:
    return by.place(HERE, bid, planning_map, crew, now)


def test_it_waits_where_what_is_left_is_near_and_asks_again_after_a_while() -> None:
    by, ground, crew = StandingBy("me", SETTINGS), hall(), Crew()
    assert by.due is None
    first = place(by, ground, left((1.0, 0.0)), crew, 1.0)
    assert first is not None and ground.clearance_at(*first) > 0.25
    assert by.due == 6.0
    assert place(by, ground, left((-0.5, 0.0)), crew, 5.9) is None
    assert place(by, ground, left((1.0, 0.0)), crew, 6.0) is None  # it is there already
    assert by.due == 11.0
    by.end()
    assert by.due is None
    by.look_again(20.0)
    assert by.due == 25.0


def test_it_stays_where_no_place_is_better() -> None:
    by, ground = StandingBy("me", SETTINGS), hall()
    crowd = Crew()
    for k, (x, y) in enumerate((x, y) for x in (-0.7, 0.4, 1.5, 2.6) for y in (-0.6, 0.5)):
        crowd.hear(f"r{k}", busy_at(x, y), 1.0, 1.0)
    assert place(by, ground, left((1.0, 0.0)), crowd, 1.0) == HERE
    assert place(by, ground, left((1.0, 0.0)), crowd, 7.0) is None


def busy_at(x: float, y: float) -> Beacon:
    told = beacon(x, busy=True)
    return told.model_copy(update={"T_map_base": replace(told.T_map_base, y=y)})


def test_it_keeps_clear_of_where_others_are_and_drive_and_shares_the_ground_with_who_waits() -> (
    None
):
    ground = hall()
    alone = place(StandingBy("me", SETTINGS), ground, left((1.0, 0.0)), Crew(), 1.0)
    assert alone is not None
    crew = Crew()
    crew.hear("me", beacon(5.0), 1.0, 1.0)
    crew.hear("long ago", beacon(alone[0], busy=True), -20.0, 0.0)
    assert place(StandingBy("me", SETTINGS), ground, left((1.0, 0.0)), crew, 1.0) == alone
    crew.hear("bob", beacon(alone[0], busy=True), 1.0, 1.0)
    moved = place(StandingBy("me", SETTINGS), ground, left((1.0, 0.0)), crew, 1.0)
    assert moved is not None and moved != alone
    crew.hear("bob", beacon(alone[0]), 2.0, 2.0)  # it waits, too, and is nearer
    other = place(StandingBy("me", SETTINGS), ground, left((1.0, 0.0)), crew, 2.0)
    assert other is not None and math.dist(other, alone) > 0.0
