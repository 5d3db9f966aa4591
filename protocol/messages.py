"""The fleet protocol: what robots and server say to each other.

Frozen pydantic models in one union keyed by `type`, see `protocol.fleet`. Fields carry their unit
in the name. Arrays are fields of the message itself, never nested, and travel as raw buffers.
Receivers ignore fields they do not know; a type they do not know is counted and dropped.

Poses on the wire are [x, y, theta] in metres and radians; times are mission seconds.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from protocol.body import WireBody
from protocol.fields import (
    LARGEST_EDGE,
    NO_NUMBERS,
    NO_POINTS,
    Bytes,
    Coordinate,
    Count,
    Covariance,
    Detections,
    Finite,
    Name,
    NotNegative,
    Numbers,
    Points,
    PoseField,
    Positive,
    RangeMax,
    Ranges,
    Rectangles,
    StartSigma,
    Text,
    Track,
)

PROTOCOL_VERSION = (1, 4)

Ended = Literal["explored", "time_limit", "coverage", "operator", "failed"]

SERVER = "server"
WORLD = "world"
EVERYONE = "*"


class Message(BaseModel):
    """Base of all messages."""

    model_config = ConfigDict(frozen=True, extra="ignore", arbitrary_types_allowed=True)

    type: str


# --- joining -----------------------------------------------------------------------------------


class Hello(Message):
    """First word of a peer: who it is. A robot also tells its body and its supposed start.

    `incarnation` changes when a process starts anew, so that the server notices a restart.
    `start` is where the robot was told it starts, in the team's map frame, good to `start_sigma_*`.
    """

    type: Literal["hello"] = "hello"
    role: Literal["robot", "operator", "observer"]
    incarnation: Count = 0
    body: WireBody | None = None
    start: PoseField | None = None
    start_sigma_m: StartSigma = 0.0
    start_sigma_deg: StartSigma = 0.0


class Welcome(Message):
    """The server takes the peer in. `now_s` is mission time at the server."""

    type: Literal["welcome"] = "welcome"
    now_s: NotNegative
    strategy: Text = ""


class Refused(Message):
    """The server does not take the peer in, and why."""

    type: Literal["refused"] = "refused"
    reason: Text


class Heartbeat(Message):
    """Sign of life of a robot with what it knows of itself.

    `T_odom_base` is its estimate in its own local map's frame; `path_map` (n, 2) [m] is what it is
    about to drive, in the team's map frame, nearest first. When the mission is over `map_digest`
    is the fingerprint of the map it holds, see `protocol.map_cells.map_digest`.
    """

    type: Literal["heartbeat"] = "heartbeat"
    T_odom_base: PoseField
    speed_m_s: Finite = 0.0
    moving: bool = False
    path_map: Points
    reports: Count = 0
    map_number: Count = 0
    map_digest: Annotated[str, Field(max_length=64)] = ""


class TeamPoses(Message):
    """Where the members of the team are, from the server to every robot.

    Row i of `poses_map` (n, 4) is stamp [s], x [m], y [m], theta [rad] of `robots[i]` in the map
    frame; `radii_m` (n,) its body, `uncertainty_m` (n,) one sigma of its place in the team's map.
    `paths_map` (m, 2) holds all announced paths one behind the other, `path_lengths` how many
    points belong to each robot; `busy` says which of them drive for a task.
    """

    type: Literal["team_poses"] = "team_poses"
    robots: Annotated[tuple[Name, ...], Field(max_length=256)]
    poses_map: Track
    radii_m: Numbers
    uncertainty_m: Numbers
    paths_map: Points
    path_lengths: Annotated[tuple[Count, ...], Field(max_length=256)]
    busy: Annotated[tuple[bool, ...], Field(max_length=256)]


# --- mapping -----------------------------------------------------------------------------------


class ScanReport(Message):
    """Every Nth scan of a robot with its locally corrected pose.

    `number` counts a robot's reports from 1 without gaps. `track_odom` (n, 4) holds stamp, x, y,
    theta of all poses since the report before, in the robot's odom frame, this one last.
    `covariance` is that of `T_odom_base` relative to the robot's own map around it, odom frame.
    `T_wheel_base` is where the wheels alone put the robot, in a frame of their own.
    `sightings_odom` (k, 2) [m] is where it saw discs of a teammate's size since the report before,
    in its odom frame; told only while it looks around. `victims_odom` (k, 2) [m] is where it made
    out victims since the report before, in its odom frame.
    """

    type: Literal["scan_report"] = "scan_report"
    number: Annotated[int, Field(ge=1, le=2**53)]
    stamp_s: NotNegative
    ranges: Ranges
    bearing_start_rad: Finite
    bearing_step_rad: Finite
    range_max_m: RangeMax
    T_base_laser: PoseField
    T_odom_base: PoseField
    covariance: Covariance
    track_odom: Track
    T_wheel_base: PoseField | None = None
    sightings_odom: Points = NO_POINTS
    victims_odom: Detections = NO_POINTS


class ReportsReceived(Message):
    """The server holds all of a robot's reports up to `number`; the robot sends on from there."""

    type: Literal["reports_received"] = "reports_received"
    number: Count


