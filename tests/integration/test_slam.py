"""`expedition slam`: a recorded log in, figures and files out."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from expedition.recordings.carmen_writer import write_carmen
from expedition.recordings.read import read_recording
from expedition.recordings.recording import Reading, Recording
from mapping.geometry import IDENTITY
from robot_agent.estimators import ESTIMATORS
from tests.integration.command_line import Outcome
from tests.unit.tours import around

Cli = Callable[..., Outcome]
FRONT = (-0.5 * math.pi, math.radians(1.0), 180)


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A CARMEN log of a tour round a block, and the true relations between every fifth stop."""
    monkeypatch.chdir(tmp_path)
    tour = around(0.4, seed=5, bearings=FRONT)
    wheels, readings = IDENTITY, []
    for move, scan in zip(tour.moves, tour.scans, strict=True):
        wheels = wheels @ move
        readings.append(Reading(scan, wheels))
    path = tmp_path / "tour.log"
    write_carmen(path, Recording(readings), np.zeros((len(readings), 3)))
    with (tmp_path / "tour.relations").open("w", encoding="ascii") as relations:
        for k in range(0, len(tour.truth) - 5, 5):
            x, y, theta = (tour.truth[k].inverse() @ tour.truth[k + 5]).as_tuple()
            relations.write(f"{k} {k + 5} {x} {y} 0 0 0 {theta}\n")
    return path


@pytest.mark.parametrize("estimator", sorted(ESTIMATORS))
def test_a_log_gives_a_map_a_trajectory_and_its_errors(
    estimator: str, log: Path, cli: Cli, tmp_path: Path
) -> None:
    words = ("--estimator", estimator, "--relations", "tour.relations", "--out", "out", "--json")
    outcome = cli("slam", str(log), *words)
    assert outcome.status == 0 and outcome.stderr == ""
    figures = json.loads(outcome.stdout)
    assert figures["scans"] == len(read_recording(log).readings)
    assert figures["skipped"] == figures["relations_missing"] == 0
    assert figures["translational_error_m"]["mean"] < 0.03
    assert figures["rotational_error_deg"]["mean"] < 1.0
    assert figures["seconds"] > 0.0 and figures["peak_rss_mb"] > 10.0
    written = {path.name for path in (tmp_path / "out").iterdir()}
    expected = {
        "corrected.log", "map.pgm", "map.png", "map.yaml", "summary.json", "trajectory.tum",
    }  # fmt: skip
    assert written - {"pose_graph.g2o"} == expected
    assert ("pose_graph.g2o" in written) == (estimator == "graph")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary == {"log": "tour.log", "estimator": estimator, **figures}
    again = read_recording(tmp_path / "out" / "corrected.log")
    assert len(again.readings) == figures["scans"]


def test_people_are_told_in_three_lines_where_the_map_is(log: Path, cli: Cli) -> None:
    damaged = log.read_text(encoding="ascii").replace("FLASER 180", "FLASER 999", 1)
    log.write_text(damaged, encoding="ascii")
    outcome = cli("slam", str(log), "--relations", "tour.relations")
    assert outcome.status == 0
    scans, skipped, error, where = outcome.stdout.splitlines()
    assert " scans in " in scans and skipped.startswith("1 lines skipped, the first: line ")
    assert error.startswith("error 0.0") and error.endswith("relations")
    assert where == f"map and trajectory: {Path('runs') / 'slam-tour'}"


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("nowhere.log",), "nowhere.log"),
        (("tour.relations",), "tour.relations"),
        (("tour.log", "--estimator", "guessing"), "choose one of graph"),
        (("tour.log", "--relations", "nowhere"), "nowhere"),
        (("tour.log", "--relations", "tour.log"), "t1 t2 x y z roll pitch yaw"),
        (("tour.log", "--max-range", "0"), "--max-range"),
        ((), "expedition slam --help"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(
    words: tuple[str, ...], why: str, log: Path, cli: Cli
) -> None:
    assert cli("slam", *words).wrong_use(why)
