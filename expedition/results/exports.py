"""Result files in formats that other tools read: each function returns what goes into one file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import tomli_w

from expedition.graph_files.g2o import edge_line, vertex_line
from expedition.results.files import as_json, plain
from expedition.results.record import Event, PoseGraphRecord, RunRecord
from expedition.results.tracks import as_track, at_stamps
from mapping.geometry import Floats

OCCUPIED_THRESHOLD = 0.65
FREE_THRESHOLD = 0.196  # with 0.25 some readers take unknown (grey 205) for free
SCAN_ID_STEP = 1_000_000  # vertex ids of the robot at place i in order of ids start at i times this


def map_yaml(record: RunRecord, image: str = "map.pgm") -> str:
    """Return the ROS map_server description of the final map, its origin in the map frame [m]."""
    grid = record.grid
    if grid is None or grid.log_odds.size == 0:
        resolution, x, y = 0.05, 0.0, 0.0
    else:
        g = grid.geometry
        resolution, x, y = g.resolution, g.origin_x, g.origin_y
    return (
        f"image: {image}\n"
        "mode: trinary\n"
        f"resolution: {resolution!r}\n"
        f"origin: [{x!r}, {y!r}, 0.0]\n"
        "negate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESHOLD}\n"
        f"free_thresh: {FREE_THRESHOLD}\n"
    )


def tum(track: Floats) -> str:
    """Return a trajectory in TUM format: `stamp x y z qx qy qz qw`, one pose a line."""
    lines = []
    for stamp, x, y, theta in as_track(track).tolist():
        qz, qw = math.sin(0.5 * theta), math.cos(0.5 * theta)
        lines.append(f"{stamp:.6f} {x:.6f} {y:.6f} 0.000000 0 0 {qz:.9f} {qw:.9f}\n")
    return "".join(lines)


def truth_tum(track_map: Floats, track_world: Floats) -> str:
    """Return the true trajectory (world frame) at the very stamps of the estimated one."""
    return tum(at_stamps(track_world, as_track(track_map)[:, 0]))


def g2o(graph: PoseGraphRecord) -> str:
    """Return a pose graph in g2o format: VERTEX_SE2 and EDGE_SE2 with information matrices.

    Scan k of the robot at place i in order of ids has vertex id `i * SCAN_ID_STEP + k`. Edges come
    in the order in which they were measured. An edge that names a scan which is not there is left
    out.
    """
    chains = [graph.chains[robot] for robot in sorted(graph.chains)]
    lines = [
        vertex_line(i * SCAN_ID_STEP + k, pose)
        for i, chain in enumerate(chains)
        for k, pose in enumerate(chain.tolist())
    ]
    for ends, measured, information in zip(
        graph.ends.tolist(), graph.measured, graph.information, strict=True
    ):
        places = [(i, k) for i, k in (ends[:2], ends[2:]) if i < len(chains) and k < len(chains[i])]
        if len(places) == 2:
            a, b = (i * SCAN_ID_STEP + k for i, k in places)
            lines.append(edge_line(a, b, measured, information))
    return "".join(line + "\n" for line in lines)


def event_log(record: RunRecord) -> list[Event]:
    """Return all events of a run in order of time: tasks, faults, robots' notes and the rest."""
    events: list[Event] = [{"source": "run", **event} for event in record.events]
    events += [{"source": "server", "topic": "task", **event} for event in record.tasks]
    events += [{"source": "world", "event": "fault", **event} for event in record.faults]
    for robot in record.robots_in_order():
        events += [{"source": robot.id, **event} for event in robot.events]
    # Time first in each line; the sort is stable, so events of one instant keep their order.
    ordered = sorted(events, key=event_time)
    return [
        {"t_s": event_time(event), **{k: v for k, v in event.items() if k != "t_s"}}
        for event in ordered
    ]


def event_time(event: Mapping[str, Any]) -> float:
    """Return when an event happened [s]; 0 where it does not say."""
    t = event.get("t_s")
    return float(t) if isinstance(t, int | float) and math.isfinite(t) else 0.0


def events_jsonl(record: RunRecord) -> str:
    """Return the event log, one JSON object a line."""
    return "".join(as_json(event) + "\n" for event in event_log(record))


def config_toml(record: RunRecord) -> str:
    """Return the whole effective configuration with the run's own data in a table `run`.

    A value that is None is left out: TOML cannot say it, and reading the file gives the default.
    """
    run = {
        "team": record.team,
        "world": record.world,
        "strategy": record.strategy,
        "estimator": record.estimator,
        "seed": record.seed,
        "version": record.version,
        "robots": [robot.id for robot in record.robots_in_order()],
    }
    return tomli_w.dumps({**_without_none(plain(record.config)), "run": run})


def _without_none(value: Any) -> Any:
    """Return `value` without entries that are None."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_without_none(item) for item in value if item is not None]
    return value
