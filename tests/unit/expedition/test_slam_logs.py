"""The table of estimators over logs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numba import config

from expedition.experiments import slam_logs
from expedition.experiments.experiment import ExperimentOptions
from expedition.team import UsageError
from tests.unit.expedition.recordings.logs import log


def options(tmp_path: Path, data: Path | None, quick: bool = False) -> ExperimentOptions:
    return ExperimentOptions(quick, 1, None, tmp_path / "out", data)


@pytest.mark.parametrize(
    ("folder", "why"), [(None, "--data DIR"), ("nowhere", "no folder"), ("empty", "no logs in")]
)
def test_without_logs_it_says_what_to_do(folder: str | None, why: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(UsageError, match=why):
        slam_logs.run(options(tmp_path, None if folder is None else tmp_path / folder))


@pytest.mark.skipif(config.DISABLE_JIT, reason="commands take plain Python too long")
def test_each_estimator_has_a_row_beside_what_is_published(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    (logs / "intel.log").write_text("\n".join(log(12)) + "\n", encoding="ascii")
    (logs / "intel.relations").write_text("1000.2 1000.6 0.4 0 0 0 0 0\n", encoding="ascii")
    (logs / "other.clf").write_text("\n".join(log(12)) + "\n", encoding="ascii")
    monkeypatch.setattr(slam_logs, "ESTIMATORS", {"scan_matching": ""})
    (tmp_path / "out").mkdir()
    result = slam_logs.run(options(tmp_path, tmp_path))
    ours = [row for row in result.rows if row["seconds"] is not None]
    assert [(row["log"], row["scans"]) for row in ours] == [("intel", 12), ("other", 12)]
    assert np.isfinite(ours[0]["translational_mean_m"]) and ours[1]["rotational_mean_deg"] is None
    assert len(result.rows) == 2 + len(slam_logs.PUBLISHED["intel"])
    assert [claim.claim[:5] for claim in result.claims] == ["intel"]
    assert (tmp_path / "out" / "slam-logs.png").exists()
    (logs / "bad.log").write_text("FLASER nonsense\n", encoding="ascii")
    with pytest.raises(UsageError, match=r"bad\.log"):
        slam_logs.run(options(tmp_path, tmp_path, quick=True))
