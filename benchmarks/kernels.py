"""How fast the kernels are: `python -m benchmarks.kernels [--only WORD] [--seconds S]`.

Prints one line per kernel: what it did, how much of it per second of processor time, the median
time of a call by the clock, and the least processor time of a call, which other work on the
machine disturbs less; all after warming up. To add a row, write a function that prepares the work
and returns a `Case`, and put it in `CASES`, here or in a file of rows beside this one. Real maps
are measured too where they are found: in the folder EXPEDITION_DATA names, or in `shared/data`
beside the repository.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks import graphs, sensing
from benchmarks.floors import (
    RESOLUTION,
    SENSOR_RANGE,
    Case,
    farthest,
    floor,
    half_known,
    office,
    weights_of,
)
from mapping.bucket_wave import UNREACHED
from mapping.cell_box import CellBox
from mapping.coarse_gain import (
    coarse_information_gains,
    coarsen_classes,
    refresh_classes,
)
from mapping.distance_field import truncated_distance, update_distance
from mapping.frontiers import find_frontiers
from mapping.grid import CLEAR, OBSTACLE, GridGeometry
from mapping.information_gain import information_gains
from mapping.path_planning import (
    cost_field,
    path_to,
    smooth_path,
    traversal_weights,
)


def distance_full() -> Case:
    """Distance field of a whole grid."""
    solid = office() == OBSTACLE
    run = partial(truncated_distance, solid, RESOLUTION, 0.5)
    return Case("distance field", "office 1000 x 1000, limit 0.5 m", solid.size, "cells", run)


def distance_update() -> Case:
    """Distance field after one scan."""
    solid = office() == OBSTACLE
    field, box = truncated_distance(solid, RESOLUTION, 0.5), CellBox(300, 300, 620, 620)
    run = partial(update_distance, field, solid, box, RESOLUTION, 0.5)
    return Case("distance update", "box of 320 x 320, limit 0.5 m", 320 * 320, "cells", run)


def weights_case() -> Case:
    """Traversal weights of a whole grid."""
    clear = office() == CLEAR
    clearance = truncated_distance(~clear, RESOLUTION, 0.6)
    run = partial(traversal_weights, clear, clearance, 0.25, 0.6)
    return Case("traversal weights", "office 1000 x 1000", clear.size, "cells", run)


def costs_open() -> Case:
    """Cost field of an empty grid."""
    weights = np.ones((1000, 1000), dtype=np.uint8)
    run = partial(cost_field, weights, (10, 10), RESOLUTION)
    return Case("cost field", "empty 1000 x 1000", weights.size, "cells", run)


def costs_floor() -> Case:
    """Cost field of a real floor, with care around obstacles."""
    classes, resolution = floor("willow")
    weights = weights_of(classes, resolution)
    start = farthest(weights, resolution)
    free = int((cost_field(weights, start, resolution).units != UNREACHED).sum())
    work = f"floor of {free // 1000}k free cells, 6 weights"
    return Case("cost field", work, free, "cells", lambda: cost_field(weights, start, resolution))


def path_case() -> Case:
    """One long path, extracted and smoothed."""
    classes, resolution = floor("willow")
    weights = weights_of(classes, resolution)
    field = cost_field(weights, farthest(weights, resolution), resolution)
    at = int(np.where(field.units != UNREACHED, field.units, -1).argmax())
    goal = (at // weights.shape[1], at % weights.shape[1])
    geometry = GridGeometry(resolution, 0.0, 0.0, *weights.shape)
    work = f"{float(field.at([goal])[0]):.0f} m of cost, smoothed"
    return Case(
        "path", work, 1, "paths", lambda: smooth_path(path_to(field, goal), weights, geometry)
    )


def frontiers_case() -> Case:
    """Frontiers of a half known floor."""
    classes, _ = half_known("hospital_62m")
    rows, cols = classes.shape
    work = f"{rows} x {cols}, {len(find_frontiers(classes))} places"
    return Case("frontiers", work, classes.size, "cells", lambda: find_frontiers(classes))


def coarsen_case() -> Case:
    """Blocks of a half known floor."""
    classes, _ = half_known("hospital_62m")
    work = f"{classes.shape[0]} x {classes.shape[1]} by 4"
    return Case("coarsen", work, classes.size, "cells", lambda: coarsen_classes(classes, 4))


def refresh_case() -> Case:
    """Blocks of a half known floor after one scan."""
    classes, _ = half_known("hospital_62m")
    coarse, box = coarsen_classes(classes, 4), CellBox(200, 200, 500, 500)
    run = partial(refresh_classes, coarse, box)
    return Case("coarsen update", "box of 300 x 300 by 4", 300 * 300, "cells", run)


def gains_case(factor: int) -> Case:
    """Information gains of 150 frontier cells at 8 m, over blocks of `factor` cells."""
    classes, resolution = half_known("hospital_62m")
    found = find_frontiers(classes).cells
    cells = found[np.linspace(0, len(found) - 1, 150).astype(int)]
    reach = SENSOR_RANGE / resolution
    coarse = coarsen_classes(classes, factor)
    work = f"150 frontiers, 8 m, blocks of {factor * resolution:.2f} m"
    run: Callable[[], object] = partial(coarse_information_gains, coarse, cells, reach)
    if factor == 1:
        run = partial(information_gains, classes, None, cells, reach)
    return Case("information gain", work, 150, "floods", run)


CASES: list[Callable[[], Case]] = [
    distance_full,
    distance_update,
    weights_case,
    costs_open,
    costs_floor,
    path_case,
    frontiers_case,
    coarsen_case,
    refresh_case,
    partial(gains_case, 4),
    partial(gains_case, 2),
    partial(gains_case, 1),
    *sensing.CASES,
    *graphs.CASES,
]


def measure(run: Callable[[], object], seconds: float) -> tuple[float, float]:
    """Return the median time and least processor time [s] of calls made for about `seconds`."""
    run()  # compiles
    run()
    times: list[float] = []
    busy: list[float] = []
    end = time.perf_counter() + seconds
    while len(times) < 5 or time.perf_counter() < end:
        begin, begin_busy = time.perf_counter(), time.process_time()
        run()
        busy.append(time.process_time() - begin_busy)
        times.append(time.perf_counter() - begin)
    return float(np.median(times)), min(busy)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="How fast the kernels are.")
    parser.add_argument("--only", default="", help="only kernels whose name holds this word")
    parser.add_argument("--seconds", type=float, default=0.5, help="time for each row")
    options = parser.parse_args()
    print(f"{'kernel':<18} {'work':<42} {'rate':>18} {'median ms':>10} {'cpu ms':>9}")
    for prepare in CASES:
        case = prepare()
        if options.only not in case.kernel:
            continue
        median, cpu = measure(case.run, options.seconds)
        rate = f"{case.amount / cpu:,.0f} {case.unit}/s"
        print(
            f"{case.kernel:<18} {case.work:<42} {rate:>18} {1e3 * median:>10.3f} {1e3 * cpu:>9.3f}"
        )


if __name__ == "__main__":
    main()
