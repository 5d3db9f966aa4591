"""What a person sees of a running mission in the terminal."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from expedition.team import TeamSettings

if TYPE_CHECKING:  # what is needed to run a mission takes seconds to import
    from expedition.launch import Progress
    from protocol.effects import Note

_BAR = 30  # characters of the coverage bar


class Live:
    """Prints progress to standard error; standard output stays free for results.

    Args:
        quiet: only warnings and errors.
    """

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._terminal = sys.stderr.isatty()
        self._line = False
        self._told = -1.0

    def begin(self, team: TeamSettings) -> None:
        """Say what is about to happen."""
        mission = team.mission
        self._print(
            f"team {team.name}: {mission.robots} robots in {mission.world}, "
            f"strategy {mission.strategy}, seed {mission.seed}"
        )

    def say(self, text: str) -> None:
        """Say something a person should know while waiting."""
        self._print(text)

    def note(self, name: str, note: Note) -> None:
        """Show a line that a process logged."""
        if note.level == "debug" or (self._quiet and note.level == "info"):
            return
        self._clear()
        mark = "" if note.level == "info" else f"{note.level}: "
        print(f"  [{name}] {mark}{note.text}", file=sys.stderr, flush=True)

    def progress(self, progress: Progress) -> None:
        """Show how far the mission is: one line, drawn over itself on a terminal."""
        if self._quiet:
            return
        filled = round(_BAR * progress.coverage)
        text = (
            f"  {progress.sim_time_s:7.1f} s  [{'#' * filled}{'.' * (_BAR - filled)}] "
            f"{100.0 * progress.coverage:5.1f} %"
        )
        if self._terminal:
            print(f"\r{text}", end="", file=sys.stderr, flush=True)
            self._line = True
        elif progress.sim_time_s - self._told >= 30.0 or self._told < 0.0:
            self._told = progress.sim_time_s
            print(text, file=sys.stderr, flush=True)

    def end(self, summary: dict[str, Any], out: Path) -> None:
        """Say how it ended and where everything is."""
        self._clear()
        coverage = summary["coverage"]
        covered = "unknown" if coverage is None else f"{100.0 * coverage:.1f} %"
        factor = summary["real_time_factor"]
        print(f"ended {summary['ended']}: {summary.get('reason', '')}")
        print(
            f"  coverage {covered} after {summary['sim_time_s']:.0f} s of mission time, "
            f"{summary['wall_time_s']:.1f} s of yours"
            + (f" ({factor:.1f} times real time)" if factor else "")
        )
        for robot in summary["robots"]:
            error = robot["trajectory_rmse_m"]
            shown = "" if error is None else f", trajectory error {error:.3f} m"
            print(f"  {robot['id']}: {robot['ended']}, {robot['path_m']:.0f} m driven{shown}")
        print(f"map:    {out / 'map.png'} (and map.yaml for ROS)")
        print(f"report: {out / 'report.html'}")

    def _print(self, text: str) -> None:
        if not self._quiet:
            self._clear()
            print(text, file=sys.stderr, flush=True)

    def _clear(self) -> None:
        """End the progress line before something else is printed."""
        if self._line:
            print("\r" + " " * 70 + "\r", end="", file=sys.stderr)
            self._line = False
