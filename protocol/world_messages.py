"""What a body says to the software that lives in it, and the clock of a simulated mission.

`Join` to `Fault` travel between the world and every other process of a simulated team; on a real
robot a driver speaks to real hardware instead.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from protocol.body import WireBody
from protocol.fields import (
    NO_POINTS,
    Count,
    Detections,
    Finite,
    Name,
    NotNegative,
    PoseField,
    Positive,
    Ranges,
    StartSigma,
    Text,
)
from protocol.messages import Ended, Message


class Join(Message):
    """A process joins the world's clock: a robot's software, or the server."""

    type: Literal["join"] = "join"
    role: Literal["robot", "server"]
    incarnation: Count = 0


class Joined(Message):
    """The world's answer: how time passes here, and the robot's body.

    `lockstep`: mission time moves only when every live process is done with an instant.
    `start`: where the robot was told it starts (perturbed as configured), map frame.
    """

    type: Literal["joined"] = "joined"
    lockstep: bool
    now_s: NotNegative
    step_s: Positive
    body: WireBody | None = None
    start: PoseField | None = None
    start_sigma_m: StartSigma = 0.0
    start_sigma_deg: StartSigma = 0.0
    radio: Text = ""


class JoinRefused(Message):
    """The world does not take the process in, and why."""

    type: Literal["join_refused"] = "join_refused"
    reason: Text


class BodyFrame(Message):
    """What a body senses at `stamp_s`.

    `T_wheel_base` is dead reckoning from the wheels since the body was switched on. `ranges` is
    empty when no sweep was finished at this instant. `bumped`: it touches something.
    `victims_base`: the places (x, y) [m], base frame, where somebody was made out in this sweep.
    """

    type: Literal["body_frame"] = "body_frame"
    stamp_s: NotNegative
    T_wheel_base: PoseField
    bumped: bool
    ranges: Ranges
    victims_base: Detections = NO_POINTS


class MotionCommand(Message):
    """Wanted speed along +x and turn rate; the body halts when none came for half a second."""

    type: Literal["motion_command"] = "motion_command"
    speed_m_s: Annotated[float, Field(ge=-10.0, le=10.0, allow_inf_nan=False)]
    turn_rate_rad_s: Annotated[float, Field(ge=-20.0, le=20.0, allow_inf_nan=False)]


class Fault(Message):
    """A scripted fault strikes the process: it ends at once (`kill`) or starts anew.

    After `restart` it knows nothing, after `reboot` what it had written down.
    """

    type: Literal["fault"] = "fault"
    kind: Literal["kill", "restart", "reboot"]


class Shutdown(Message):
    """The mission is over: write results and end."""

    type: Literal["shutdown"] = "shutdown"
    reason: Text = ""


class Finished(Message):
    """The mission has ended: the server's word."""

    type: Literal["finished"] = "finished"
    ended: Ended
    reason: Text = ""


class Through(Message):
    """Whether the mission is over, as far as a member of a team without a master knows.

    It is said anew when it changes: a member that was parted from others may learn better.
    `held` is a checksum of all observations and poses that it holds; to those in `shut_out` it
    does not listen any more.
    """

    type: Literal["through"] = "through"
    through: bool
    held: Count
    shut_out: Annotated[tuple[Name, ...], Field(max_length=256)] = ()


class Ping(Message):
    """Is anybody there? Needs no answer: the transport notices a dead peer."""

    type: Literal["ping"] = "ping"
    value: Finite = 0.0


WorldMessage = Annotated[
    Join
    | Joined
    | JoinRefused
    | BodyFrame
    | MotionCommand
    | Fault
    | Shutdown
    | Finished
    | Through
    | Ping,
    Field(discriminator="type"),
]
