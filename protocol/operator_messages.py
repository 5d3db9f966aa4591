"""What operators ask of the server and what it answers; what observers hear besides the map."""

from __future__ import annotations

from typing import Literal

from protocol.fields import Coordinate, Finite, Name, Text
from protocol.messages import Message


class VisitRequest(Message):
    """An operator wants a robot at a place of the team's map."""

    type: Literal["visit_request"] = "visit_request"
    robot: Name
    x_m: Coordinate
    y_m: Coordinate


class PauseRequest(Message):
    """An operator halts a robot."""

    type: Literal["pause_request"] = "pause_request"
    robot: Name


class ResumeRequest(Message):
    """An operator gives a robot back to the team, after a pause, a visit or a drive."""

    type: Literal["resume_request"] = "resume_request"
    robot: Name


class DriveRequest(Message):
    """An operator drives a robot by hand; it halts when no further request comes in time."""

    type: Literal["drive_request"] = "drive_request"
    robot: Name
    speed_m_s: Finite
    turn_rate_rad_s: Finite


class StopRequest(Message):
    """An operator, or the judge, ends the mission."""

    type: Literal["stop_request"] = "stop_request"
    ended: Literal["operator", "coverage", "time_limit"] = "operator"


class Answer(Message):
    """The server's answer to an operator."""

    type: Literal["answer"] = "answer"
    accepted: bool
    text: Text


class RobotLost(Message):
    """To observers: a robot's name and what became of it (`lost`, `back`)."""

    type: Literal["robot_lost"] = "robot_lost"
    robot: Name
    state: Literal["lost", "back"]
