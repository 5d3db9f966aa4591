"""Settings of the simulated world: how time passes, how starts are told, links and faults."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from protocol.fields import Name, NotNegative, Positive
from sim_world.radio.settings import RadioSettings
from sim_world.victims import Victim


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ScriptedFault(_Settings):
    """Something that goes wrong at a mission time, so that a faulty run repeats exactly.

    kind: `kill` ends the robot's process; `restart` starts it anew with nothing remembered,
    `reboot` with what it had written down, which is all that a robot holds that decides for itself;
    `freeze` halts it for `duration_s`; `cut_link` silences its radio for `duration_s`.
    """

    at_s: NotNegative
    robot: Name
    kind: Literal["kill", "freeze", "restart", "reboot", "cut_link"]
    duration_s: NotNegative = 0.0


class WorldSettings(_Settings):
    """The simulated world of a mission.

    `step_s` is the length of an instant. Robots are told their starts with a uniform error of up to
    `start_error_m` and `start_error_deg` when `perturb_starts` is on. `victims` are people who lie
    there besides the world's own, each `{ id = "v9", x = 3.0, y = 4.5 }`; they are not solid. When
    all robots of a team without a master are through, but parted, so that they do not hold the
    same, the mission is over after `parted_s`.
    """

    step_s: Positive = 0.1
    perturb_starts: bool = True
    start_error_m: NotNegative = 1.0
    start_error_deg: NotNegative = 20.0
    command_timeout_s: Positive = 0.5
    judge_period_s: Positive = 2.0
    parted_s: Positive = 1200.0
    stop_at_coverage: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    radio: RadioSettings = RadioSettings()
    faults: tuple[ScriptedFault, ...] = ()
    victims: tuple[Victim, ...] = ()
