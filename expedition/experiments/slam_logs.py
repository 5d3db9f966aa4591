"""Every estimator over real robots' logs: error, speed and memory, beside published figures.

The error is that of Kuemmerle et al. 2009, "On measuring the accuracy of SLAM algorithms": the mean
over relations, true relative poses that people checked by hand. A log has them in a file of its
name that ends in `.relations`; without it only speed and memory are told.

Published: Kuemmerle et al. 2009, Table 1, and Hess, Kohler, Rapp & Andor 2016, "Real-time loop
closure in 2D LIDAR SLAM", Tables IV and V.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from expedition.experiments.experiment import (
    Claim,
    ExperimentOptions,
    ExperimentResult,
    Row,
    run_all,
)
from expedition.experiments.plots import new_figure, save_figure
from expedition.team import UsageError
from robot_agent.estimators import ESTIMATORS

NAME = "slam-logs"
SUFFIXES = (".clf", ".log", ".clf.gz", ".log.gz", ".mcap", ".db3")
QUICK_SCANS = 1500
# (mean, std) [m], (mean, std) [deg] over the relations of the Intel Research Lab.
PUBLISHED: dict[str, dict[str, tuple[tuple[float, float], tuple[float, float]]]] = {
    "intel": {
        "scan matching (Kuemmerle et al. 2009)": ((0.220, 0.296), (1.7, 4.8)),
        "particle filter (Kuemmerle et al. 2009)": ((0.070, 0.083), (3.0, 5.3)),
        "graph mapping (Kuemmerle et al. 2009)": ((0.031, 0.026), (1.3, 4.7)),
        "Cartographer (Hess et al. 2016)": ((0.0229, 0.0239), (0.453, 1.335)),
    }
}


@dataclass(frozen=True)
class _Job:
    """One estimator over one log."""

    log: Path
    estimator: str
    seed: int
    first: int | None
    out: Path


def run(options: ExperimentOptions) -> ExperimentResult:
    """Every estimator over real robots' logs: error, speed and memory."""
    logs = _logs(options.data)
    first = QUICK_SCANS if options.quick else None
    jobs = [
        _Job(log, name, seed, first, options.out / f"{_stem(log)}-{name}-{seed}")
        for log in logs
        for name in ESTIMATORS
        for seed in range(options.seeds or 1)
    ]
    # One process each, so that each has its own peak of memory.
    rows = run_all(_measure, jobs, options.workers)
    rows += [row for log in logs for row in _published(_stem(log))]
    _plot(rows, options.out)
    # What is published is about whole logs.
    return ExperimentResult(NAME, rows, [] if options.quick else _claims(rows))


def _logs(data: Path | None) -> list[Path]:
    """Return the logs in a folder, or in its folder `logs`."""
    if data is None:
        raise UsageError("say where the logs are: --data DIR")
    folder = data / "logs" if (data / "logs").is_dir() else data
    if not folder.is_dir():
        raise UsageError(f"no folder {folder}: give one with logs by --data DIR")
    found = sorted(path for path in folder.iterdir() if path.name.endswith(SUFFIXES))
    if not found:
        raise UsageError(f"no logs in {folder}: their names must end in one of {SUFFIXES}")
    return found


def _stem(log: Path) -> str:
    return log.name.split(".")[0]


def _measure(job: _Job) -> Row:
    """Run `expedition slam` and return a row of the table."""
    words = ["slam", str(job.log), "--estimator", job.estimator, "--seed", str(job.seed)]
    words += ["--out", str(job.out), "--json"]
    relations = job.log.with_name(f"{_stem(job.log)}.relations")
    if relations.exists():
        words += ["--relations", str(relations)]
    if job.first is not None:
        words += ["--first", str(job.first)]
    program = "from expedition.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise UsageError(f"{job.log.name}: {done.stderr.strip() or 'failed without a word'}")
    return _row(_stem(job.log), job.estimator, json.loads(done.stdout))


def _row(log: str, estimator: str, figures: dict[str, Any]) -> Row:
    """Return a row of the table; what is not known is None."""
    shift = figures.get("translational_error_m") or {}
    turn = figures.get("rotational_error_deg") or {}
    return {
        "log": log,
        "estimator": estimator,
        "scans": figures.get("scans"),
        "skipped": figures.get("skipped"),
        "translational_mean_m": shift.get("mean"),
        "translational_std_m": shift.get("std"),
        "rotational_mean_deg": turn.get("mean"),
        "rotational_std_deg": turn.get("std"),
        "seconds": figures.get("seconds"),
        "scans_per_s": figures.get("scans_per_s"),
        "peak_rss_mb": figures.get("peak_rss_mb"),
    }


def _published(log: str) -> list[Row]:
    """Return the published figures on a log as rows."""
    return [
        _row(
            log,
            name,
            {
                "translational_error_m": dict(zip(("mean", "std"), shift, strict=True)),
                "rotational_error_deg": dict(zip(("mean", "std"), turn, strict=True)),
            },
        )
        for name, (shift, turn) in PUBLISHED.get(log, {}).items()
    ]


def _claims(rows: list[Row]) -> list[Claim]:
    """Compare ours with what is published, log by log."""
    claims = []
    for log, published in PUBLISHED.items():
        ours = [
            row["translational_mean_m"]
            for row in rows
            if row["log"] == log and row["seconds"] is not None
        ]
        errors = [error for error in ours if error is not None]
        if errors:
            best = min(shift[0] for shift, _ in published.values())
            claims.append(
                Claim(
                    f"{log}: the best estimator errs less than any published figure in the table",
                    min(errors) < best,
                    f"{min(errors):.4f} m, published {best:.4f} m",
                )
            )
    return claims


def _plot(rows: list[Row], folder: Path) -> None:
    """Draw the translational errors as bars, log by log."""
    known = [row for row in rows if row["translational_mean_m"] is not None]
    if not known:
        return
    figure, axes = new_figure("Errors over relations", "mean translational error [m]", "")
    names = [f"{row['log']}: {row['estimator']}" for row in known]
    axes.barh(names[::-1], [row["translational_mean_m"] for row in known][::-1])
    save_figure(figure, folder / f"{NAME}.png")
