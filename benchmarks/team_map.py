"""How fast a team's map is drawn: `python -m benchmarks.team_map [--fill]`.

Four robots wander in an office of 40 m x 25 m at 0.05 m and take 500 scans each, of 180 beams all
around and a reach of 8 m. Prints processor times: of each scan as it comes, with the grid asked for
every time; of all at once; of the whole redraw of one robot's layer; of the redraw where the last
200 of 1,500 scans of one robot moved. And what the map takes in memory. With `--fill` the space
between beams counts as seen (`IntegrationSettings.fill_between`).
"""

from __future__ import annotations

import argparse
import tracemalloc
from collections.abc import Callable
from time import process_time

import numpy as np

from benchmarks.floors import RESOLUTION, SENSOR_RANGE, office, weights_of
from mapping.bucket_wave import UNREACHED
from mapping.geometry import Pose2
from mapping.grid import OBSTACLE, GridGeometry
from mapping.path_planning import cost_field, path_to
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings
from mapping.team_map import TeamMap
from sim_world.scene import GridScene

ROWS, COLS, BEAMS, STRIDE = 500, 800, 180, 10
AUTHORS, SCANS, LONG, MOVED = 4, 500, 1500, 200

Log = list[tuple[LaserScan, Pose2]]


def log_of(seed: int, scans: int) -> Log:
    """Return what a robot sees every half metre of a way from one random place to the next."""
    classes, rng = office(ROWS, COLS), np.random.default_rng(seed)
    weights = weights_of(classes, RESOLUTION)
    scene = GridScene(classes == OBSTACLE, GridGeometry(RESOLUTION, 0.0, 0.0, ROWS, COLS))
    bearings = np.linspace(-np.pi, np.pi, BEAMS, endpoint=False)
    field = cost_field(weights, (ROWS // 2, COLS * 6 // 10), RESOLUTION)
    free = np.argwhere(field.units != UNREACHED)
    log: Log = []
    while len(log) < scans:
        goal = free[rng.integers(len(free))]
        way = path_to(field, (int(goal[0]), int(goal[1])))[::-1]
        field = cost_field(weights, (int(goal[0]), int(goal[1])), RESOLUTION)
        for iy, ix in way[::STRIDE][: scans - len(log)]:
            x, y = (ix + rng.random()) * RESOLUTION, (iy + rng.random()) * RESOLUTION
            pose = Pose2(float(x), float(y), float(rng.uniform(-np.pi, np.pi)))
            ranges = scene.cast(pose, bearings, SENSOR_RANGE)
            noisy = (ranges + 0.01 * rng.standard_normal(BEAMS)).astype(np.float32)
            step = 2.0 * np.pi / BEAMS
            log.append((LaserScan(noisy, -np.pi, step, SENSOR_RANGE, float(len(log))), pose))
    return log


def timed(text: str, run: Callable[[], object], count: int = 1) -> None:
    """Print the processor time of a call, shared out among `count` pieces of work."""
    begin = process_time()
    run()
    print(f"{text:<58} {1e3 * (process_time() - begin) / count:>9.2f} ms")


def moved(log: Log, since: int) -> dict[int, Pose2]:
    """Return the poses of a log, those from one scan on moved a little."""
    shift = Pose2(0.04, -0.03, 0.01)
    return {n: pose @ shift if n >= since else pose for n, (_, pose) in enumerate(log)}


def observe_all(team: TeamMap[str], logs: dict[str, Log], ask: bool) -> None:
    """Let a team's scans come in turn, and ask for the grid after each, or not."""
    for number in range(SCANS):
        for author, log in logs.items():
            team.observe(author, number, *log[number])
            if ask:
                team.take_changes()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="How fast a team's map is drawn.")
    parser.add_argument("--fill", action="store_true", help="what lies between beams counts, too")
    settings = IntegrationSettings(fill_between=parser.parse_args().fill)
    logs = {f"robot{k + 1}": log_of(k, SCANS) for k in range(AUTHORS)}
    observe_all(TeamMap(RESOLUTION, settings), {"robot1": logs["robot1"]}, ask=True)  # compiles

    team = TeamMap[str](RESOLUTION, settings)
    timed("a scan comes, and the grid is asked for", lambda: observe_all(team, logs, True), 2000)
    tracemalloc.start()
    late = TeamMap[str](RESOLUTION, settings)
    observe_all(late, logs, ask=False)
    held = tracemalloc.get_traced_memory()[0]
    late.grid()
    print(f"cells and snapshots: {(tracemalloc.get_traced_memory()[0] - held) / 1e6:.1f} MB")
    tracemalloc.stop()
    assert np.array_equal(team.grid().log_odds, late.grid().log_odds)
    late = TeamMap[str](RESOLUTION, settings)
    observe_all(late, logs, ask=False)
    timed("2,000 scans drawn at once", late.grid)
    poses = moved(logs["robot2"], 0)
    timed("all 500 scans of a layer moved: told", lambda: team.place("robot2", poses))
    timed("all 500 scans of a layer moved: drawn", team.grid)
    timed(
        "told the same poses again, and drawn", lambda: (team.place("robot2", poses), team.grid())
    )
    team.observe("robot3", -1, *logs["robot3"][0])
    timed("a scan comes before the first of 500: drawn", team.grid)

    log = log_of(9, LONG)
    for since in (LONG - MOVED, 0):
        alone = TeamMap[str](RESOLUTION, settings)
        for number, (scan, pose) in enumerate(log):
            alone.observe("robot1", number, scan, pose)
        alone.grid()
        alone.place("robot1", moved(log, since))
        timed(f"of 1,500 scans the last {LONG - since:,} moved: drawn", alone.grid)


if __name__ == "__main__":
    main()
