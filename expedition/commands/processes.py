"""`expedition world`, `server` and `agent`: one process of a team each, launched by hand.

Give all of them the same team and the same options about it. Server and world leave their parts in
the same folder if they can reach the same one; then the world, which ends last, writes the results.
A server on a machine of its own writes what it knows by itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
    tcp_endpoint,
)
from expedition.live import Live
from expedition.team import TeamSettings, UsageError

if TYPE_CHECKING:
    from protocol.effects import Note

WorldEndpoint = Annotated[
    str | None,
    typer.Option(
        "--world-endpoint",
        metavar="ADDRESS:PORT",
        help="where the world listens",
        show_default="127.0.0.1:5600",
    ),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", help="folder for the results", show_default="runs/TEAM"),
]
_SERVER_PATIENCE = 10.0  # [s]; how long the world waits for what the server knows


def _bind(default: str, who: str) -> Any:
    """Return the option that says where a process listens."""
    text = f"where to listen for {who}; 0.0.0.0 for other machines too"
    return typer.Option("--bind", metavar="ADDRESS:PORT", help=text, show_default=default)


def world(
    team: TeamArgument = "auction",
    bind: Annotated[str | None, _bind("127.0.0.1:5600", "server and robots")] = None,
    world: WorldOption = None,
    robots: RobotsOption = None,
    seed: SeedOption = None,
    starts: StartsOption = None,
    stop_at_coverage: CoverageOption = None,
    max_time: MaxTimeOption = None,
    realtime: RealtimeOption = False,
    out: OutOption = None,
    as_json: JsonOption = False,
    sets: SetOption = None,
) -> int:
    """Play the simulated world for a team whose server and robots are started by hand."""
    from expedition import collect
    from expedition.launch import prepare, version
    from expedition.processes import begin_record, choose_witness, play_world
    from expedition.results.record import save_record_part
    from expedition.warm_up import warm_up

    settings = settings_from(
        team, world, robots, None, seed, starts, stop_at_coverage, max_time, sets
    )
    stage = prepare(settings)
    network = settings.network
    endpoint = tcp_endpoint(bind, "--bind", network.address, network.world_port)
    folder, interrupted, live = _folder(settings, out), Interrupt(), Live(quiet=as_json)
    warm_up(live.say, lambda: not interrupted.asked, load=False)
    parts = folder / "parts"
    begin_record(parts, collect.launch_part(settings, stage.world.name, version()))
    names = ", ".join(member.name for member in settings.members())

    def bound(where: str) -> None:
        live.say(f"the world listens on {where} for the server and {names}")

    began, last = time.monotonic(), dict[str, Any]()
    why = play_world(
        settings, stage, parts, endpoint, realtime, _ties(live, "world", interrupted, bound)
    )
    if interrupted.asked:
        last = {"ended": "operator", "reason": "interrupted at the keyboard"}
    save_record_part(parts, "9-launch", {"wall_time_s": time.monotonic() - began, **last})
    _wait_for_parts(parts, settings, live)
    choose_witness(parts)
    summary = _write(folder, live, as_json)
    if interrupted.asked:
        return 130
    return 1 if "failed" in (why, summary["ended"]) else 0


def server(
    team: TeamArgument = "auction",
    bind: Annotated[str | None, _bind("127.0.0.1:5610", "operators and observers")] = None,
    world_endpoint: WorldEndpoint = None,
    world: WorldOption = None,
    robots: RobotsOption = None,
    strategy: StrategyOption = None,
    seed: SeedOption = None,
    max_time: MaxTimeOption = None,
    out: OutOption = None,
    sets: SetOption = None,
) -> int:
    """Run a team's server: it merges the map, gives out tasks and answers operators."""
    from expedition import cast, collect
    from expedition.launch import version
    from expedition.processes import make_folder, serve
    from expedition.results.record import save_record_part
    from expedition.warm_up import warm_up

    settings = settings_from(team, world, robots, strategy, seed, max_time=max_time, sets=sets)
    if not settings.server.enabled:
        raise UsageError(f"team {settings.name} has no server: set server.enabled=true for one")
    cast.check_strategy(settings)
    network = settings.network
    endpoint = tcp_endpoint(bind, "--bind", network.address, network.server_port)
    there = tcp_endpoint(world_endpoint, "--world-endpoint", network.address, network.world_port)
    folder, interrupted, live = _folder(settings, out), Interrupt(), Live(quiet=False)
    warm_up(live.say, lambda: not interrupted.asked, load=False)
    parts = folder / "parts"
    make_folder(parts)

    def bound(where: str) -> None:
        live.say(f"the server listens on {where} for operators")

    why = serve(settings, parts, there, [endpoint], _ties(live, "server", interrupted, bound))
    if interrupted.asked:
        last = {"ended": "operator", "reason": "the server was interrupted at the keyboard"}
        save_record_part(parts, "3-server", last)
    if not (parts / "0-launch.npz").exists():
        launch = collect.launch_part(settings, settings.mission.world, version())
        save_record_part(parts, "0-server", launch)
        _write(folder, live, as_json=False)
    if interrupted.asked:
        return 130
    return 1 if why == "failed" else 0


