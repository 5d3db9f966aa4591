"""What every ready-made team must do, tested by its being there: the same seed, the same run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from expedition.commands.options import settings_from
from expedition.launch import Watch, run_team
from expedition.team import ready_made

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]  # two missions, one over sockets

WORLD = "office_single_corridor"
QUICK = ("network.server_port=0", "robot.estimator=scan_matching", "checkpoint_s=0")
# Without a server, too, where a team can do without.
CASES = [(name, True) for name in sorted(ready_made())] + [("rescue", False)]


def play(out: Path, name: str, server: bool, in_process: bool) -> dict[str, Any]:
    """Run two robots for a short while; return the summary."""
    sets = [*QUICK] if server else [*QUICK, "server.enabled=false"]
    team = settings_from(name, WORLD, 2, None, 1, None, None, 40.0, sets)
    watch = Watch(lambda name, note: None, lambda progress: None, lambda: True)
    return run_team(team, out, watch, in_process)


@pytest.mark.parametrize(("name", "server"), CASES)
def test_a_run_over_sockets_is_the_run_in_one_process(
    name: str, server: bool, tmp_path: Path
) -> None:
    sockets = play(tmp_path / "sockets", name, server, in_process=False)
    here = play(tmp_path / "here", name, server, in_process=True)
    assert sockets["digest"] == here["digest"]
    for key in ("ended", "coverage", "bytes", "sim_time_s", "remaining", "robots", "map"):
        assert sockets[key] == here[key], key
    assert here["ended"] == "time_limit"
    assert here["coverage"] > 0.05
    assert {robot["ended"] for robot in here["robots"]} == {"finished"}
