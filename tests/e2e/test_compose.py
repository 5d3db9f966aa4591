"""The team in containers: built and run for real, where a Docker engine answers."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
MAX_TIME_S = 20.0

pytestmark = [pytest.mark.docker, pytest.mark.slow, pytest.mark.timeout(1800)]


def _works(*command: str) -> bool:
    try:
        return subprocess.run(command, capture_output=True, timeout=600).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def _compose_command() -> list[str]:
    """Return how compose is called here; skip where there is nothing to call."""
    if shutil.which("docker") is None or not _works("docker", "info"):
        pytest.skip("no Docker engine answers")
    base = (ROOT / "Dockerfile").read_text().split("FROM ")[1].split()[0]
    if not _works("docker", "image", "inspect", base) and not _works("docker", "pull", base):
        pytest.skip(f"the engine has no image {base} and cannot get it")
    for command in (["docker", "compose"], ["docker-compose"]):
        if shutil.which(command[0]) is not None and _works(*command, "version"):
            return command
    pytest.skip("neither `docker compose` nor `docker-compose` is installed")


class Compose:
    """One project of containers with results in `runs`."""

    def __init__(self, command: list[str], runs: Path) -> None:
        self._command = [*command, "-p", f"expedition-test-{os.getpid()}"]
        self._settings = os.environ | {
            "RUNS": str(runs),
            "WORLD": "obstacle_free",
            "MAX_TIME": str(MAX_TIME_S),
        }

    def __call__(self, *words: str, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*self._command, *words],
            cwd=ROOT,
            env=self._settings,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=timeout,
        )

    def exit_codes(self) -> dict[str, int]:
        """Return how each container ended, by its service."""
        look = '{{index .Config.Labels "com.docker.compose.service"}} {{.State.ExitCode}}'
        containers = self("ps", "-a", "-q").stdout.split()
        told = subprocess.run(
            ["docker", "inspect", "-f", look, *containers], text=True, capture_output=True
        )
        pairs = (line.split() for line in told.stdout.splitlines())
        return {service: int(code) for service, code in pairs}


@pytest.fixture
def compose(tmp_path: Path) -> Iterator[Compose]:
    project = Compose(_compose_command(), tmp_path)
    yield project
    project("down", "--volumes", "--timeout", "5")


def test_a_team_in_containers_ends_by_itself_and_leaves_its_results(
    compose: Compose, tmp_path: Path
) -> None:
    built = compose("build", timeout=1500.0)
    assert built.returncode == 0, built.stdout[-4000:]

    ran = compose("up", timeout=300.0)
    assert ran.returncode == 0, ran.stdout[-4000:]
    codes = compose.exit_codes()
    assert set(codes) >= {"world", "server", "robot1", "robot2", "robot3"}
    assert set(codes.values()) == {0}, ran.stdout[-4000:]

    results = tmp_path / "compose"
    summary = json.loads((results / "summary.json").read_text())
    assert summary["ended"] == "time_limit"
    assert summary["sim_time_s"] == pytest.approx(MAX_TIME_S, abs=1.0)
    assert [robot["id"] for robot in summary["robots"]] == ["robot1", "robot2", "robot3"]
    assert all(robot["scans"] > 0 for robot in summary["robots"])
    assert summary["coverage"] > 0.0
    assert {path.name for path in results.iterdir()} >= {"map.png", "map.yaml", "report.html"}
