"""Compiles and loads everything that a mission needs, before its processes are forked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from expedition import cast
from expedition.team import load_team
from mapping.compiled import cache_is_cold
from protocol.in_process import run_in_process

_SECONDS = 6.0  # of a tiny mission: long enough to map, bid, drive and merge


def warm_up(say: Callable[[str], None]) -> None:
    """Live through a few seconds of a tiny mission, so that every compiled loop is loaded."""
    if cache_is_cold():
        say("compiling the inner loops, once on this machine: about a minute")
    overrides = {
        "mission": {"world": "obstacle_free", "robots": 2, "max_time_s": _SECONDS},
        "world": {"perturb_starts": False},
    }
    team = load_team(str(Path(__file__).parent.parent / "teams" / "auction.toml"), overrides)
    stage = cast.set_stage(team)
    hosts = {member.name: cast.agent_host(team, member.name) for member in team.members()}
    hosts[cast.SERVER_NAME] = cast.server_host(team)
    run_in_process(cast.world_host(team, stage), hosts, team.world.step_s, lambda name, note: None)
