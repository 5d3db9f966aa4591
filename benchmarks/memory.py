"""How much memory a team takes: `python -m benchmarks.memory [--robots N] [--max-time S] [--cold]`.

Runs one mission as processes over ZeroMQ, adds up every few seconds what all of them hold, and
prints the most that it was, the largest processes then, and how the mission ended. What processes
share is counted once in all (proportional set size, from Linux's /proc). The world is the floor of
an office building where the data are found (see `benchmarks/floors.py`), else the hospital that
comes with the project. With `--cold` the inner loops are not compiled yet, as in the first mission
after an installation, and what compiling takes counts, too.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

from benchmarks.floors import data_folder
from benchmarks.mission import ROOT, RUN, run

PERIOD_S = 3.0


def family(root: int) -> list[int]:
    """Return the process `root` and all its children's children."""
    found = [root]
    for pid in found:
        for task in Path(f"/proc/{pid}/task").glob("*/children"):
            try:
                found += [int(child) for child in task.read_text(encoding="ascii").split()]
            except OSError:
                continue  # it has ended meanwhile
    return found


def megabytes(pid: int) -> tuple[float, str]:
    """Return the proportional set size of a process [MB], 0 if it is gone, and its name."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
        words = Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8").split("\0")
    except OSError:
        return 0.0, ""
    held = sum(float(line.split()[1]) for line in lines if line.startswith("Pss:"))
    return held / 1024.0, " ".join(words).split(" --")[0].strip()[-32:]


def main() -> None:
    """Run the mission, watch it, and print."""
    parser = argparse.ArgumentParser(description="How much memory a team takes.")
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--max-time", type=float, default=1300.0, help="mission time [s]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cold", action="store_true", help="compile the inner loops, too")
    chosen = parser.parse_args()
    data = data_folder()
    world = "hospital" if data is None else str(data / "maps" / "willow.yaml")
    options = ["--world", world, "--robots", str(chosen.robots), "--seed", str(chosen.seed)]
    if not chosen.cold:
        run([*options, "--in-process", "--max-time", "20"])  # compiles what is not compiled yet
    most, largest = 0.0, ""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as printed:
        caches = {"XDG_CACHE_HOME": folder} if chosen.cold else {}
        mission = subprocess.Popen(
            [
                *RUN,
                *options,
                "--max-time",
                str(chosen.max_time),
                "--json",
                "--out",
                f"{folder}/out",
            ],
            cwd=ROOT,
            env={**os.environ, **caches},
            stdout=printed,
            stderr=subprocess.DEVNULL,
        )
        while mission.poll() is None:
            sizes = sorted((megabytes(pid) for pid in family(mission.pid)), reverse=True)
            total = sum(size for size, _ in sizes)
            if total > most:
                most = total
                largest = ", ".join(f"{name} {size:.0f} MB" for size, name in sizes[:3])
            time.sleep(PERIOD_S)
        printed.seek(0)
        summary = json.loads(printed.read())
    print(f"at most {most:.0f} MB in all; largest then: {largest}")
    print(
        f"ended {summary['ended']} after {summary['sim_time_s']:.0f} s, coverage "
        f"{summary['coverage']:.3f}, {summary['real_time_factor']:.1f} times real time"
    )


if __name__ == "__main__":
    main()
