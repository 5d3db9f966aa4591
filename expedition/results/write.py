"""Writing everything that a run leaves for its users, come what may."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from expedition.results import exports
from expedition.results.files import as_json, file_stem, write_atomically
from expedition.results.map_image import map_classes, map_png, pgm_bytes
from expedition.results.record import RobotRecord, RunRecord
from expedition.results.report import report_html
from expedition.results.summary import summarise


def write_results(record: RunRecord, out_dir: Path) -> dict[str, Any]:
    """Write all result files of a run into `out_dir`; return the summary.

    A file that cannot be made does not keep the others from being written: the summary names it in
    `problems`. `summary.json` is written last, so whoever sees it sees all the rest.

    Raises:
        OSError: not even `summary.json` can be written.
    """
    summary = summarise(record)
    for name, make in _files(record, summary):
        try:
            write_atomically(out_dir / name, make())
        except Exception as error:  # one bad file must not cost the user all the others
            summary["problems"].append(f"{name} failed: {type(error).__name__}: {error}")
    write_atomically(out_dir / "summary.json", as_json(summary, indent=2) + "\n")
    return summary


def _files(
    record: RunRecord, summary: dict[str, Any]
) -> list[tuple[str, Callable[[], bytes | str]]]:
    """Return the name of each result file and what makes its content."""
    files: list[tuple[str, Callable[[], bytes | str]]] = [
        ("config.toml", lambda: exports.config_toml(record)),
        ("events.jsonl", lambda: exports.events_jsonl(record)),
        ("map.pgm", lambda: pgm_bytes(map_classes(record))),
        ("map.yaml", lambda: exports.map_yaml(record)),
        ("pose_graph.g2o", lambda: exports.g2o(record.pose_graph)),
    ]
    used: set[str] = set()
    for robot in record.robots_in_order():
        stem = file_stem(robot.id)
        while stem in used:
            stem += "-2"
        used.add(stem)
        files.extend(_trajectories(robot, f"{stem}.tum"))
    files += [
        ("map.png", lambda: map_png(record)),
        ("report.html", lambda: report_html(record, summary)),
    ]
    return files


def _trajectories(robot: RobotRecord, name: str) -> list[tuple[str, Callable[[], bytes | str]]]:
    """Return the trajectory files of one robot: the estimate and, if known, the truth."""
    files: list[tuple[str, Callable[[], bytes | str]]] = [
        (f"trajectories/{name}", lambda: exports.tum(robot.track_map))
    ]
    if robot.track_world is not None:
        world = robot.track_world
        files.append((f"truth/{name}", lambda: exports.truth_tum(robot.track_map, world)))
    return files
