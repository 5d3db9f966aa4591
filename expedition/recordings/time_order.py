"""Which lines of a log are stamped against the order of the others.

The lines fall into runs, within which stamps go on (a little jitter allowed) without a jump. The
order to trust is that of the runs that keep the most lines, where every time that the clock is set
back costs as much as `SET_BACK` lines. So a few lines stamped back, or far ahead, are given up
whatever comes after them, and a clock that was set back for good, or a log that was repeated, is
believed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.geometry import Floats

LATE = 5.0
"""So much [s] a line may be stamped before the newest one; in real logs it is below 1 s."""

SET_BACK = 20
"""With so many lines in a row the clock was set back; with fewer, the lines are wrong."""

JUMP = 0.25
"""What a jump ahead costs [lines]: it decides between two lines that exclude each other."""

PAUSE = 0.2
"""Of the time that a line may be late: with a longer pause a new run begins."""

LOST_START = 10
"""So many lines must contradict the start of a log before it is given up for them."""

LOOK_BACK = 200
"""So many runs in a row may be given up."""

FASTEST = 10.0
"""No robot goes faster [m/s]."""

SLACK = 1.0
"""Odometry may step so far [m] in no time."""


@dataclass(frozen=True, slots=True)
class _Run:
    """Lines in a row without a jump.

    Attributes:
        begin: index of the first.
        end: index after the last.
        first: stamp [s] of the first.
        newest: the newest stamp [s].
        torn: the run is late and its odometry does not go on from the line before.
    """

    begin: int
    end: int
    first: float
    newest: float
    torn: bool


def out_of_time(stamps: Floats, places: Floats, late: float = LATE) -> npt.NDArray[np.bool_]:
    """Return which lines to give up, (n,) bool.

    Args:
        stamps: (n,) [s], in the order of the file.
        places: (n, 2) [m], where the wheels alone put the robot.
        late: so much [s] may a line be stamped before the newest one.
    """
    stray = np.ones(len(stamps), dtype=np.bool_)
    for run in _chain(_runs(stamps, _torn(stamps, places, late), late), late):
        stray[run.begin : run.end] = False
    return stray


def _torn(stamps: Floats, places: Floats, late: float) -> npt.NDArray[np.bool_]:
    """Return which late lines, (n,) bool, are farther from the one before than a robot could be.

    Lines in time are believed anyway: somebody may have carried the robot.
    """
    torn = np.zeros(len(stamps), dtype=np.bool_)
    if len(stamps):
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        possible = SLACK + FASTEST * np.abs(np.diff(stamps))
        behind = stamps < np.maximum.accumulate(stamps) - late
        torn[1:] = behind[1:] & (steps > possible)
    return torn


def _runs(stamps: Floats, torn: npt.NDArray[np.bool_], late: float) -> list[_Run]:
    """Cut the lines where stamps jump or odometry is torn."""
    runs: list[_Run] = []
    begin, newest = 0, 0.0
    values = stamps.tolist()
    for index, stamp in enumerate(values):
        # A pause may be an error of the stamp: small steps ahead must not add up unseen.
        jumps = stamp < newest - late or stamp > newest + PAUSE * late
        if index and (jumps or torn[index]):
            runs.append(_Run(begin, index, values[begin], newest, bool(torn[begin])))
            begin = index
        newest = stamp if index == begin else max(newest, stamp)
    if values:
        runs.append(_Run(begin, len(values), values[begin], newest, bool(torn[begin])))
    return runs


def _chain(runs: list[_Run], late: float) -> list[_Run]:
    """Return the runs to keep: those with the most lines, less what set-back clocks cost."""
    newest = np.array([run.newest for run in runs])
    worth = np.zeros(len(runs))  # of the best chain that ends with this run
    before = np.full(len(runs), -1)
    for index, run in enumerate(runs):
        worth[index] = run.end - run.begin
        if index == 0:
            continue
        low = max(0, index - LOOK_BACK)
        # Half a line less, so that exactly SET_BACK lines are enough.
        back = run.torn | (run.first < newest[low:index] - late)
        ahead = run.first > newest[low:index] + late
        gains = worth[low:index] - np.where(back, SET_BACK - 0.5, np.where(ahead, JUMP, 0.0))
        best = int(np.argmax(gains))
        worth[index] += max(gains[best], -LOST_START)
        if gains[best] > -LOST_START:
            before[index] = low + best
    chain = []
    index = int(np.argmax(worth)) if runs else -1
    while index >= 0:
        chain.append(runs[index])
        index = int(before[index])
    return chain[::-1]
