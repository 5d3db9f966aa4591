"""The command line."""

from __future__ import annotations

import json
import signal
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from expedition.team import (
    TeamSettings,
    UsageError,
    load_team,
    merge,
    parse_sets,
    parse_starts,
)

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Sends a team of robots into a building nobody has a map of, and brings back one map.",
)

TeamArgument = Annotated[
    str, typer.Argument(help="a ready-made team (see `expedition list`) or a TOML file")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="any team setting, dotted.key=value"),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print one JSON value and nothing else")]


def main() -> None:
    """Run the command line; errors become one clear line and an exit status."""
    try:
        result = app(standalone_mode=False)
        sys.exit(result if isinstance(result, int) else 0)
    except UsageError as error:
        _fail(str(error), 2)
    except OSError as error:
        _fail(str(error), 2)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        show = getattr(error, "show", None)
        if show is None:
            raise
        show()
        sys.exit(getattr(error, "exit_code", 2))


def _fail(text: str, status: int) -> None:
    """Print an error in one line and end."""
    print(f"expedition: {text}", file=sys.stderr)
    sys.exit(status)


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


@app.command()
def run(
    team: TeamArgument = "auction",
    world: Annotated[
        str | None, typer.Option(help="a shipped world's name, or a map_server YAML")
    ] = None,
    robots: Annotated[int | None, typer.Option(help="number of robots")] = None,
    strategy: Annotated[str | None, typer.Option(help="who decides who goes where")] = None,
    seed: Annotated[int | None, typer.Option(help="of all randomness")] = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="by the wall clock")] = False,
    in_process: Annotated[
        bool, typer.Option("--in-process", help="everything in one process, without sockets")
    ] = False,
    starts: Annotated[
        str | None, typer.Option(help='"x,y,deg;x,y,deg" in the world\'s metres')
    ] = None,
    stop_at_coverage: Annotated[
        float | None, typer.Option(help="end at this share of the reachable area")
    ] = None,
    max_time: Annotated[float | None, typer.Option(help="mission seconds")] = None,
    out: Annotated[Path | None, typer.Option(help="folder for the results")] = None,
    as_json: JsonOption = False,
    sets: SetOption = None,
) -> int:
    """Start world, server and robots on this machine, and write the results."""
    from expedition.launch import Watch, run_team
    from expedition.live import Live

    settings = settings_from(
        team, world, robots, strategy, seed, starts, stop_at_coverage, max_time, sets
    )
    folder = out or Path("runs") / time.strftime(f"{settings.name}-%Y%m%d-%H%M%S")
    interrupted = Interrupt()
    live = Live(quiet=as_json)
    watch = Watch(live.note, live.progress, lambda: not interrupted.asked)
    live.begin(settings)
    if not in_process:
        from expedition.warm_up import warm_up

        warm_up(live.say)
    summary = run_team(settings, folder, watch, in_process, realtime)
    if as_json:
        print(json.dumps(summary))
    else:
        live.end(summary, folder)
    if interrupted.asked:
        return 130
    return 1 if summary["ended"] == "failed" else 0


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


@app.command("list")
def list_everything(as_json: JsonOption = False) -> None:
    """List teams, worlds, strategies, estimators and experiments, each with one line."""
    from expedition.catalogue import catalogue

    entries = catalogue()
    if as_json:
        print(json.dumps(entries))
        return
    for kind, names in entries.items():
        print(kind)
        for name, line in names.items():
            print(f"  {name:26} {line}")


if __name__ == "__main__":
    main()
