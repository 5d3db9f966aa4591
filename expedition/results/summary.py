"""`summary.json`: the key figures of a run, every field always there, null where unknown.

Beyond the agreed fields it holds what helps to understand a run: `reason`, `reachable_m2`,
`mapped_m2`, `T_world_map`, `time_unit`, `faults`, `bytes_links`, `links` (the radio's books by link
and message type), `aired` (what each member sent over the channel), `tasks` (counts of outcomes)
and `problems` (what could not be computed or written, and why). Only where victims were searched
for or reported it has `victims` and `victims_missed`, see `expedition.results.victims`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from expedition.results.digest import run_digest
from expedition.results.files import plain
from expedition.results.map_image import known_area, map_classes
from expedition.results.record import BODY_RADIUS, RobotRecord, RunRecord, TruthRecord
from expedition.results.team_frame import transform_to_world
from expedition.results.tracks import as_track, path_length
from expedition.results.victims import victim_section
from mapping.geometry import Floats
from sim_world.truth import (
    TOLERANCE,
    CoverageJudge,
    overlap,
    reachable_area,
    trajectory_rmse,
)

# A map of a continuous world never shows its very last cells: those along walls share a cell with
# the wall. There `t100_s` is the time to this coverage; in grid worlds it is the time to all cells.
COMPLETE = 0.999
LEVELS = {"t50_s": 0.5, "t90_s": 0.9, "t95_s": 0.95, "t99_s": 0.99, "t100_s": 1.0}


def summarise(record: RunRecord) -> dict[str, Any]:
    """Return the content of `summary.json`, made of plain JSON values.

    Never raises because of what a record holds: a section that cannot be computed is null, and
    `problems` says why.
    """
    problems = list(record.problems)
    judged = _attempt("the comparison with the truth", lambda: _judge(record), problems) or Judged()
    robots = [_robot(robot, judged) for robot in record.robots_in_order()]
    area = _attempt("the mapped area", lambda: _mapped_area(record), problems)
    summary: dict[str, Any] = {
        "team": record.team,
        "world": record.world,
        "strategy": record.strategy,
        "estimator": record.estimator,
        "seed": record.seed,
        "version": record.version,
        "ended": record.ended,
        "reason": record.reason,
        "sim_time_s": record.sim_time_s,
        "wall_time_s": record.wall_time_s,
        "real_time_factor": _ratio(record.sim_time_s, record.wall_time_s),
        "coverage": _coverage(record, judged),
        **_attempt("the coverage times", lambda: coverage_times(record), problems, no_times()),
        "time_unit": record.time_unit,
        "map": _map(record, judged),
        "mapped_m2": area,
        "reachable_m2": judged.reachable_m2,
        "T_world_map": judged.transform,
        "robots": robots,
        "overlap": _overlap(record),
        "bytes": _ledger(record.bytes),
        "bytes_links": _ledger(record.bytes_links),
        "links": record.links,
        "aired": record.aired,
        "tasks": _task_counts(record),
        "faults": record.faults,
        "digest": _attempt("the digest", lambda: run_digest(record.grid, record.robots), problems),
        "remaining": record.remaining,
        **_attempt("the search for victims", lambda: victim_section(record), problems, {}),
        "problems": problems,
    }
    return cast(dict[str, Any], plain(summary))


def time_to_coverage(timeline: Floats, level: float, steps: bool = False) -> float | None:
    """Return when coverage first reached `level`, or None if it never did.

    Args:
        timeline: (k, 2) time, share covered; rows in order of time.
        level: share wanted.
        steps: time goes in whole steps: take the first row that reaches the level. Otherwise the
            line between the two rows around the crossing is followed.
    """
    table = np.asarray(timeline, dtype=np.float64).reshape(-1, 2)
    reached = np.flatnonzero(table[:, 1] >= level - 1.0e-9)
    if len(reached) == 0:
        return None
    k = int(reached[0])
    t1, c1 = table[k].tolist()
    if steps or k == 0:
        return float(t1)
    t0, c0 = table[k - 1].tolist()
    return float(t0 + (t1 - t0) * (level - c0) / (c1 - c0)) if c1 > c0 else float(t1)


def coverage_times(record: RunRecord) -> dict[str, float | None]:
    """Return `t50_s` to `t100_s`; see `COMPLETE` for what the last one means."""
    steps = record.time_unit == "steps"
    return {
        name: time_to_coverage(
            record.coverage_timeline, level if steps else min(level, COMPLETE), steps
        )
        for name, level in LEVELS.items()
    }


def no_times() -> dict[str, float | None]:
    """Return the coverage times of a run of which nothing is known."""
    return dict.fromkeys(LEVELS)


@dataclass
class Judged:
    """What a comparison with the truth gives; all None where it gave nothing."""

    coverage: float | None = None
    precision: float | None = None
    recall: float | None = None
    free_error: float | None = None
    reachable_m2: float | None = None
    transform: dict[str, float] | None = None
    errors: dict[str, float | None] | None = None


def reachable_of(record: RunRecord, truth: TruthRecord) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return the reachable cells of the truth (rows, cols): what any of the bodies can reach."""
    if truth.reachable is not None:
        return truth.reachable
    reachable = np.zeros(truth.solid.shape, dtype=np.bool_)
    if truth.solid.size == 0:
        return reachable
    radii = dict.fromkeys(truth.starts, BODY_RADIUS)
    radii |= {robot.id: robot.radius_m for robot in record.robots}
    for radius in sorted({radii[robot] for robot in truth.starts}):
        starts = [truth.starts[robot] for robot in sorted(truth.starts) if radii[robot] == radius]
        reachable |= reachable_area(truth.solid, truth.geometry, np.vstack(starts), radius)
    return reachable