class PoseUpdate(Message):
    """Where a robot's local map lies in the team's map, after its report `number` was placed."""

    type: Literal["pose_update"] = "pose_update"
    number: Count
    T_map_odom: PoseField
    uncertainty_m: NotNegative
    matched: bool


class MapSnapshot(Message):
    """The whole team map: quantised log-odds, int8, compressed with zstandard, as `cells`."""

    type: Literal["map_snapshot"] = "map_snapshot"
    number: Count
    resolution_m: Positive
    origin_x_m: Coordinate
    origin_y_m: Coordinate
    rows: Annotated[int, Field(ge=1, le=LARGEST_EDGE)]
    cols: Annotated[int, Field(ge=1, le=LARGEST_EDGE)]
    cells: Bytes


class MapDelta(Message):
    """What changed from map `number - 1` to `number`: one rectangle of the team's map.

    The rectangle is placed by whole cells of the lattice through (0, 0): its lower left cell is
    column `lattice_x`, row `lattice_y`; cells as in the snapshot.
    """

    type: Literal["map_delta"] = "map_delta"
    number: Annotated[int, Field(ge=1, le=2**53)]
    resolution_m: Positive
    lattice_x: Annotated[int, Field(ge=-(10**7), le=10**7)]
    lattice_y: Annotated[int, Field(ge=-(10**7), le=10**7)]
    rows: Annotated[int, Field(ge=1, le=LARGEST_EDGE)]
    cols: Annotated[int, Field(ge=1, le=LARGEST_EDGE)]
    cells: Bytes


class MapRequest(Message):
    """A peer that lost a delta asks for the whole map."""

    type: Literal["map_request"] = "map_request"
    have: Count = 0


# --- coordination ------------------------------------------------------------------------------


class Bid(Message):
    """A robot's estimates for the frontier cells it could visit, on map `map_number`.

    `places_map` (n, 2) [m]; `gains` (n,) expected information [m2]; `costs_m` (n,) path length
    [m]; `rectangles_map` (n, 4) x_min, y_min, x_max, y_max [m] of the information gain regions.
    `losses` (n,) [m2]: how much less the robot expects of the rest of its route when it goes there
    first; empty from a robot that does not look ahead. `unreachable_map` (k, 2) are frontier places
    this body cannot get to.
    """

    type: Literal["bid"] = "bid"
    number: Count
    map_number: Count
    T_map_base: PoseField
    places_map: Points
    gains: Numbers
    costs_m: Numbers
    rectangles_map: Rectangles
    unreachable_map: Points
    losses: Numbers = NO_NUMBERS


class Award(Message):
    """The server gives a robot a task: a lease until `lease_s` after the last progress.

    kind: `explore` a frontier, `visit` a place for an operator, `wait` at a place while there is
    nothing to gain, `drive` by an operator's hand, `pause` where it stands.
    """

    type: Literal["award"] = "award"
    task: Count
    kind: Literal["explore", "visit", "wait", "drive", "pause"]
    goal_map: tuple[Coordinate, Coordinate]
    lease_s: Positive
    speed_m_s: Finite = 0.0
    turn_rate_rad_s: Finite = 0.0


class Terminate(Message):
    """The server takes a task back."""

    type: Literal["terminate"] = "terminate"
    task: Count


class TaskProgress(Message):
    """A robot is at work on a task; `remaining_m` is what is left of its path."""

    type: Literal["task_progress"] = "task_progress"
    task: Count
    remaining_m: NotNegative


class TaskEnd(Message):
    """A robot is through with a task.

    outcome: `done`; `unreachable` (no path for this body); `failed` (stuck, with the reason).
    """

    type: Literal["task_end"] = "task_end"
    task: Count
    outcome: Literal["done", "unreachable", "failed"]
    reason: Text = ""


class TightPlace(Message):
    """A robot does not fit through a place where the map leaves it enough room, if barely.

    It keeps farther from obstacles around the place from then on. The server passes that on to
    robots of the same size or more.
    """

    type: Literal["tight_place"] = "tight_place"
    place_map: tuple[Coordinate, Coordinate]


class MissionEnd(Message):
    """The mission is over; robots stop and send what they still hold."""

    type: Literal["mission_end"] = "mission_end"
    ended: Ended
    reason: Text = ""
