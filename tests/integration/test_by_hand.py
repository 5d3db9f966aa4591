"""World, server and agents started one by one, as in separate terminals or containers."""

from __future__ import annotations

import json
import signal
import subprocess
from pathlib import Path

import psutil
import pytest

from expedition.errors import NoServerError
from expedition.operator import Operator
from tests.integration.teams import PATIENCE, WORLD, command, wait_until
from tests.integration.test_operator import free_port

pytestmark = pytest.mark.slow


def ended(process: subprocess.Popen[str], patience: float = PATIENCE) -> str:
    """Wait for a process; return what it wrote to standard error."""
    try:
        _, stderr = process.communicate(timeout=patience)
    except subprocess.TimeoutExpired:
        process.kill()
        raise
    assert "Traceback" not in stderr, stderr
    return stderr


def listens(port: int) -> bool:
    """Whether somebody listens on a port of this machine, without knocking."""
    return any(
        c.status == psutil.CONN_LISTEN and c.laddr.port == port
        for c in psutil.net_connections("tcp4")
    )


def start_all(
    folder: Path, seconds: float, *options: str
) -> tuple[dict[str, subprocess.Popen[str]], Path, str]:
    """Start server and robots before the world: they wait for it.

    Returns:
        The processes, the folder of the results, and the server's endpoint.
    """
    team = ("--world", WORLD, "--robots", "2", "--seed", "2")
    world, server = f"127.0.0.1:{free_port()}", f"127.0.0.1:{free_port()}"
    there = ("--world-endpoint", world)
    shared = ("--out", "out", "--max-time", str(seconds))
    processes = {
        "server": command("server", *team, "--bind", server, *there, *shared, cwd=folder),
        "robot1": command("agent", "robot1", *team, *there, cwd=folder),
        "robot2": command("agent", "robot2", *team, *there, cwd=folder),
    }
    wait_until(lambda: listens(int(server.rpartition(":")[2])))
    words = ("world", *team, "--bind", world, *shared, *options)
    processes["world"] = command(*words, cwd=folder)
    wait_until(lambda: listens(int(world.rpartition(":")[2])))
    return processes, folder / "out", f"tcp://{server}"


def goes_on(server: str) -> bool:
    """Whether the mission is running: the server answers operators only then."""
    try:
        with Operator(server, patience=2.0) as operator:
            return operator.now() > 0.0
    except NoServerError:
        return False


def test_a_mission_by_hand_has_full_results(tmp_path: Path) -> None:
    processes, out, _ = start_all(tmp_path, 10.0)
    told = {name: ended(process) for name, process in processes.items()}
    assert {name: p.returncode for name, p in processes.items()} == dict.fromkeys(processes, 0)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["ended"] == "time_limit"
    assert summary["problems"] == []
    assert summary["coverage"] > 0.05
    assert [robot["ended"] for robot in summary["robots"]] == ["finished", "finished"]
    assert summary["map"]["precision_occupied"] > 0.5
    assert "listens on" in told["server"]
    assert "robot1 is through: over" in told["robot1"]


@pytest.mark.parametrize("words", [("agent", "robot1"), ("server", "--bind", "127.0.0.1:0")])
def test_who_finds_no_world_gives_up_and_says_where_it_looked(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    nowhere = f"127.0.0.1:{free_port()}"
    patience = ("--set", "network.join_timeout_s=1.5")
    process = command(*words, "--world-endpoint", nowhere, *patience, cwd=tmp_path)
    told = ended(process).splitlines()
    assert process.returncode == 1
    assert f"no world answered at tcp://{nowhere} within 1.5 s" in told[-1]
    assert "--world-endpoint" in told[-1]


def test_a_world_that_nobody_joins_gives_up_and_names_who_is_missing(tmp_path: Path) -> None:
    at = f"127.0.0.1:{free_port()}"
    team = ("--world", WORLD, "--robots", "1", "--set", "network.join_timeout_s=3")
    robot = command("agent", "robot1", *team, "--world-endpoint", at, cwd=tmp_path)
    world = command("world", *team, "--bind", at, "--out", "out", cwd=tmp_path)
    told = ended(world).splitlines()
    assert world.returncode == 1
    assert "server did not join within 3 s" in told[-1]
    assert "over" in ended(robot) and robot.returncode == 0


def test_ctrl_c_at_an_agent_and_then_at_the_server(tmp_path: Path) -> None:
    """The mission goes on without an agent; without its server it ends, with results."""
    processes, out, server = start_all(tmp_path, 600.0, "--realtime")
    wait_until(lambda: goes_on(server))
    processes["robot2"].send_signal(signal.SIGINT)
    ended(processes["robot2"])
    assert processes["robot2"].returncode == 130
    assert processes["world"].poll() is None
    processes["server"].send_signal(signal.SIGINT)
    told = {name: ended(processes[name]) for name in ("server", "world", "robot1")}
    assert processes["server"].returncode == 130
    assert processes["robot1"].returncode == 0
    assert "the server is gone" in told["world"]
    summary = json.loads((out / "summary.json").read_text())
    assert summary["ended"] == "operator"
    assert summary["problems"] == []
