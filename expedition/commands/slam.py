"""`expedition slam`: local SLAM over a recorded log."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from expedition.commands.options import JsonOption, print_json
from expedition.team import UsageError

if TYPE_CHECKING:
    from expedition.recordings.recording import Recording
    from expedition.recordings.relations import Relation, RelationErrors
    from expedition.slam_run import SlamRun


def slam(
    log: Annotated[
        Path, typer.Argument(help="a CARMEN log (.log, .clf, also gz), or a rosbag2 or MCAP file")
    ],
    estimator: Annotated[
        str, typer.Option(help="who estimates, see `expedition list`; or module:Class")
    ] = "graph",
    relations: Annotated[
        Path | None,
        typer.Option(help="true relative poses to measure the error by (Kuemmerle et al. 2009)"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="folder for the results", show_default="runs/slam-LOG")
    ] = None,
    max_range: Annotated[
        float, typer.Option(min=1.0, help="readings from farther away are not drawn [m]")
    ] = 30.0,
    first: Annotated[
        int | None, typer.Option(min=1, help="take only so many scans from the beginning")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="for estimators that draw lots")] = 0,
    as_json: JsonOption = False,
) -> int:
    """Map the way of one recorded robot, and measure how well where the truth is known."""
    from expedition.recordings.recording import RecordingError
    from expedition.results.slam import write_slam
    from robot_agent.estimators import EstimatorError

    try:
        recording, truth = _read(log, relations, first)
        run = _estimate(recording, estimator, max_range, seed, quiet=as_json)
        errors = _errors(recording, run, truth)
    except (RecordingError, EstimatorError) as error:
        raise UsageError(str(error)) from None
    figures = _figures(recording, run, errors)
    folder = out or Path("runs") / f"slam-{log.name.split('.')[0]}"
    write_slam(folder, recording, run, {"log": log.name, "estimator": estimator, **figures})
    if as_json:
        print_json(figures)
    else:
        _show(figures, recording, folder)
    return 0


def _read(log: Path, relations: Path | None, first: int | None) -> tuple[Recording, list[Relation]]:
    """Return the log, or its beginning, and the true relations, if there are any."""
    from expedition.recordings.read import read_recording
    from expedition.recordings.relations import read_relations

    truth = read_relations(relations) if relations is not None else []
    recording = read_recording(log)
    return replace(recording, readings=recording.readings[:first]), truth


def _estimate(
    recording: Recording, estimator: str, max_range: float, seed: int, quiet: bool
) -> SlamRun:
    """Run the estimator, with a word now and then for whoever waits."""
    import numpy as np

    from expedition.slam_run import run_slam
    from expedition.warm_up import warm_up
    from mapping.incremental_slam import SlamSettings

    live = not quiet and sys.stderr.isatty()
    total = len(recording.readings)

    def say(done: int) -> None:
        if live:
            print(f"\r{done} of {total} scans", end="", file=sys.stderr, flush=True)

    warm_up(lambda text: print(text, file=sys.stderr), load=False)
    run = run_slam(
        recording, estimator, SlamSettings(), np.random.default_rng(seed), max_range, say
    )
    if live:
        print("\r" + " " * 40 + "\r", end="", file=sys.stderr)
    return run


def _errors(recording: Recording, run: SlamRun, relations: list[Relation]) -> RelationErrors | None:
    """Return the errors over the true relations; None without any."""
    from expedition.recordings.relations import relation_errors

    if not relations:
        return None
    return relation_errors(recording.stamps, run.poses, relations)


def _figures(recording: Recording, run: SlamRun, errors: RelationErrors | None) -> dict[str, Any]:
    """Return what is told of a run, units in the names."""
    import math

    figures: dict[str, Any] = {
        "scans": len(recording.readings),
        "skipped": len(recording.skipped),
        "unmatched": run.unmatched,
        "seconds": round(run.seconds, 3),
        "cpu_s": round(run.cpu_s, 3),
        "scans_per_s": round(len(recording.readings) / max(run.seconds, 1e-9), 1),
        "peak_rss_mb": round(run.peak_rss_mb, 1),
        "translational_error_m": None,
        "rotational_error_deg": None,
    }
    if errors is not None:
        figures["relations"] = len(errors.translational)
        figures["relations_missing"] = errors.missing
        figures["translational_error_m"] = {
            "mean": errors.translational_mean,
            "std": errors.translational_std,
        }
        figures["rotational_error_deg"] = {
            "mean": math.degrees(errors.rotational_mean),
            "std": math.degrees(errors.rotational_std),
        }
    return figures


def _show(figures: dict[str, Any], recording: Recording, folder: Path) -> None:
    """Print the figures for people."""
    print(
        f"{figures['scans']} scans in {figures['seconds']:.1f} s "
        f"({figures['scans_per_s']:.0f} a second), at most {figures['peak_rss_mb']:.0f} MB"
    )
    if recording.skipped:
        first = recording.skipped[0]
        print(f"{figures['skipped']} lines skipped, the first: line {first.line}, {first.reason}")
    shift, turn = figures["translational_error_m"], figures["rotational_error_deg"]
    if shift is not None:
        print(
            f"error {shift['mean']:.4f} +- {shift['std']:.4f} m, {turn['mean']:.3f} +- "
            f"{turn['std']:.3f} deg over {figures['relations']} relations"
        )
    print(f"map and trajectory: {folder}")
