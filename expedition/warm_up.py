"""Compiles and loads everything that a mission needs, before its processes are forked.

A compiler leaves much behind in the process it worked in (about 100 MB), and every process forked
from that one would own a copy. So a process that ends does the compiling; this one loads.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from pathlib import Path

import numpy as np

from expedition import cast
from expedition.compile_lock import only_one
from expedition.team import load_team
from mapping.compiled import cache_base, cache_is_cold
from mapping.scan import LaserScan
from mapping.scan_coding import decode_scan, encode_scan
from protocol.in_process import run_in_process

# Missions long enough to map, bid, drive and merge; to be compiled, also to close loops and to get
# into tight places. (world, robots, seconds)
_TO_LOAD = ("obstacle_free", 2, 6.0)
_TO_COMPILE = ("hospital", 3, 60.0)
_POLL_S = 0.2
_FORK = multiprocessing.get_context("fork")


def warm_up(
    say: Callable[[str], None], keep_going: Callable[[], bool] = lambda: True, load: bool = True
) -> None:
    """Live through a few seconds of a mission, so that the compiled loops are loaded.

    Args:
        say: is told what a person has to wait for.
        keep_going: asked while something compiles; when false nothing is waited for.
        load: into this process, too; otherwise it is only seen to that everything is compiled.
    """
    if cache_is_cold():
        with only_one(cache_base(), say, keep_going):
            if cache_is_cold() and keep_going():
                say("compiling the inner loops, once on this machine: a minute or two")
                _compile_apart(keep_going)
    if load and keep_going():
        _live_a_little(*_TO_LOAD)


def _compile_apart(keep_going: Callable[[], bool]) -> None:
    """Run a mission in a process of its own, which keeps on disk what it compiles."""
    compiler = _FORK.Process(target=_compile_all, name="expedition compiler", daemon=True)
    compiler.start()
    while compiler.is_alive() and keep_going():
        compiler.join(_POLL_S)
    if compiler.is_alive():
        compiler.kill()
    compiler.join()


def _compile_all() -> None:
    """Run everything compiled at least once in this process."""
    _live_a_little(*_TO_COMPILE)
    # Coded scans are for teams without a server; that mission has none.
    ranges = np.array([1.0, 1.1, 8.0, 0.0], dtype=np.float32)
    decode_scan(encode_scan(LaserScan(ranges, 0.0, 0.1, 8.0, 0.0)))


def _live_a_little(world: str, robots: int, seconds: float) -> None:
    """Run a small mission in this process."""
    overrides = {"mission": {"world": world, "robots": robots, "max_time_s": seconds}}
    team = load_team(str(Path(__file__).parent.parent / "teams" / "auction.toml"), overrides)
    stage = cast.set_stage(team)
    hosts = {member.name: cast.agent_host(team, member.name) for member in team.members()}
    hosts[cast.SERVER_NAME] = cast.server_host(team)
    run_in_process(cast.world_host(team, stage), hosts, team.world.step_s, lambda name, note: None)
