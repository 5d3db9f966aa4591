"""Compiles and loads everything that a mission needs, before its processes are forked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from expedition import cast
from expedition.compile_lock import only_one
from expedition.team import load_team
from mapping.compiled import cache_base, cache_is_cold
from protocol.in_process import run_in_process

_SECONDS = 6.0  # of a tiny mission: long enough to map, bid, drive and merge


def warm_up(
    say: Callable[[str], None], keep_going: Callable[[], bool] = lambda: True, load: bool = True
) -> None:
    """Live through a few seconds of a tiny mission, so that every compiled loop is loaded.

    Args:
        say: is told what a person has to wait for.
        keep_going: asked while another process compiles; when false nothing is waited for.
        load: also if everything was compiled before; otherwise there is nothing to do then.
    """
    if not cache_is_cold():
        if load:
            _live_a_little()
        return
    with only_one(cache_base(), say, keep_going):
        if cache_is_cold() and keep_going():
            say("compiling the inner loops, once on this machine: about a minute")
            _live_a_little()
        elif load:
            _live_a_little()


def _live_a_little() -> None:
    """Run the tiny mission."""
    overrides = {
        "mission": {"world": "obstacle_free", "robots": 2, "max_time_s": _SECONDS},
        "world": {"perturb_starts": False},
    }
    team = load_team(str(Path(__file__).parent.parent / "teams" / "auction.toml"), overrides)
    stage = cast.set_stage(team)
    hosts = {member.name: cast.agent_host(team, member.name) for member in team.members()}
    hosts[cast.SERVER_NAME] = cast.server_host(team)
    run_in_process(cast.world_host(team, stage), hosts, team.world.step_s, lambda name, note: None)
