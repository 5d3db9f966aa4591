"""`expedition run`: a whole mission on this machine."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from expedition.commands.options import (
    CoverageOption,
    Interrupt,
    JsonOption,
    MaxTimeOption,
    RealtimeOption,
    RobotsOption,
    SeedOption,
    SetOption,
    StartsOption,
    StrategyOption,
    TeamArgument,
    WorldOption,
    print_json,
    settings_from,
)


def run(
    team: TeamArgument = "auction",
    world: WorldOption = None,
    robots: RobotsOption = None,
    strategy: StrategyOption = None,
    seed: SeedOption = None,
    realtime: RealtimeOption = False,
    in_process: Annotated[
        bool, typer.Option("--in-process", help="everything in one process, without sockets")
    ] = False,
    starts: StartsOption = None,
    stop_at_coverage: CoverageOption = None,
    max_time: MaxTimeOption = None,
    out: Annotated[
        Path | None, typer.Option(help="folder for the results", show_default="runs/TEAM-TIME")
    ] = None,
    as_json: JsonOption = False,
    sets: SetOption = None,
) -> int:
    """Start world, server and robots on this machine, and write the results."""
    from expedition.launch import Watch, prepare, run_team
    from expedition.live import Live

    settings = settings_from(
        team, world, robots, strategy, seed, starts, stop_at_coverage, max_time, sets
    )
    stage = prepare(settings)
    folder = out or Path("runs") / time.strftime(f"{settings.name}-%Y%m%d-%H%M%S")
    interrupted = Interrupt()
    live = Live(quiet=as_json)
    watch = Watch(live.note, live.progress, lambda: not interrupted.asked)
    live.begin(settings)
    if not in_process:
        from expedition.warm_up import warm_up

        warm_up(live.say, watch.keep_going)
    summary = run_team(settings, folder, watch, in_process, realtime, stage)
    if as_json:
        print_json(summary)
    else:
        live.end(summary, folder)
    if interrupted.asked:
        return 130
    return 1 if summary["ended"] == "failed" else 0
