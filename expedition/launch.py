"""Runs a whole team on this machine: as processes over ZeroMQ, or all in one process.

Either way every process of the mission leaves its part in `OUT/parts`, and the results are made
from the parts alone, so that whatever ends a run, what was known is written.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as package_version
from pathlib import Path
from typing import Any

from expedition import cast, collect
from expedition.children import Children
from expedition.errors import StartError
from expedition.processes import begin_record, choose_witness, save_robot, save_server
from expedition.results.record import load_record, save_record_part
from expedition.results.write import write_results
from expedition.team import TeamSettings
from protocol.effects import Note
from protocol.in_process import run_in_process
from server.listener import Listener
from server.master import Master
from sim_world.world import World

OnNote = Callable[[str, Note], None]


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a running mission is: mission time [s], coverage 0 to 1."""

    sim_time_s: float
    coverage: float


@dataclass(frozen=True, slots=True)
class Watch:
    """Who is told about a running mission, and whether it is to go on."""

    note: OnNote = lambda name, note: None
    progress: Callable[[Progress], None] = lambda progress: None
    keep_going: Callable[[], bool] = lambda: True


def version() -> str:
    """Return the installed version of this project."""
    try:
        return package_version("expedition")
    except PackageNotFoundError:
        return "0+unknown"


def prepare(team: TeamSettings) -> cast.Stage:
    """Return the stage of a mission, after checking all that can be known before it begins.

    Raises:
        UsageError: the settings cannot be used.
    """
    cast.check_strategy(team)
    cast.check_estimator(team)
    return cast.set_stage(team)


def run_team(
    team: TeamSettings,
    out: Path,
    watch: Watch,
    in_process: bool = False,
    realtime: bool = False,
    stage: cast.Stage | None = None,
) -> dict[str, Any]:
    """Run a mission and write all its results; return the content of `summary.json`.

    Args:
        team: the effective settings.
        out: folder of the results; made if need be.
        watch: who is told about it.
        in_process: everything in this process instead of one process each.
        realtime: by the wall clock instead of as fast as possible.
        stage: from `prepare`, if that was done already.

    Raises:
        UsageError: the settings cannot be used, or nothing can be written in `out`; nothing was
            started.
        StartError: a process cannot listen where it was told to, or did not start.
        OSError: the results cannot be written at the end.
    """
    stage = stage or prepare(team)
    parts = out / "parts"
    begin_record(parts, collect.launch_part(team, stage.world.name, version()))
    began = time.monotonic()
    if in_process:
        ended = _run_here(team, stage, parts, watch)
    else:
        children = Children(team, stage, parts, watch.note, watch.progress)
        try:
            ended = children.run(realtime, watch.keep_going)
        except StartError:
            _clear_away(out)
            raise
    wall = time.monotonic() - began
    last: dict[str, Any] = {"wall_time_s": wall}
    if ended is not None:
        last |= {"ended": ended, "reason": _REASONS[ended]}
    choose_witness(parts)
    save_record_part(parts, "9-launch", last)
    return write_results(load_record(parts), out)


def _clear_away(out: Path) -> None:
    """Remove what was made for a run that never began."""
    shutil.rmtree(out / "parts", ignore_errors=True)
    with suppress(OSError):  # somebody's own files are in there
        out.rmdir()


_REASONS = {
    "operator": "interrupted at the keyboard",
    "failed": "a process of the team failed",
}


def _run_here(team: TeamSettings, stage: cast.Stage, parts: Path, watch: Watch) -> str | None:
    """Run the mission in this process; return how it was broken off, or None."""
    world = cast.world_host(team, stage)
    hosts = {member.name: cast.agent_host(team, member.name) for member in team.members()}
    if team.server.enabled:
        hosts[cast.SERVER_NAME] = cast.server_host(team)
    told = 0.0

    def keep_going() -> bool:
        nonlocal told
        core = world.core
        assert isinstance(core, World)
        if time.monotonic() - told > 0.5 and core.judge.timeline:
            told = time.monotonic()
            watch.progress(Progress(*core.judge.timeline[-1]))
        return watch.keep_going()

    try:
        why = run_in_process(world, hosts, team.world.step_s, watch.note, keep_going)
    finally:
        assert isinstance(world.core, World)
        save_world(parts, world.core, stage, team)
        for name, host in hosts.items():
            if isinstance(host.core, Master | Listener):
                save_server(parts, host.core, world.core.now)
            elif world.core.robots[name].connected:
                save_robot(parts, host.core, team)
    return "operator" if why == "broken off" else None


def save_world(parts: Path, world: World, stage: cast.Stage, team: TeamSettings) -> None:
    """Save the world's part of the record."""
    save_record_part(parts, "1-world", collect.world_part(world, stage, team))
