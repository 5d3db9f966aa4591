"""What really goes wrong: processes killed, Ctrl-C, a peer that sends rubbish."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import msgpack
import numpy as np
import pytest
import zmq

from expedition.launch import Progress
from protocol.codec import Header, encode
from protocol.messages import Hello
from protocol.operator_messages import StopRequest, VisitRequest
from tests.integration.teams import (
    PATIENCE,
    Told,
    children_of,
    command,
    events,
    play,
    title,
    wait_until,
)

pytestmark = pytest.mark.slow


class Killer:
    """Kills one process of the team at a mission time."""

    def __init__(self, process_title: str, at: float = 8.0) -> None:
        self._title, self._at = process_title, at
        self.killed = 0

    def __call__(self, progress: Progress) -> None:
        if progress.sim_time_s >= self._at and not self.killed:
            (victim,) = [p for p in children_of(os.getpid()) if title(p) == self._title]
            victim.kill()
            self.killed = victim.pid


def test_the_mission_goes_on_without_a_robot_whose_process_is_killed(tmp_path: Path) -> None:
    killer = Killer("expedition agent robot2")
    told = Told(killer)
    summary = play(tmp_path, told=told, max_time=60.0)
    assert killer.killed
    assert summary["ended"] == "time_limit"
    one, two = summary["robots"]
    assert one["ended"] == "finished"
    assert two["ended"].startswith("lost at ")
    assert any("robot2 warning: its process was killed by signal 9" in note for note in told.notes)
    assert any("body stands still" in note for note in told.notes)


@pytest.mark.parametrize("victim", ["server", "world"])
def test_without_world_or_server_a_mission_fails_and_says_so(victim: str, tmp_path: Path) -> None:
    told = Told(Killer(f"expedition {victim}"))
    summary = play(tmp_path, told=told, max_time=60.0)
    assert summary["ended"] == "failed"
    assert (tmp_path / "summary.json").exists()
    assert any(f"{victim} warning: its process was killed" in note for note in told.notes)


def test_ctrl_c_ends_a_run_with_its_results_and_leaves_no_process(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["run", "--world", "office_single_corridor", "--robots", "2", "--out", str(out)]
    run = command(*words, "--json", "--realtime", "--set", "network.server_port=0", cwd=tmp_path)
    wait_until(lambda: len(children_of(run.pid)) >= 4)
    family = children_of(run.pid)
    agents = [p for p in family if title(p).startswith("expedition agent")]
    wait_until(lambda: all(p.cpu_times().user > 0.2 for p in agents))
    run.send_signal(signal.SIGINT)
    stdout, stderr = run.communicate(timeout=PATIENCE)
    assert run.returncode == 130
    summary = json.loads(stdout)
    assert summary["ended"] == "operator"
    assert summary["problems"] == []
    assert json.loads((out / "summary.json").read_text()) == summary
    assert "Traceback" not in stderr
    wait_until(lambda: not any(p.is_running() for p in family), 20.0)


def _rubbish(rng: np.random.Generator) -> list[bytes]:
    """Return a frame that nobody should take for a message."""
    visit = VisitRequest(robot="robot1", x_m=1.0, y_m=1.0)

    def header(version: tuple[int, int] = (1, 0), source: str = "evil") -> Header:
        return Header(visit.type, source, "server", 1, 0.0, version)

    good = encode(header(), visit)
    kind = int(rng.integers(0, 8))
    if kind == 0:
        return [rng.bytes(int(rng.integers(0, 80))) for _ in range(int(rng.integers(1, 5)))]
    if kind == 1:
        return [good[0][: int(rng.integers(0, len(good[0])))], good[1]]
    if kind == 2:
        return [good[0], bytes(300_000)]
    if kind == 3:
        return encode(header((9, int(rng.integers(0, 99)))), visit)
    if kind == 4:
        return encode(header(source=str(rng.choice(["robot1", "world", "server"]))), visit)
    if kind == 5:
        shape = ["ranges", "<f4", [2**31, 2**20]]
        body = {"stamp_s": 0.0, "T_wheel_base": [0, 0, 0], "bumped": False, "~": [shape]}
        head = [[1, 0], "body_frame", "evil", "server", 1, 0.0, 0]
        return [msgpack.packb(head), msgpack.packb(body), bytes(64)]
    if kind == 6:
        return [good[0], b"\x91" * 5000]
    head = [[1, 0], f"type{rng.integers(0, 1000)}", "evil", "server", 1, 0.0, 0]
    return [msgpack.packb(head), b"\x80"]


def _flood(endpoint: str, frames: int) -> None:
    """Send rubbish under several names, some of which belong to others."""
    rng = np.random.default_rng(1)
    with zmq.Context() as context:
        for name in (b"evil", b"robot1", b"world", b"", b"\xff\x1b[2J", b"x" * 200):
            with context.socket(zmq.DEALER) as socket:
                if name:
                    socket.setsockopt(zmq.IDENTITY, name)
                socket.setsockopt(zmq.LINGER, 5000)
                socket.connect(endpoint)
                for _ in range(frames // 6):
                    socket.send_multipart(_rubbish(rng))
                stop = StopRequest()
                for source in ("robot1", "world"):
                    hello = Hello(role="robot", incarnation=99)
                    for number, word in enumerate((hello, stop), start=1):
                        forged = Header(word.type, source, "server", number, 0.0)
                        socket.send_multipart(encode(forged, word))


def test_a_flood_of_rubbish_neither_stops_the_team_nor_goes_unnoticed(tmp_path: Path) -> None:
    flooded: list[float] = []

    def flood(progress: Progress) -> None:
        if not flooded and progress.sim_time_s >= 2.0:
            flooded.append(progress.sim_time_s)
            _flood(told.endpoint, 3000)

    told = Told(flood)
    summary = play(tmp_path, "world.perturb_starts=false", told=told, max_time=40.0)
    assert flooded
    assert summary["ended"] == "time_limit"
    assert [robot["ended"] for robot in summary["robots"]] == ["finished", "finished"]
    assert summary["coverage"] > 0.1
    dropped = [e for e in events(tmp_path) if e["event"] == "frames dropped"]
    assert sum(e["count"] for e in dropped) > 1000
    assert "evil" in {e["peer"] for e in dropped}
    assert len(dropped) <= 110
    warnings = [note for note in told.notes if "dropped a frame" in note]
    assert 5 < len(warnings) <= 110
    assert not any("\x1b" in note for note in told.notes)
