"""Pfingsthorn et al. 2007, section 4.2 and Figure 4: what map updates take, as cells or as scans.

One robot, then runs of a team of three, in an office building; laser and range as in the paper
(361 beams over 180 degrees, 20 m). Each run's updates are counted by the paper's formulas (see
`update_sizes`), and beside them stands what was truly put on the air. The robots of a team tell
each other, and there is no master; one robot tells a server that listens, or nobody would hear it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from expedition.experiments.experiment import (
    Claim,
    ExperimentOptions,
    ExperimentResult,
    Row,
    run_all,
)
from expedition.experiments.map_updates import MapUpdate, map_updates
from expedition.experiments.missions import Mission, run_mission
from expedition.experiments.plots import new_panels, save_figure
from expedition.experiments.scan_entropy import scan_bytes
from expedition.experiments.update_sizes import METHODS, UpdateSizes, update_sizes
from expedition.experiments.vote_counts import CellValue
from expedition.results.colours import ROBOTS
from expedition.results.record import load_record
from expedition.team import load_team

NAME = "rescue-bandwidth"
TEAM, WORLD, ROBOTS_OF_TEAM, TEAM_RUNS = "rescue", "office_rescue", 3, 2
LIDAR = {"beams": 361, "field_of_view_deg": 180.0, "range_max_m": 20.0}
RESOLUTION = 0.1  # [m], "the maps shown below use a map cell size of 0.1m"
# What carries the map between robots, and what tells only where one is.
MAP_TYPES = ("observations", "pose_set", "log_have", "log_want")
BEACON = "beacon"
OTHER_VALUES: tuple[CellValue, ...] = ("share", "known")
GRID_OVER_GRAPH, GRAPH_OVER_WIRE = 3.7, 8.0
_NAMES = dict(zip(METHODS, ("CellList", "BoundingBox", "BestGrid", "PoseGraph"), strict=True))


@dataclass(frozen=True)
class BandwidthSet:
    """One set of the table.

    Attributes:
        row: of the table.
        sizes: of all updates.
    """

    row: Row
    sizes: UpdateSizes


def run(options: ExperimentOptions) -> ExperimentResult:
    """Bytes of map updates, as grids and as pose graphs, against our wire (Figure 4)."""
    limit = 120.0 if options.quick else 1800.0
    runs = options.seeds or (1 if options.quick else TEAM_RUNS)
    teams = [(1, 1), *((ROBOTS_OF_TEAM, seed) for seed in range(1, runs + 1))]
    jobs = [
        rescue_mission(robots, seed, limit, options.out / f"set_{number}")
        for number, (robots, seed) in enumerate(teams, 1)
    ]
    sets = run_all(_measured, jobs, options.workers)
    for number, measured in enumerate(sets, 1):
        measured.row["set"] = number
    plot_sets(sets, options.out / f"{NAME}.png")
    rows = [measured.row for measured in sets]
    return ExperimentResult(NAME, rows, claims_of(rows))


def rescue_mission(robots: int, seed: int, limit: float, out: Path) -> Mission:
    """Return a mission of some robots of the team in the paper's building, with its laser."""
    mission = {"world": WORLD, "robots": robots, "seed": seed, "max_time_s": limit}
    settings = {"mission": mission, "body": {"lidar": LIDAR}, "server": {"enabled": robots == 1}}
    return Mission(TEAM, settings, str(out))


def _measured(mission: Mission) -> BandwidthSet:
    """Run a mission and count what its updates take."""
    summary = run_mission(mission)
    assert mission.out is not None
    record = load_record(Path(mission.out) / "parts")
    updates = map_updates(record.observations, record.repositionings)
    sizes = update_sizes(updates, RESOLUTION)
    row = row_of(summary, sizes, record.aired) | other_meanings(updates)
    row |= scan_bytes(record.observations, load_team(TEAM, mission.overrides).body.lidar.noise_m)
    return BandwidthSet(row, sizes)


def other_meanings(updates: list[MapUpdate]) -> Row:
    """Return what the improvement is if "a cell changes" means something else.

    See `update_sizes` for why, and for what the columns `improvement_VALUE` mean.
    """
    row: Row = {}
    for value in OTHER_VALUES:
        totals = update_sizes(updates, RESOLUTION, value).totals
        row[f"improvement_{value}"] = _ratio(totals["best_grid"], totals["pose_graph"])
    return row


