"""What map updates of a real robot take: `python -m benchmarks.update_sizes [LOG]`.

The log (the Intel laboratory where the data are found, see `benchmarks/floors.py`) is estimated
first. An observation is taken whenever the robot has moved by half a metre or turned by 20 degrees,
and placed where the final trajectory has it. Printed is the table of Pfingsthorn et al. 2007 for
each meaning that "a cell changes" may have (see `expedition/experiments/update_sizes.py`). With
`--corrections N` the belief changes N times on the way: poses of all earlier observations shift by
centimetres and are told again.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import get_args

import numpy as np

from benchmarks.floors import data_folder
from expedition.experiments.map_updates import MapUpdate
from expedition.experiments.tables import text_table
from expedition.experiments.update_sizes import update_sizes
from expedition.experiments.vote_counts import CellValue
from expedition.recordings.read import read_recording
from expedition.recordings.recording import Recording
from expedition.slam_run import heeded, run_slam
from mapping.geometry import Floats, Pose2, pose_from
from mapping.incremental_slam import SlamSettings

STEP, TURN = 0.5, math.radians(20.0)
SHIFT = 0.05  # [m]


def updates_of(
    recording: Recording, poses: Floats, reach: float, corrections: int
) -> list[MapUpdate]:
    """Return the updates of a log: one for each observation that is far enough from the last.

    Args:
        recording: the log.
        poses: (n, 3) x, y [m], theta [rad] at each reading.
        reach: returns from beyond [m] only tell that nothing is nearer.
        corrections: how often all earlier poses shift, evenly spread.
    """
    taken: list[int] = []
    for k in range(len(poses)):
        off = pose_from(poses[taken[-1]]).inverse() @ pose_from(poses[k]) if taken else None
        if off is None or math.hypot(off.x, off.y) >= STEP or abs(off.theta) >= TURN:
            taken.append(k)
    placed = [pose_from(poses[k]) for k in taken]
    changes = {round((i + 1) * len(taken) / (corrections + 1)) for i in range(corrections)}
    updates, shift = [], 0.0
    for number, k in enumerate(taken):
        shift += SHIFT * (number in changes)
        now = [Pose2(p.x + shift, p.y, p.theta) for p in placed[: number + 1]]
        moved = dict(enumerate(now[:-1])) if number in changes else {}
        scan = heeded(recording.readings[k].scan, reach)
        updates.append(MapUpdate(scan.stamp, scan, now[-1], moved))
    return updates


def main() -> None:
    """Estimate the log, count, and print."""
    data = data_folder()
    parser = argparse.ArgumentParser(description="What map updates of a real robot take.")
    default = None if data is None else data / "logs" / "intel.clf.gz"
    parser.add_argument("log", nargs="?", type=Path, default=default)
    parser.add_argument("--estimator", default="scan_matching")
    parser.add_argument("--max-range", type=float, default=20.0, help="[m]")
    parser.add_argument("--corrections", type=int, default=0)
    chosen = parser.parse_args()
    if chosen.log is None:
        parser.error("name a recorded log, or set EXPEDITION_DATA to where they are")
    recording = read_recording(chosen.log)
    rng = np.random.default_rng(1)
    run = run_slam(recording, chosen.estimator, SlamSettings(), rng, chosen.max_range)
    updates = updates_of(recording, run.poses, chosen.max_range, chosen.corrections)
    rows = []
    for value in get_args(CellValue):
        found = update_sizes(updates, value=value)
        totals = found.totals
        rows.append(
            {
                "value": value,
                "sent": len(found.stamps),
                "discarded": found.discarded,
                **totals,
                "best_grid/pose_graph": totals["best_grid"] / max(totals["pose_graph"], 1),
                "changed of box": found.changed / max(found.boxed, 1),
            }
        )
    print(text_table(rows))


if __name__ == "__main__":
    main()
