"""Small missions to test with, and a look at what they leave behind."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

from expedition.commands.options import settings_from
from expedition.launch import Progress, Watch, run_team
from protocol.effects import Note

ROOT = Path(__file__).parent.parent.parent
WORLD = "office_single_corridor"
PATIENCE = 200.0  # [s]; machines that run tests may be busy with much else
STARTED: list[subprocess.Popen[str]] = []


@dataclass
class Told:
    """All that a run told while it went on, and somebody who may interfere."""

    on_progress: Callable[[Progress], None] = lambda progress: None
    notes: list[str] = field(default_factory=list)
    going: bool = True
    endpoint: str = ""

    def note(self, name: str, note: Note) -> None:
        self.notes.append(f"{name} {note.level}: {note.text}")
        if note.text.startswith("listens on "):
            self.endpoint = note.text.removeprefix("listens on ").split(",")[0]

    def watch(self) -> Watch:
        return Watch(self.note, self.on_progress, lambda: self.going)


def play(
    out: Path,
    *sets: str,
    seed: int = 1,
    max_time: float = 20.0,
    in_process: bool = False,
    realtime: bool = False,
    told: Told | None = None,
) -> dict[str, Any]:
    """Run two robots for a short while; return the summary."""
    told = told or Told()
    given = ["network.server_port=0", *sets]
    settings = settings_from("auction", WORLD, 2, None, seed, None, None, max_time, given)
    return run_team(settings, out, told.watch(), in_process, realtime)


def fault(at: float, robot: str, kind: str, duration: float = 0.0) -> str:
    """Return the setting for one scripted fault."""
    return (
        f'world.faults=[{{at_s = {at}, robot = "{robot}", kind = "{kind}", '
        f"duration_s = {duration}}}]"
    )


def events(out: Path) -> list[dict[str, Any]]:
    """Return the event log of a run."""
    return [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]


def command(*words: str, cwd: Path) -> subprocess.Popen[str]:
    """Start the command line as a user would."""
    process = subprocess.Popen(
        [sys.executable, "-m", "expedition.cli", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=cwd,
    )
    STARTED.append(process)
    return process


def end_all_started() -> None:
    """End what a test that failed left running."""
    while STARTED:
        process = STARTED.pop()
        if process.poll() is None:
            process.kill()
        process.communicate()


def children_of(pid: int) -> list[psutil.Process]:
    """Return the processes that a process started, dead ones left out."""
    try:
        found = psutil.Process(pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []
    return [process for process in found if process.status() != psutil.STATUS_ZOMBIE]


def title(process: psutil.Process) -> str:
    """Return a process's title; empty when it has just ended."""
    try:
        return " ".join(process.cmdline()).strip()
    except psutil.Error:
        return ""


def wait_until(happened: Callable[[], bool], patience: float = PATIENCE) -> None:
    """Wait for something that other processes do."""
    deadline = time.monotonic() + patience
    while not happened():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.02)
