"""Everything a finished run left behind; all result files are made from it and nothing else.

Each process of a run saves what it alone knows as one part, a file `parts/NAME.npz`, and
`load_record` puts the parts together: the end of one process loses only what that process knew.
Times are mission seconds, or steps in grid worlds; `map` is the team's frame, `world` the truth's.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from expedition.results.packing import UNREADABLE, merge, read_tree, write_tree
from mapping.geometry import Floats
from mapping.grid import GridGeometry, OccupancyGrid

Event = dict[str, Any]
BODY_RADIUS = 0.25  # [m] of a robot that does not say, as in `protocol.body`


def no_rows(columns: int) -> Floats:
    """Return an empty table (0, columns)."""
    return np.empty((0, columns))


@dataclass
class RobotRecord:
    """What one robot left behind.

    Attributes:
        id: its name.
        ended: how its own run ended: `finished`, `lost`, `killed`, `collided`, ...
        radius_m: radius of its body.
        track_map: (n, 4) stamp [s], x, y [m], theta [rad]: its corrected trajectory as the team
            estimates it, map frame.
        track_world: (m, 4) likewise, the true trajectory in the world frame; None where no truth
            exists.
        scans: sweeps it took.
        path_m: driven way; None: take it from the tracks.
        bytes_sent: what it sent over the radio.
        bytes_received: what reached it over the radio.
        map_digest: digest of its own view of the team's map, when it holds one.
        events: what it noted, each `{t_s, event, ...}`.
    """

    id: str
    ended: str = ""
    radius_m: float = BODY_RADIUS
    track_map: Floats = field(default_factory=lambda: no_rows(4))
    track_world: Floats | None = None
    scans: int = 0
    path_m: float | None = None
    bytes_sent: int | None = None
    bytes_received: int | None = None
    map_digest: str | None = None
    events: list[Event] = field(default_factory=list)


@dataclass
class PoseGraphRecord:
    """The final pose graph: the scans of each robot in order, and what was measured between them.

    Attributes:
        chains: by robot, (k, 3) corrected poses x, y, theta [m, m, rad] of its scans, map frame.
        ends: (E, 4) of each edge, twice: which robot, in order of ids, and which of its scans.
        measured: (E, 3) x, y, theta of the second scan in the first one's frame.
        information: (E, 3, 3) of the errors of that, in the second one's frame; may be singular.
        stamps: by robot, (k,) [s] when its scans were taken; empty where that is not told.
        doubted: (E,) bool, comparisons of what was seen, which may be wrong.
    """

    chains: dict[str, Floats] = field(default_factory=dict)
    ends: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 4), dtype=np.int64))
    measured: Floats = field(default_factory=lambda: no_rows(3))
    information: Floats = field(default_factory=lambda: np.empty((0, 3, 3)))
    stamps: dict[str, Floats] = field(default_factory=dict)
    doubted: npt.NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=np.bool_))


@dataclass
class TruthRecord:
    """The world as it truly is.

    Attributes:
        geometry: where its cells are, world frame.
        solid: (rows, cols) bool.
        starts: robot -> (3,) true start x, y, theta [m, m, rad], world frame.
        reachable: (rows, cols) bool, what the team should map; None: from starts and bodies.
        victims: id -> (2,) x, y [m] of those that the team should find, world frame.
    """

    geometry: GridGeometry
    solid: npt.NDArray[np.bool_]
    starts: dict[str, Floats] = field(default_factory=dict)
    reachable: npt.NDArray[np.bool_] | None = None
    victims: dict[str, Floats] = field(default_factory=dict)


@dataclass
class RunRecord:
    """Everything a finished run left behind.

    Attributes:
        ended: `explored | time_limit | coverage | operator | failed`.
        reason: one sentence on why it ended so.
        time_unit: `s`, or `steps` in grid worlds, where the timeline counts steps.
        grid: the final map of the team, map frame; None when there was none yet.
        p_obstacle: occupied in this map means a probability above this.
        p_clear: free in this map means a probability below this.
        map_digest: digest of the team's map, made as the robots make theirs.
        robots: one record each; results sort them by id.
        coverage_timeline: (k, 2) time [s or steps], share of the reachable area that is covered.
        coverage: the final share, when the truth's grid is not in the record.
        single_clear: robot -> reachable cells that its own sensing covered.
        union_clear: reachable cells that at least one robot covered.
        overlap: computed by whoever knows the single coverages better than these two counts.
        tasks: events of tasks, each `{t_s, event, robot, task, kind, goal: [x, y], reason}`.
        events: everything else worth a line in the event log, each `{t_s, event, ...}`.
        faults: scripted or real: `{t_s, robot, kind, ...}`.
        bytes: message type -> `{count, bytes}` on the radio.
        bytes_links: `A>B` -> `{count, bytes}`, what was sent.
        links: `A>B` -> `sent`, `duplicated`, `delivered`, `lost` and `queued`, each `{count,
            bytes}`, and `types`: message type -> the same, without what is empty.
        aired: robot or server -> message type -> `{count, bytes}` on the channel, once for a frame
            to everyone.
        remaining: every frontier left, each `{x_m, y_m, length_m, gain_m2, reason}`, map frame.
        victims: whom the team found, each `{x_m, y_m, seen_by, t_s, sightings}`, map frame: who saw
            it first and when, and how often it was seen. One part alone may tell them.
        observations: of a team that shares them, all in order of time, each `{t_s, robot, number,
            ranges, pose, bearing_start, bearing_step, range_max}`, the laser's pose as first told.
        repositionings: when a robot told all its poses anew, each `{t_s, robot, poses}`.
        truth: None on a real run.
        config: the whole effective configuration.
        problems: what could not be read or computed, one sentence each.
    """

    team: str = ""
    world: str = ""
    strategy: str = ""
    estimator: str = ""
    seed: int = 0
    version: str = ""
    ended: str = "failed"
    reason: str = ""
    sim_time_s: float = 0.0
    wall_time_s: float = 0.0
    time_unit: str = "s"
    grid: OccupancyGrid | None = None
    p_obstacle: float = 0.65
    p_clear: float = 0.35
    map_digest: str | None = None
    robots: list[RobotRecord] = field(default_factory=list)
    coverage_timeline: Floats = field(default_factory=lambda: no_rows(2))
    coverage: float | None = None
    single_clear: dict[str, int] = field(default_factory=dict)
    union_clear: int | None = None
    overlap: float | None = None
    tasks: list[Event] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    faults: list[Event] = field(default_factory=list)
    bytes: dict[str, dict[str, int]] = field(default_factory=dict)
    bytes_links: dict[str, dict[str, int]] = field(default_factory=dict)
    links: dict[str, dict[str, Any]] = field(default_factory=dict)
    aired: dict[str, dict[str, dict[str, int]]] = field(default_factory=dict)
    remaining: list[Event] = field(default_factory=list)
    victims: list[Event] = field(default_factory=list)
    observations: list[Event] = field(default_factory=list)
    repositionings: list[Event] = field(default_factory=list)
    pose_graph: PoseGraphRecord = field(default_factory=PoseGraphRecord)
    truth: TruthRecord | None = None
    config: dict[str, Any] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)

    def robots_in_order(self) -> list[RobotRecord]:
        """Return the robots sorted by id, so that no result depends on who reported first."""
        return sorted(self.robots, key=lambda robot: robot.id)


def place_of(entry: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return where an entry of a record is, (x, y) [m], or None if it does not say."""
    x, y = entry.get("x_m"), entry.get("y_m")
    if isinstance(x, int | float) and isinstance(y, int | float):
        return (float(x), float(y)) if math.isfinite(x) and math.isfinite(y) else None
    return None


