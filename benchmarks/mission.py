"""How fast missions are: `python -m benchmarks.mission [--max-time S] [--seed K] [--repeat N]`.

Runs one mission of three robots in one process and as processes over ZeroMQ, and prints for each
how many times faster than real time it was, the processor time it took (of all its processes), and
whether the two came to the very same result. The world is the real hospital floor where the data
are found (see `benchmarks/floors.py`), else the hospital that comes with the project.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks.floors import data_folder  # noqa: E402

MODES = {"one process": ("--in-process",), "over ZeroMQ": ()}
RUN = (sys.executable, "-c", "from expedition.cli import main; main()", "run", "auction")


@dataclass(frozen=True)
class Outcome:
    """One mission: its summary, and the processor time of all its processes [s]."""

    summary: dict[str, Any]
    cpu: float


def place() -> list[str]:
    """Return the options that say where the mission takes place."""
    folder = data_folder()
    if folder is None:
        return ["--world", "hospital", "--robots", "3"]
    floor = folder / "maps" / "hospital_62m.yaml"
    return ["--world", str(floor), "--starts", "2.0,12.5,0;2.0,11.7,0;2.0,13.3,0"]


def run(options: list[str]) -> Outcome:
    """Run a mission and wait for its end."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as out:
        done = subprocess.run(
            [*RUN, *options, "--json", "--out", out],
            cwd=ROOT,
            check=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return Outcome(json.loads(done.stdout), cpu)


def main() -> None:
    """Run the missions in turn and print."""
    parser = argparse.ArgumentParser(description="How fast missions are.")
    parser.add_argument("--max-time", type=float, default=300.0, help="mission time [s]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--repeat", type=int, default=1, help="run each mode so many times")
    chosen = parser.parse_args()
    options = [*place(), "--seed", str(chosen.seed)]
    run([*options, "--in-process", "--max-time", "20"])  # compiles what is not compiled yet
    options += ["--max-time", str(chosen.max_time)]
    print(
        f"{'mode':<14} {'mission s':>10} {'wall s':>8} {'times real time':>16} {'cpu s':>8}  load"
    )
    digests = []
    for mode in [*MODES] * chosen.repeat:
        outcome = run([*options, *MODES[mode]])
        summary = outcome.summary
        digests.append(summary["digest"])
        print(
            f"{mode:<14} {summary['sim_time_s']:>10.0f} {summary['wall_time_s']:>8.1f} "
            f"{summary['real_time_factor']:>16.1f} {outcome.cpu:>8.1f}  {os.getloadavg()[0]:.1f}"
        )
    print("results are the same" if len(set(digests)) == 1 else f"results DIFFER: {digests}")


if __name__ == "__main__":
    main()
