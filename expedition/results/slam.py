"""What `expedition slam` leaves for its users, in the formats of the field."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from expedition.recordings.carmen_writer import carmen_lines
from expedition.recordings.recording import Recording, RecordingError
from expedition.results import exports
from expedition.results.files import as_json, write_atomically
from expedition.results.map_image import map_classes, map_png, pgm_bytes
from expedition.results.record import PoseGraphRecord, RobotRecord, RunRecord
from expedition.slam_run import SlamRun
from mapping.pose_graph import PoseGraph


def write_slam(folder: Path, recording: Recording, run: SlamRun, figures: dict[str, Any]) -> None:
    """Write the map, the trajectory, the corrected log and, if there is one, the pose graph.

    A laser that CARMEN's format cannot tell of gets no corrected log.

    Args:
        folder: made if it is not there.
        recording: the log.
        run: what was made of it.
        figures: for `summary.json`, which is written last.
    """
    track = np.column_stack((recording.stamps, run.poses))
    graph = run.estimator.pose_graph()
    record = RunRecord(
        estimator=str(figures["estimator"]),
        grid=run.estimator.occupancy(),
        robots=[RobotRecord("robot", track_map=track)],
        pose_graph=PoseGraphRecord() if graph is None else graph_record(graph),
    )
    files: list[tuple[str, Callable[[], bytes | str]]] = [
        ("trajectory.tum", lambda: exports.tum(track)),
        ("corrected.log", lambda: _corrected(recording, run)),
        ("map.pgm", lambda: pgm_bytes(map_classes(record))),
        ("map.yaml", lambda: exports.map_yaml(record)),
        ("map.png", lambda: map_png(record)),
    ]
    if graph is not None:
        files.append(("pose_graph.g2o", lambda: exports.g2o(record.pose_graph)))
    for name, make in files:
        content = make()
        if content:
            write_atomically(folder / name, content)
    write_atomically(folder / "summary.json", as_json(figures, indent=2) + "\n")


def graph_record(graph: PoseGraph) -> PoseGraphRecord:
    """Return the pose graph of one robot as a record."""
    edges = graph.edges
    ends = np.array([(0, edge.i, 0, edge.j) for edge in edges], dtype=np.int64)
    return PoseGraphRecord(
        {"robot": graph.poses.copy()},
        ends.reshape(-1, 4),
        np.array([edge.T_i_j.as_tuple() for edge in edges]).reshape(-1, 3),
        np.array([edge.information for edge in edges]).reshape(-1, 3, 3),
    )


def _corrected(recording: Recording, run: SlamRun) -> str:
    """Return the log with corrected poses; nothing for a laser the format cannot tell of."""
    try:
        return "".join(line + "\n" for line in carmen_lines(recording, run.poses))
    except RecordingError:
        return ""
