"""A team: one TOML file says everything about a mission; the command line may override it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from mapping.geometry import Pose2
from protocol.body import Body
from protocol.fields import Name, NotNegative, Positive
from robot_agent.settings import RobotSettings
from server.settings import ServerSettings
from sim_world.settings import WorldSettings

TEAMS = Path(__file__).parent.parent / "teams"


class UsageError(Exception):
    """Wrong use or bad input; the text names the mend. Exit status 2."""


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class MissionSettings(_Settings):
    """What the mission is.

    `world` is a shipped world's name or a path. `starts` are true start poses, (x, y, deg) each in
    the world's metres; empty for the world's own.
    """

    world: str = "hospital"
    robots: Annotated[int, Field(ge=1, le=200)] = 3
    strategy: str = "auction"
    seed: Annotated[int, Field(ge=0)] = 1
    max_time_s: Positive = 3600.0
    starts: tuple[tuple[float, float, float], ...] = ()


class MemberSettings(_Settings):
    """What is special about one robot: its name, its body, how dear its way is."""

    name: Name
    body: Body
    cost_weight: Positive = 1.0


class NetworkSettings(_Settings):
    """Where the processes listen; only this machine can reach them unless told otherwise.

    A server or robot whose world does not answer gives up after `join_timeout_s` (wall clock), and
    so does a world that nobody joined for so long while somebody is missing still.
    """

    address: str = "127.0.0.1"
    world_port: Annotated[int, Field(ge=0, le=65535)] = 5600
    server_port: Annotated[int, Field(ge=0, le=65535)] = 5610
    join_timeout_s: Positive = 120.0


class TeamSettings(_Settings):
    """The whole effective configuration of a mission."""

    name: Name
    description: str = ""
    mission: MissionSettings = MissionSettings()
    body: Body = Body()
    robots: tuple[MemberSettings, ...] = ()
    robot: RobotSettings = RobotSettings()
    server: ServerSettings = ServerSettings()
    strategy: dict[str, float | int | bool | str] = {}
    world: WorldSettings = WorldSettings()
    network: NetworkSettings = NetworkSettings()
    checkpoint_s: NotNegative = 60.0

    @model_validator(mode="before")
    @classmethod
    def _inherit_bodies(cls, data: Any) -> Any:
        """Give each robot the team's body with its own changes on top."""
        if not isinstance(data, dict):
            return data
        team_body = data.get("body", {})
        robots = data.get("robots", [])
        if not isinstance(team_body, dict) or not isinstance(robots, list | tuple):
            return data
        merged = [
            {**robot, "body": merge(team_body, robot.get("body", {}))}
            if isinstance(robot, dict)
            else robot
            for robot in robots
        ]
        return {**data, "robots": merged}

    @model_validator(mode="after")
    def _check_names(self) -> TeamSettings:
        names = [member.name for member in self.robots]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two robots are named {name!r}: give each its own name")
            if name in ("server", "world"):
                raise ValueError(f"{name!r} is not free as a robot's name: choose another")
        known = {member.name for member in self.members()}
        for fault in self.world.faults:
            if fault.robot not in known:
                names_known = ", ".join(sorted(known))
                raise ValueError(
                    f"a fault names the robot {fault.robot!r}: use one of {names_known}"
                )
        if not self.server.enabled and self.robot.decides == "server":
            raise ValueError(
                "without a server the robots must decide for themselves: set "
                "robot.decides = 'itself', or leave server.enabled on"
            )
        for name in self.world.radio.names():
            if name not in known and name != "server":
                raise ValueError(
                    f"world.radio names {name!r}: use one of {', '.join(sorted(known))}, server"
                )
        return self

    def members(self) -> tuple[MemberSettings, ...]:
        """Return the robots of the team: the named ones first, then numbered ones."""
        members = list(self.robots[: self.mission.robots])
        number = 1
        while len(members) < self.mission.robots:
            name = f"robot{number}"
            if all(member.name != name for member in self.robots):
                members.append(MemberSettings(name=name, body=self.body))
            number += 1
        return tuple(members)


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return `base` with the entries of `over` on top, table by table."""
    merged = dict(base)
    for key, value in over.items():
        below = merged.get(key)
        if isinstance(value, Mapping) and isinstance(below, Mapping):
            merged[key] = merge(below, value)
        else:
            merged[key] = value
    return merged


def ready_made() -> dict[str, Path]:
    """Return the ready-made teams by name."""
    return {path.stem: path for path in sorted(TEAMS.glob("*.toml"))}


def load_team(name_or_path: str, overrides: Mapping[str, Any] | None = None) -> TeamSettings:
    """Return a team's settings with `overrides` on top.

    Args:
        name_or_path: a ready-made team's name or the path of a TOML file.
        overrides: nested tables, as in the file.

    Raises:
        UsageError: there is no such team, or a key or value is wrong; says which.
    """
    path = ready_made().get(name_or_path, Path(name_or_path))
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError:
        known = ", ".join(ready_made())
        raise UsageError(
            f"no team {name_or_path!r}: use one of {known}, or the path of a TOML file"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: not valid TOML: {error}") from None
    data.setdefault("name", path.stem)
    return checked(merge(data, overrides or {}), f"team {name_or_path}")


def checked(data: Mapping[str, Any], source: str) -> TeamSettings:
    """Return valid settings.

    Raises:
        UsageError: a key is unknown or a value is out of range.
    """
    try:
        return TeamSettings.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        if first["type"] == "extra_forbidden":
            message = "there is no such setting; check its spelling"
        where = f"{source}: {key}: " if key else f"{source}: "
        raise UsageError(where + message) from None


def parse_sets(assignments: Iterable[str]) -> dict[str, Any]:
    """Return nested tables from `dotted.key=value` texts; values are read as TOML, else as text.

    Raises:
        UsageError: a text is no assignment.
    """
    tables: dict[str, Any] = {}
    for assignment in assignments:
        key, equals, value = assignment.partition("=")
        parts = key.strip().split(".")
        if not equals or not all(parts):
            raise UsageError(f"--set {assignment!r}: write it as dotted.key=value")
        nested: Any = _value(value.strip())
        for part in reversed(parts):
            nested = {part: nested}
        tables = merge(tables, nested)
    return tables


def _value(text: str) -> Any:
    """Read a TOML value; what is none is a plain text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def parse_starts(text: str) -> tuple[tuple[float, float, float], ...]:
    """Return the starts in `x,y,deg;x,y,deg`.

    Raises:
        UsageError: it is not of that form.
    """
    starts = []
    for part in filter(None, (piece.strip() for piece in text.split(";"))):
        try:
            x, y, degrees = (float(number) for number in part.split(","))
        except ValueError:
            raise UsageError(
                f"--starts: {part!r} is not x,y,deg; write for example '2.0,12.5,0;2.0,11.7,0'"
            ) from None
        if not all(math.isfinite(number) for number in (x, y, degrees)):
            raise UsageError(f"--starts: {part!r} has a number that is not finite")
        starts.append((x, y, degrees))
    return tuple(starts)


def pose_of_start(start: tuple[float, float, float]) -> Pose2:
    """Return the pose of a start given in metres and degrees."""
    return Pose2(start[0], start[1], math.radians(start[2]))
