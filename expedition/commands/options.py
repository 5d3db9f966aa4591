"""Options that several commands share, and what they make of them."""

from __future__ import annotations

import json
import signal
from typing import Annotated, Any

import typer

from expedition.team import TeamSettings, UsageError, load_team, merge, parse_sets, parse_starts

TeamArgument = Annotated[
    str, typer.Argument(help="a ready-made team (see `expedition list`) or a TOML file")
]
WorldOption = Annotated[
    str | None, typer.Option("--world", help="a shipped world's name, or a map_server YAML")
]
RobotsOption = Annotated[int | None, typer.Option("--robots", help="number of robots")]
StrategyOption = Annotated[
    str | None, typer.Option("--strategy", help="who decides who goes where")
]
SeedOption = Annotated[int | None, typer.Option("--seed", help="of all randomness")]
StartsOption = Annotated[
    str | None, typer.Option("--starts", help='"x,y,deg;x,y,deg" in the world\'s metres')
]
CoverageOption = Annotated[
    float | None,
    typer.Option("--stop-at-coverage", help="end at this share of the reachable area, 0 to 1"),
]
MaxTimeOption = Annotated[float | None, typer.Option("--max-time", help="mission seconds")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="any team setting, dotted.key=value"),
]
RealtimeOption = Annotated[
    bool, typer.Option("--realtime", help="by the wall clock, not as fast as possible")
]
JsonOption = Annotated[bool, typer.Option("--json", help="print one JSON value and nothing else")]


def settings_from(
    team: str,
    world: str | None = None,
    robots: int | None = None,
    strategy: str | None = None,
    seed: int | None = None,
    starts: str | None = None,
    stop_at_coverage: float | None = None,
    max_time: float | None = None,
    sets: list[str] | None = None,
) -> TeamSettings:
    """Return a team's settings with the command line's on top.

    Raises:
        UsageError: one of them is wrong.
    """
    mission: dict[str, Any] = {
        "world": world,
        "robots": robots,
        "strategy": strategy,
        "seed": seed,
        "max_time_s": max_time,
        "starts": parse_starts(starts) if starts is not None else None,
    }
    given: dict[str, Any] = {
        "mission": {key: value for key, value in mission.items() if value is not None}
    }
    if mission["starts"] and robots is None:
        given["mission"]["robots"] = len(mission["starts"])
    if stop_at_coverage is not None:
        given["world"] = {"stop_at_coverage": stop_at_coverage}
    return load_team(team, merge(given, parse_sets(sets or [])))


def tcp_endpoint(text: str | None, option: str, address: str, port: int) -> str:
    """Return `tcp://address:port` for what was written as an option, or the team's own.

    Raises:
        UsageError: it is not of the form address:port.
    """
    if text is None:
        return f"tcp://{address}:{port}"
    host, colon, number = text.removeprefix("tcp://").rpartition(":")
    if not colon or not host or "/" in host or not number.isdecimal() or int(number) > 65535:
        raise UsageError(f"{option} {text!r}: write it as address:port, such as {address}:{port}")
    return f"tcp://{host}:{int(number)}"


def print_json(value: Any) -> None:
    """Print one JSON value to standard output."""
    print(json.dumps(value))


class Interrupt:
    """Ctrl-C (or a request to terminate) as a question that a run asks now and then."""

    def __init__(self) -> None:
        self.asked = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask)

    def _ask(self, *_: object) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True
