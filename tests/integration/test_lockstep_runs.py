"""The same seed gives the same run: over ZeroMQ, in one process, and again; faults included."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.integration.teams import events, fault, play

pytestmark = pytest.mark.slow


def test_a_run_over_sockets_is_the_run_in_one_process(tmp_path: Path) -> None:
    sockets = play(tmp_path / "a")
    again = play(tmp_path / "b")
    here = play(tmp_path / "c", in_process=True)
    other = play(tmp_path / "d", in_process=True, seed=2)
    assert sockets["digest"] == again["digest"] == here["digest"]
    assert other["digest"] != here["digest"]
    for key in ("ended", "coverage", "bytes", "sim_time_s", "remaining", "robots", "map"):
        assert sockets[key] == here[key], key
    assert sockets["ended"] == "time_limit"
    assert sockets["coverage"] > 0.05
    # The last changes of the map still reach everybody before the team parts.
    held = {robot["map_digest"] for robot in sockets["robots"]}
    assert held == {sockets["map"]["digest"]} != {None}
    for name in ("map.pgm", "pose_graph.g2o", "trajectories/robot1.tum", "truth/robot2.tum"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "c" / name).read_bytes()


@pytest.mark.parametrize(
    ("kind", "duration", "state"),
    [
        ("kill", 0.0, "lost"),
        ("restart", 0.0, "finished"),
        ("freeze", 6.0, "finished"),
        ("cut_link", 6.0, "finished"),
    ],
)
def test_a_scripted_fault_repeats_exactly(
    kind: str, duration: float, state: str, tmp_path: Path
) -> None:
    """Once over sockets and once in one process: that is twice."""
    settings = (fault(9.0, "robot2", kind, duration),)
    sockets = play(tmp_path / "a", *settings)
    here = play(tmp_path / "b", *settings, in_process=True)
    assert sockets["digest"] == here["digest"]
    assert sockets["ended"] == "time_limit"
    assert sockets["robots"][1]["ended"].startswith(state)
    happenings = [e for e in events(tmp_path / "a") if e.get("robot") == "robot2"]
    assert happenings == [e for e in events(tmp_path / "b") if e.get("robot") == "robot2"]
    if kind in ("freeze", "cut_link"):
        assert {"lost", "back"} <= {e["event"] for e in happenings}
