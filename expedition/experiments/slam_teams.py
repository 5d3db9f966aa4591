"""Teams whose starts are known only roughly: how true their trajectories and loop closures are.

Three robots are told their starts to within 1 m and 20 degrees. What the server holds together by
comparing scans with submaps, of one robot and between robots, is judged by where the robots truly
were: a comparison that is off by more than half a metre or 5 degrees, and by more than seven of
the standard deviations that it claims, and is still in the graph when the mission is over, is a
wrong closure accepted. (Along a corridor a comparison claims nothing, and may be off as it likes.)
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from expedition.experiments.experiment import (
    Claim,
    ExperimentOptions,
    ExperimentResult,
    Row,
    run_all,
)
from expedition.experiments.missions import Mission, run_mission
from expedition.experiments.plots import new_figure, save_figure
from expedition.results.record import PoseGraphRecord, RobotRecord, load_record
from expedition.results.tracks import at_stamps
from mapping.geometry import Floats, pose_from

NAME = "slam-teams"
SEEDS = 10
# A real floor plan besides the shipped floor, where the data are given, and where to start on it.
FLOOR, STARTS = "hospital_62m", ((2.0, 12.5, 0.0), (2.0, 11.7, 0.0), (2.0, 13.3, 0.0))
RMSE_MOST = 0.10  # [m]
WRONG, WRONG_TURN, WRONG_SIGMAS = 0.5, math.radians(5.0), 7.0  # [m], [rad]


def run(options: ExperimentOptions) -> ExperimentResult:
    """Three robots with starts known to 1 m and 20 degrees: trajectories and loop closures."""
    seeds = options.seeds or (1 if options.quick else SEEDS)
    limit = 100.0 if options.quick else 1800.0
    jobs = [
        Mission("auction", {"mission": {**world, "seed": seed, "max_time_s": limit}}, str(folder))
        for name, world in _worlds(options.data).items()
        for seed in range(1, seeds + 1)
        for folder in [options.out / f"{name}-{seed}"]
    ]
    rows = run_all(_judged, jobs, options.workers)
    figure, axes = new_figure("Starts known to 1 m and 20 degrees", "", "largest error [m]")
    axes.bar([f"{row['world'][:8]} {row['seed']}" for row in rows], [_rmse(row) for row in rows])
    axes.tick_params(axis="x", rotation=90)
    save_figure(figure, options.out / f"{NAME}.png")
    largest, wrong = max(map(_rmse, rows)), sum(row["wrong"] for row in rows)
    claims = [
        Claim(
            f"every trajectory errs by {RMSE_MOST:.2f} m at most",
            largest <= RMSE_MOST,
            f"at most {largest:.3f} m",
        ),
        Claim(
            "no wrong closure is accepted",
            wrong == 0,
            f"{wrong} of {sum(row['closures'] for row in rows)}",
        ),
    ]
    return ExperimentResult(NAME, rows, claims)


def _worlds(data: Path | None) -> dict[str, dict[str, object]]:
    """Return what is set of missions, by world."""
    worlds: dict[str, dict[str, object]] = {"hospital": {"world": "hospital", "robots": 3}}
    if data is not None:
        plan = str(data / "maps" / f"{FLOOR}.yaml")
        worlds[FLOOR] = {"world": plan, "robots": 3, "starts": STARTS}
    return worlds


def _judged(mission: Mission) -> Row:
    """Run a mission and return its row of the table."""
    summary = run_mission(mission)
    assert mission.out is not None
    record = load_record(Path(mission.out) / "parts")
    graph = record.pose_graph
    errors = closure_errors(graph, {robot.id: robot for robot in record.robots})
    between = graph.ends[graph.doubted][:, 0] != graph.ends[graph.doubted][:, 2]
    return {
        "world": summary["world"],
        "seed": summary["seed"],
        "ended": summary["ended"],
        "coverage": summary["coverage"],
        "rmse_max_m": max(robot["trajectory_rmse_m"] or 0.0 for robot in summary["robots"]),
        "closures": len(errors),
        "between_robots": int(between.sum()),
        "wrong": int(_wrong(errors).sum()),
        "worst_m": float(errors[:, 0].max(initial=0.0)),
        "worst_sigmas": float(errors[:, 2].max(initial=0.0)),
    }


def closure_errors(graph: PoseGraphRecord, robots: dict[str, RobotRecord]) -> Floats:
    """Return how far off each comparison of a graph is, (n, 3) [m], [rad], [sigmas].

    Args:
        graph: with stamps.
        robots: by name, with their true trajectories.

    Returns:
        The third is the error in standard deviations of what the comparison claims to know.
    """
    true = [
        at_stamps(robots[name].track_world, graph.stamps[name])[:, 1:]  # type: ignore[arg-type]
        for name in sorted(graph.chains)
    ]
    errors = []
    for (a, i, b, j), measured, information in zip(
        graph.ends[graph.doubted].tolist(),
        graph.measured[graph.doubted],
        graph.information[graph.doubted],
        strict=True,
    ):
        T_i_j = pose_from(true[a][i]).inverse() @ pose_from(true[b][j])
        off = pose_from(measured).inverse() @ T_i_j
        error = off.as_array()
        sigmas = math.sqrt(max(float(error @ information @ error), 0.0))
        errors.append((math.hypot(off.x, off.y), abs(off.theta), sigmas))
    return np.array(errors).reshape(-1, 3)


def _wrong(errors: Floats) -> npt.NDArray[np.bool_]:
    """Return which comparisons (n,) are wrong, by their errors (n, 3)."""
    far: npt.NDArray[np.bool_] = (errors[:, 0] > WRONG) | (errors[:, 1] > WRONG_TURN)
    return far & (errors[:, 2] > WRONG_SIGMAS)


def _rmse(row: Row) -> float:
    return float(row["rmse_max_m"])
