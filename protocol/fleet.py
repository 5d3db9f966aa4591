"""All that can be said in the fleet protocol: one union, keyed by `type`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from protocol.log.messages import LogHave, LogWant, Observations, PoseSet
from protocol.messages import (
    Award,
    Bid,
    Heartbeat,
    Hello,
    MapDelta,
    MapRequest,
    MapSnapshot,
    MissionEnd,
    PoseUpdate,
    Refused,
    ReportsReceived,
    ScanReport,
    TaskEnd,
    TaskProgress,
    TeamPoses,
    Terminate,
    TightPlace,
    Welcome,
)
from protocol.operator_messages import (
    Answer,
    DriveRequest,
    PauseRequest,
    ResumeRequest,
    RobotLost,
    StopRequest,
    VisitRequest,
)
from protocol.peer_messages import Beacon, LastHeard, Lookout, Presence

FleetMessage = Annotated[
    Hello
    | Welcome
    | Refused
    | Heartbeat
    | TeamPoses
    | ScanReport
    | ReportsReceived
    | PoseUpdate
    | MapSnapshot
    | MapDelta
    | MapRequest
    | Bid
    | Award
    | Terminate
    | TaskProgress
    | TaskEnd
    | TightPlace
    | MissionEnd
    | VisitRequest
    | PauseRequest
    | ResumeRequest
    | DriveRequest
    | StopRequest
    | Answer
    | RobotLost
    | Observations
    | PoseSet
    | LogHave
    | LogWant
    | Beacon
    | Presence
    | LastHeard
    | Lookout,
    Field(discriminator="type"),
]