def save_record_part(folder: Path, name: str, part: Mapping[str, object]) -> Path:
    """Save what one process knows of a run as `folder/NAME.npz`; return its path.

    Args:
        folder: the parts folder, made when missing.
        name: who saves; a later part of the same name replaces the earlier one.
        part: any fields of `RunRecord`. `robots` may be a mapping robot -> some fields of
            `RobotRecord`, so that several processes can each add what they know of a robot.

    Raises:
        ValueError: `part` names a field that `RunRecord` does not have.
        OSError: the file cannot be written.
    """
    unknown = sorted(set(part) - {f.name for f in fields(RunRecord)})
    if unknown:
        raise ValueError(f"a run's record has no {', '.join(unknown)}")
    robots = part.get("robots")
    if isinstance(robots, list):
        part = {**part, "robots": {robot.id: robot for robot in robots}}
    path = folder / f"{name}.npz"
    write_tree(path, part)
    return path


def save_record(folder: Path, record: RunRecord, name: str = "record") -> Path:
    """Save a whole record as one part; return its path."""
    return save_record_part(
        folder, name, {f.name: getattr(record, f.name) for f in fields(RunRecord)}
    )


def load_record(folder: Path) -> RunRecord:
    """Return the run put together from all parts in `folder`, taken in order of their names.

    Lists of events are joined, mappings and robots merged; of a value that two parts give, the
    later one counts. A part that cannot be read is named in `problems` and left out; a folder
    without parts gives an empty record.
    """
    merged: dict[str, Any] = {"problems": []}
    for path in sorted(folder.glob("*.npz")):
        try:
            part = read_tree(path)
        except UNREADABLE as error:
            merged["problems"].append(f"the part {path.name} cannot be read: {error}")
            continue
        for key, value in part.items():
            merged[key] = merge(merged.get(key), value)
    return _build_record(merged)


def _build_record(merged: dict[str, Any]) -> RunRecord:
    """Return the record for merged fields; a field of the wrong make is named and left out."""
    builders = {
        "grid": _build_grid,
        "robots": _build_robots,
        "pose_graph": _build_pose_graph,
        "truth": _build_truth,
    }
    known = {f.name for f in fields(RunRecord)}
    values: dict[str, Any] = {}
    for key in sorted(known & set(merged)):
        if merged[key] is None:
            continue
        try:
            values[key] = builders[key](merged[key]) if key in builders else merged[key]
        except (TypeError, ValueError, KeyError, AttributeError) as error:
            merged["problems"].append(f"{key} cannot be read: {error}")
    values["problems"] = merged["problems"]
    return RunRecord(**values)


def _build_grid(tree: dict[str, Any]) -> OccupancyGrid:
    return OccupancyGrid(GridGeometry(**tree["geometry"]), tree["log_odds"])


def _build_robots(tree: dict[str, Any] | list[Any]) -> list[RobotRecord]:
    robots: Iterable[tuple[str, dict[str, Any]]] = tree.items() if isinstance(tree, dict) else ()
    known = {f.name for f in fields(RobotRecord)} - {"id"}
    return [
        RobotRecord(id, **{k: v for k, v in robot.items() if k in known and v is not None})
        for id, robot in sorted(robots)
    ]


def _build_pose_graph(tree: dict[str, Any]) -> PoseGraphRecord:
    return PoseGraphRecord(**tree)


def _build_truth(tree: dict[str, Any]) -> TruthRecord:
    return TruthRecord(
        GridGeometry(**tree["geometry"]),
        tree["solid"],
        tree.get("starts", {}),
        tree.get("reachable"),
        tree.get("victims", {}),
    )
