"""The three processes of a team from the inside: carry a core, save what it knows at the end.

`expedition.children` forks them all on this machine; `expedition world`, `server` and `agent` run
one of them each. World and server save their part of the run's record, whatever ends them.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvloop

from expedition import cast, collect, collect_team
from expedition.cast import SERVER_NAME
from expedition.results.record import save_record_part
from expedition.team import TeamSettings, UsageError
from protocol.effects import Core, Note
from protocol.host import Host
from robot_agent.decentral.peer import Peer
from server.listener import Listener
from server.master import Master
from sim_world.world import World

SERVER_DONE = "server.done"  # in the parts folder: the server has saved its last word
WITNESSES = "witnesses"  # in the parts folder: what each member of a team without a master knows
_PROGRESS_PERIOD = 0.5  # [s], wall


@dataclass(frozen=True, slots=True)
class Ties:
    """What ties a process to whoever started it.

    Attributes:
        note: is told each line that the process logs.
        keep_going: asked all the time; when false the process leaves the mission.
        bound: is told the endpoint that the process listens on.
        progress: is told mission time [s] and coverage now and then.
    """

    note: Callable[[Note], None]
    keep_going: Callable[[], bool]
    bound: Callable[[str], None] = lambda endpoint: None
    progress: Callable[[float, float], None] = lambda now, coverage: None


def play_world(
    team: TeamSettings, stage: cast.Stage, parts: Path, endpoint: str, realtime: bool, ties: Ties
) -> str:
    """Play the world until the mission is over; return why it ended.

    Raises:
        OSError: the endpoint cannot be bound.
        TimeoutError: somebody of the team never joined.
    """
    from sim_world.app import run_world

    host = cast.world_host(team, stage, not realtime)
    members = [member.name for member in team.members()]
    if team.server.enabled:
        members.append(cast.SERVER_NAME)
    core = host.core
    assert isinstance(core, World)
    told = 0.0

    def keep_going() -> bool:
        nonlocal told
        if time.monotonic() - told > _PROGRESS_PERIOD and core.judge.timeline:
            told = time.monotonic()
            ties.progress(*core.judge.timeline[-1])
        return ties.keep_going()

    step = team.world.step_s
    try:
        return uvloop.run(
            run_world(
                host,
                endpoint,
                step,
                members,
                realtime,
                ties.note,
                keep_going,
                ties.bound,
                team.network.join_timeout_s,
            )
        )
    finally:
        save_record_part(parts, "1-world", collect.world_part(core, stage, team))


def serve(team: TeamSettings, parts: Path, world: str, endpoints: Sequence[str], ties: Ties) -> str:
    """Be the server until the mission is over; return why it ended.

    Args:
        team: the effective settings.
        parts: folder for the server's part of the record.
        world: the world's endpoint.
        endpoints: where to listen for operators: the first that is free.
        ties: to whoever started it.

    Raises:
        OSError: no endpoint can be bound.
        protocol.errors.RefusedError: the world does not take the server in.
        TimeoutError: there is no world there, or it fell silent.
    """
    from server.app import run_server

    host = cast.server_host(team)
    saved = time.monotonic()

    def keep_going() -> bool:
        nonlocal saved
        if time.monotonic() - saved > team.checkpoint_s > 0.0:
            saved = time.monotonic()
            _save_server(parts, host, last=False)
        return ties.keep_going()

    names = [member.name for member in team.members()]
    try:
        return uvloop.run(
            run_server(
                host,
                world,
                endpoints,
                names,
                ties.note,
                keep_going,
                ties.bound,
                team.network.join_timeout_s,
            )
        )
    finally:
        _save_server(parts, host, last=True)
        (parts / SERVER_DONE).touch()


def _save_server(parts: Path, host: Host, last: bool) -> None:
    core = host.core
    assert isinstance(core, Master | Listener)
    save_server(parts, core, core.now, last)


def save_server(parts: Path, core: Master | Listener, now: float, last: bool = True) -> None:
    """Save the server's part of the record."""
    if isinstance(core, Listener):
        save_record_part(parts, "2-server", collect_team.listener_part(core))
        witness = collect_team.listener_witness(core)  # which draws what it was told last, too
        save_witness(parts, SERVER_NAME, len(core.shared.team), witness)
    else:
        save_record_part(parts, "2-server", collect.server_part(core, now, last))


def save_robot(parts: Path, core: Core, team: TeamSettings) -> None:
    """Save what a robot knows that decides for itself: of itself, and of the team."""
    if not isinstance(core, Peer):
        return
    save_record_part(parts, f"3-{core.name}", collect_team.peer_part(core))
    witness = collect_team.peer_witness(core, team.server.map)
    save_witness(parts, core.name, len(core.sharing.shared.team), witness)


def save_witness(parts: Path, name: str, held: int, part: Mapping[str, Any]) -> None:
    """Save what a member knows of what the team found; `choose_witness` takes the word of one.

    Args:
        parts: folder of the record.
        name: the member's; what it saved before goes.
        held: how many observations it holds.
        part: what it knows.
    """
    for older in (parts / WITNESSES).glob("*.npz"):
        if older.stem.partition("-")[2] == name:
            older.unlink()
    save_record_part(parts / WITNESSES, f"{held:07}-{name}", part)


def choose_witness(parts: Path) -> None:
    """Take the word of the member that holds the most observations for what the team found.

    A server that listens may have been out of reach; where it holds as much, its word counts.
    """
    witnesses = sorted((parts / WITNESSES).glob("*.npz"), key=_most_first)
    if witnesses:
        witnesses[0].replace(parts / "2-team.npz")
    shutil.rmtree(parts / WITNESSES, ignore_errors=True)


def _most_first(path: Path) -> tuple[int, bool, str]:
    held, _, name = path.stem.partition("-")
    return -int(held), name != SERVER_NAME, name


def live_as(team: TeamSettings, name: str, parts: Path | None, world: str, ties: Ties) -> str:
    """Be a robot's software until the mission is over; return why it ended.

    Args:
        team: the effective settings.
        name: the robot's.
        parts: folder for its part of the record; None to leave none.
        world: the world's endpoint.
        ties: to whoever started it.

    Raises:
        protocol.errors.RefusedError: the world does not take the robot in.
        TimeoutError: there is no world there, or it fell silent.
    """
    from robot_agent.app import run_agent

    patience = team.network.join_timeout_s
    host = cast.agent_host(team, name)
    try:
        return uvloop.run(run_agent(host, world, ties.note, ties.keep_going, patience))
    finally:
        if parts is not None:
            save_robot(parts, host.core, team)
            (parts / f"{name}.done").touch()


def begin_record(parts: Path, launch: Mapping[str, Any]) -> None:
    """Make the parts folder ready for a new run: what an earlier one left there goes.

    Raises:
        UsageError: nothing can be written there.
    """
    make_folder(parts)
    for old in (*parts.glob("*.npz"), *parts.glob("*.done")):
        old.unlink(missing_ok=True)
    shutil.rmtree(parts / WITNESSES, ignore_errors=True)
    save_record_part(parts, "0-launch", launch)


def make_folder(parts: Path) -> None:
    """Make the parts folder, and see whether it can be written.

    Raises:
        UsageError: it cannot.
    """
    try:
        parts.mkdir(parents=True, exist_ok=True)
        (parts / ".written").touch()
        (parts / ".written").unlink()
    except OSError as error:
        raise UsageError(
            f"cannot write results in {parts.parent}: {error.strerror}; choose another folder "
            "with --out"
        ) from None