def agent(
    name: Annotated[str, typer.Argument(help="which robot of the team this is")],
    team: TeamArgument = "auction",
    world_endpoint: WorldEndpoint = None,
    world: WorldOption = None,
    robots: RobotsOption = None,
    seed: SeedOption = None,
    out: OutOption = None,
    sets: SetOption = None,
) -> int:
    """Run one robot's software: its own SLAM, bids and navigation."""
    from expedition.processes import live_as, make_folder
    from expedition.warm_up import warm_up

    settings = settings_from(team, world, robots, None, seed, sets=sets)
    names = [member.name for member in settings.members()]
    if name not in names:
        raise UsageError(f"no robot {name!r} in team {settings.name}: use {', '.join(names)}")
    network = settings.network
    there = tcp_endpoint(world_endpoint, "--world-endpoint", network.address, network.world_port)
    interrupted, live = Interrupt(), Live(quiet=False)
    warm_up(live.say, lambda: not interrupted.asked, load=False)
    parts = None
    if settings.robot.decides == "itself":
        parts = _folder(settings, out) / "parts"
        make_folder(parts)
    why = live_as(settings, name, parts, there, _ties(live, name, interrupted))
    live.say(f"{name} is through: {'interrupted' if interrupted.asked else why}")
    if interrupted.asked:
        return 130
    return 1 if why.startswith("refused") else 0


def _folder(settings: TeamSettings, out: Path | None) -> Path:
    """Return where the results go: the same for world and server."""
    return out or Path("runs") / settings.name


def _ties(
    live: Live,
    name: str,
    interrupted: Interrupt,
    bound: Callable[[str], None] = lambda endpoint: None,
) -> Any:
    """Return what ties a process to the terminal it runs in."""
    from expedition.launch import Progress
    from expedition.processes import Ties

    def note(line: Note) -> None:
        live.note(name, line)

    return Ties(
        note,
        lambda: not interrupted.asked,
        bound,
        lambda now, coverage: live.progress(Progress(now, coverage)),
    )


def _wait_for_parts(parts: Path, settings: TeamSettings, live: Live) -> None:
    """Wait for what the server knows, and robots without a master, if they share this folder.

    A robot that was lost leaves nothing; the others are waited for.
    """
    from expedition.processes import SERVER_DONE

    wanted = [SERVER_DONE] if settings.server.enabled else []
    if settings.robot.decides == "itself":
        wanted += [f"{member.name}.done" for member in settings.members()]
    deadline = time.monotonic() + _SERVER_PATIENCE
    while missing := [name for name in wanted if not (parts / name).exists()]:
        if time.monotonic() > deadline:
            names = ", ".join(name.removesuffix(".done") for name in missing)
            live.say(f"left nothing in {parts}: {names}; the results hold what the others know")
            return
        time.sleep(0.05)


def _write(folder: Path, live: Live, as_json: bool) -> dict[str, Any]:
    """Write the results of all parts in the folder; print the summary."""
    from expedition.results.record import load_record
    from expedition.results.write import write_results

    summary = write_results(load_record(folder / "parts"), folder)
    if as_json:
        print_json(summary)
    else:
        live.end(summary, folder)
    return summary
