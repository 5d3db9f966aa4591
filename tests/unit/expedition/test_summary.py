import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from expedition.results import summary as module
from expedition.results import team_frame
from expedition.results.record import RunRecord, TruthRecord
from expedition.results.summary import (
    coverage_times,
    reachable_of,
    summarise,
    time_to_coverage,
)
from expedition.results.team_frame import transform_to_world
from mapping.grid import GridGeometry
from tests.unit.expedition.records import T_WORLD_MAP, full_record, nasty_records

FIELDS = {
    "team", "world", "strategy", "estimator", "seed", "version", "ended", "sim_time_s",
    "wall_time_s", "real_time_factor", "coverage", "t50_s", "t90_s", "t95_s", "t99_s", "t100_s",
    "map", "robots", "overlap", "bytes", "digest", "remaining",
}  # fmt: skip
MAP_FIELDS = {"resolution_m", "precision_occupied", "recall_occupied", "free_error", "tolerance_m"}
ROBOT_FIELDS = {
    "id", "ended", "path_m", "scans", "trajectory_rmse_m", "bytes_sent", "bytes_received",
    "map_digest",
}  # fmt: skip


def test_everything_known() -> None:
    summary = summarise(full_record())
    assert summary["problems"] == []
    assert summary["coverage"] > 0.99
    assert summary["map"]["precision_occupied"] == 1.0
    assert summary["map"]["recall_occupied"] == 1.0
    assert summary["map"]["free_error"] == 0.0
    assert summary["map"]["resolution_m"] == 0.05
    assert summary["real_time_factor"] == 16.0
    assert summary["T_world_map"]["x_m"] == pytest.approx(T_WORLD_MAP.x)
    assert summary["T_world_map"]["theta_rad"] == pytest.approx(T_WORLD_MAP.theta)
    assert summary["overlap"] == pytest.approx(0.3)
    assert [robot["id"] for robot in summary["robots"]] == ["ada", "bob"]
    ada, bob = summary["robots"]
    assert ada["trajectory_rmse_m"] == pytest.approx(0.0, abs=1e-9)
    assert (ada["path_m"], bob["path_m"]) == (4.5, pytest.approx(2.5))
    assert summary["reachable_m2"] == pytest.approx(28 * 38 * 0.01, abs=0.2)
    assert summary["mapped_m2"] > 10.0
    assert summary["tasks"] == {"awarded": 3, "failed": 1, "terminated": 1}
    assert list(summary["bytes"]) == ["bid", "scan_report"]
    assert len(summary["digest"]) == 64


def test_one_transform_for_the_whole_team() -> None:
    record = full_record()
    record.robots[0].track_map[:, 1] += 1.0  # one robot is a metre off: both must show it
    ada, bob = summarise(record)["robots"]
    assert ada["trajectory_rmse_m"] > 0.2
    assert bob["trajectory_rmse_m"] > 0.2


@pytest.mark.parametrize("name", nasty_records())
def test_no_field_is_ever_missing(name: str) -> None:
    summary = summarise(nasty_records()[name])
    json.dumps(summary, allow_nan=False)
    assert set(summary) >= FIELDS
    assert set(summary["map"]) >= MAP_FIELDS
    assert all(set(robot) == ROBOT_FIELDS for robot in summary["robots"])
    assert summary["problems"] == []


def test_what_is_not_known_is_null() -> None:
    summary = summarise(nasty_records()["no truth"])
    assert summary["T_world_map"] is None
    assert summary["reachable_m2"] is None
    assert summary["map"]["precision_occupied"] is None
    assert summary["robots"][0]["trajectory_rmse_m"] is None
    assert summary["coverage"] == 1.0  # the last of the time line
    empty = summarise(RunRecord())
    for key in ("coverage", "t50_s", "overlap", "real_time_factor"):
        assert empty[key] is None


def test_coverage_comes_from_the_best_source() -> None:
    record = RunRecord(coverage=0.7, coverage_timeline=np.array([[0.0, 0.6]]))
    assert summarise(record)["coverage"] == 0.7
    record.coverage = None
    assert summarise(record)["coverage"] == 0.6


def test_overlap_computed_elsewhere_counts() -> None:
    record = full_record()
    record.overlap = 0.25
    assert summarise(record)["overlap"] == 0.25


def test_a_section_that_fails_is_null_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("no luck")

    monkeypatch.setattr(team_frame, "fit_team", broken)
    monkeypatch.setattr(module, "run_digest", broken)
    record = full_record()
    record.coverage_timeline = np.zeros(3)
    summary = summarise(record)
    assert len(summary["problems"]) == 3
    assert "no luck" in summary["problems"][0]
    assert summary["digest"] is None
    assert summary["t50_s"] is None
    assert summary["coverage"] is None
    assert summary["team"] == "auction"


def test_times_are_interpolated() -> None:
    times = coverage_times(full_record())
    assert times["t50_s"] == 2.0
    assert times["t90_s"] == 4.0
    assert times["t95_s"] == pytest.approx(4.0 + 2.0 * 0.05 / 0.0995)
    assert times["t100_s"] == pytest.approx(4.0 + 2.0 * 0.099 / 0.0995)


def test_grid_worlds_count_whole_steps_and_want_every_cell() -> None:
    times = coverage_times(nasty_records()["steps"])
    assert times["t95_s"] == 6.0
    assert times["t100_s"] == 8.0


def test_edges_of_the_timeline() -> None:
    assert time_to_coverage(np.empty((0, 2)), 0.5) is None
    assert time_to_coverage(np.array([[3.0, 0.6]]), 0.5) == 3.0
    assert time_to_coverage(np.array([[0.0, 0.2], [1.0, 0.4]]), 0.5) is None
    jump = np.array([[0.0, 0.5 - 5e-10], [1.0, 0.5 - 5e-10]])
    assert time_to_coverage(jump, 0.5) == 0.0
    assert time_to_coverage(np.array([[0.0, np.nan], [1.0, 0.5]]), 0.5) == 1.0


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_higher_levels_are_reached_later(shares: list[float]) -> None:
    timeline = np.column_stack((np.arange(len(shares)), shares))
    times = [time_to_coverage(timeline, level) for level in (0.5, 0.9, 0.95, 0.99)]
    known = [math.inf if t is None else t for t in times]
    assert known == sorted(known)


def test_reachable_area_of_a_mixed_team() -> None:
    record = full_record()
    truth = record.truth
    assert truth is not None
    truth.solid[:, 20] = True
    truth.solid[14:17, 20] = False  # 0.3 m: only a small body gets through
    record.robots[0].radius_m, record.robots[1].radius_m = 0.2, 0.2
    both_large = reachable_of(record, truth).sum()
    record.robots[0].radius_m = 0.1
    assert reachable_of(record, truth).sum() > 1.5 * both_large
    truth.reachable = np.zeros_like(truth.solid)
    assert reachable_of(record, truth).sum() == 0
    no_world = TruthRecord(GridGeometry(0.1, 0.0, 0.0, 0, 0), np.zeros((0, 0), dtype=bool))
    assert reachable_of(record, no_world).shape == (0, 0)


def test_no_transform_without_common_tracks() -> None:
    assert transform_to_world(RunRecord()) is None
    assert transform_to_world(nasty_records()["empty tracks"]) is None