def row_of(
    summary: Mapping[str, Any],
    sizes: UpdateSizes,
    aired: Mapping[str, Mapping[str, Mapping[str, int]]],
) -> Row:
    """Return a row of the table.

    Args:
        summary: the run's.
        sizes: of its updates.
        aired: robot -> message type -> `{count, bytes}` on the channel, once for a frame to all.

    Returns:
        `cell_list` to `pose_graph`: by the paper's formulas [bytes]; `wire`: what the team aired
        to tell of its map [bytes], frames and repetitions and all, `wire_each` of it for each
        observation; `beacons`: to tell where each robot is [bytes]; `observations`: how many were
        told, and `discarded`, how many were not worth telling; `changed_of_box`: what share of the
        cells in bounding boxes changed (the paper: 0.12, 0.28 and 0.19).
    """
    totals = sizes.totals
    return {
        "set": 0,
        "robots": len(summary["robots"]),
        "seed": summary["seed"],
        "ended": summary["ended"],
        "coverage": summary["coverage"],
        **totals,
        "improvement": _ratio(totals["best_grid"], totals["pose_graph"]),
        "wire": aired_bytes(aired, MAP_TYPES),
        "beacons": aired_bytes(aired, (BEACON,)),
        "wire_each": _ratio(aired_bytes(aired, MAP_TYPES), sizes.observations),
        "observations": sizes.observations,
        "discarded": sizes.discarded,
        "changed_of_box": _ratio(sizes.changed, sizes.boxed),
    }


def aired_bytes(
    aired: Mapping[str, Mapping[str, Mapping[str, int]]], types: tuple[str, ...]
) -> int:
    """Return how many bytes all members together put on the air in messages of some types."""
    return sum(sent[kind]["bytes"] for sent in aired.values() for kind in types if kind in sent)


def claims_of(rows: list[Row]) -> list[Claim]:
    """Return what the table says of the paper's claim and of ours.

    A robot without anybody to tell may air nothing; such a set says nothing of the wire.
    """
    grids = [_ratio(row["best_grid"], row["pose_graph"]) for row in rows]
    wires = [_ratio(row["pose_graph"], row["wire"]) for row in rows]
    on_air = [ratio for ratio in wires if ratio is not None]
    return [
        Claim(
            f"scans with poses take at least {GRID_OVER_GRAPH:g} times less than grids in every "
            "set (the paper: 3.7, 15.6 and 4.2)",
            bool(rows) and all(r is not None and r >= GRID_OVER_GRAPH for r in grids),
            _listed(grids),
        ),
        Claim(
            f"our wire takes at least {GRAPH_OVER_WIRE:g} times less than the paper's",
            bool(on_air) and min(on_air) >= GRAPH_OVER_WIRE,
            _listed(wires),
        ),
    ]


def _listed(ratios: list[float | None]) -> str:
    return ", ".join("-" if ratio is None else f"{ratio:.1f}" for ratio in ratios)


def _ratio(a: float, b: float) -> float | None:
    return a / b if b > 0 else None


def plot_sets(sets: list[BandwidthSet], path: Path) -> None:
    """Draw the sets in the manner of Figure 4, one a row.

    On the left what was sent up to each time by each method, on the right the size of each pose
    graph update over that of the same update of a grid; below 1 the pose graph is the smaller.
    """
    figure, panels = new_panels(len(sets), 2)
    for (left, right), measured in zip(panels, sets, strict=True):
        sizes, row = measured.sizes, measured.row
        robots = "one robot" if row["robots"] == 1 else f"{row['robots']} robots"
        left.set(title=f"Set {row['set']}: {robots}", xlabel="time [s]", ylabel="sent so far [MB]")
        for i, (method, name) in enumerate(_NAMES.items()):
            sums = np.cumsum(sizes.sizes[method]) / 1.0e6
            left.step(sizes.stamps, sums, where="post", label=name, color=ROBOTS[i])
        left.legend(frameon=False)
        grid, graph = sizes.sizes["best_grid"], sizes.sizes["pose_graph"]
        some = grid > 0
        right.set(title="PoseGraph / BestGrid", xlabel="time [s]", ylabel="ratio of an update")
        right.set_yscale("log")
        right.plot(sizes.stamps[some], graph[some] / grid[some], ".", markersize=3, color=ROBOTS[3])
        right.axhline(1.0, color="#6b7480", linewidth=1.0)
    save_figure(figure, path)