def _judge(record: RunRecord) -> Judged:
    """Compare map and trajectories with the truth, under one transform for the whole team."""
    judged = Judged()
    T_world_map = transform_to_world(record)
    if T_world_map is not None:
        x, y, theta = T_world_map.as_array().tolist()
        judged.transform = {"x_m": x, "y_m": y, "theta_rad": theta}
        judged.errors = trajectory_rmse(
            {r.id: as_track(r.track_map) for r in record.robots},
            {r.id: as_track(r.track_world) for r in record.robots},
            T_world_map,
        )
    truth, classes = record.truth, map_classes(record)
    if truth is None or truth.solid.size == 0:
        return judged
    judge = CoverageJudge(truth.solid, truth.geometry, reachable_of(record, truth))
    judged.reachable_m2 = judge.area
    if classes is None or record.grid is None or T_world_map is None:
        return judged
    geometry = record.grid.geometry
    scores = judge.scores(classes, geometry, T_world_map)
    judged.coverage = judge.coverage(classes, geometry, T_world_map)
    judged.precision = scores.precision_occupied
    judged.recall = scores.recall_occupied
    judged.free_error = scores.free_error
    return judged


def _coverage(record: RunRecord, judged: Judged) -> float | None:
    """Return the final coverage: of the final map if there is a truth, else the last one known."""
    if judged.coverage is not None:
        return judged.coverage
    if record.coverage is not None:
        return record.coverage
    timeline = record.coverage_timeline
    return float(timeline[-1, 1]) if timeline.ndim == 2 and len(timeline) else None


def _map(record: RunRecord, judged: Judged) -> dict[str, Any]:
    """Return the section `map`; scores hold to within `tolerance_m`, centre to centre."""
    return {
        "resolution_m": None if record.grid is None else record.grid.geometry.resolution,
        "precision_occupied": judged.precision,
        "recall_occupied": judged.recall,
        "free_error": judged.free_error,
        "tolerance_m": TOLERANCE,
        "digest": record.map_digest,
    }


def _robot(robot: RobotRecord, judged: Judged) -> dict[str, Any]:
    """Return one entry of the section `robots`."""
    driven = robot.track_map if robot.track_world is None else robot.track_world
    return {
        "id": robot.id,
        "ended": robot.ended or None,
        "path_m": path_length(driven) if robot.path_m is None else robot.path_m,
        "scans": robot.scans,
        "trajectory_rmse_m": (judged.errors or {}).get(robot.id),
        "bytes_sent": robot.bytes_sent,
        "bytes_received": robot.bytes_received,
        "map_digest": robot.map_digest,
    }


def _mapped_area(record: RunRecord) -> float:
    """Return the area [m2] that the final map shows as free."""
    return known_area(map_classes(record), record.grid.geometry if record.grid else None)


def _task_counts(record: RunRecord) -> dict[str, int]:
    """Return how often each event happened to a task; events without a task are of robots."""
    events = (str(e.get("event", "")) for e in record.tasks if e.get("task") is not None)
    return dict(sorted(Counter(events).items()))


def _overlap(record: RunRecord) -> float | None:
    """Return how much was seen by more than one robot, or None where nobody counted."""
    if record.overlap is not None:
        return record.overlap
    if record.union_clear is None or not record.single_clear:
        return None
    singles = [record.single_clear[robot] for robot in sorted(record.single_clear)]
    return overlap(singles, record.union_clear)


def _ledger(counts: dict[str, dict[str, int]]) -> dict[str, dict[str, int]]:
    """Return byte counts in order of names, each entry with both its fields."""
    return {
        name: {"count": int(c.get("count", 0)), "bytes": int(c.get("bytes", 0))}
        for name, c in sorted(counts.items())
    }


def _ratio(a: float, b: float) -> float | None:
    return a / b if b > 0.0 else None


def _attempt(
    what: str, compute: Callable[[], object], problems: list[str], otherwise: Any = None
) -> Any:
    """Return what `compute` gives; if it fails, `otherwise`, and note it in `problems`."""
    try:
        return compute()
    except Exception as error:  # results of a broken run must still be written
        problems.append(f"{what} failed: {type(error).__name__}: {error}")
        return otherwise
