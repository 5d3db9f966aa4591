"""Whole missions as jobs of an experiment: each runs in one process and gives one summary."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from expedition.launch import Watch, run_team
from expedition.team import load_team


@dataclass(frozen=True)
class Mission:
    """One mission to run: a ready-made team and what is set of it.

    Attributes:
        team: a ready-made team's name.
        overrides: nested settings, as in a team file.
        out: where the results go; None keeps only the summary.
    """

    team: str
    overrides: dict[str, Any]
    out: str | None = None


def run_mission(mission: Mission) -> dict[str, Any]:
    """Run a mission in this process; return the content of its `summary.json`."""
    team = load_team(mission.team, mission.overrides)
    if mission.out is not None:
        return run_team(team, Path(mission.out), Watch(), in_process=True)
    with tempfile.TemporaryDirectory() as folder:
        return run_team(team, Path(folder), Watch(), in_process=True)


def worst_rmse(summary: Mapping[str, Any]) -> float | None:
    """Return the largest trajectory error (root mean square) of a mission's robots [m], if any."""
    errors = [robot["trajectory_rmse_m"] for robot in summary["robots"]]
    return max((error for error in errors if error is not None), default=None)
