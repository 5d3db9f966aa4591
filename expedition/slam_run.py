"""One estimator over one recorded log."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from expedition.recordings.recording import Recording
from mapping.estimator import Estimator
from mapping.geometry import IDENTITY, Floats
from mapping.incremental_slam import SlamSettings
from mapping.scan import LaserScan
from robot_agent.estimators import make_estimator

# Somebody who waits is told of the progress this often [scans].
_TELL_EVERY = 500


@dataclass(frozen=True)
class SlamRun:
    """What an estimator made of a log.

    Attributes:
        estimator: as all of the log left it.
        poses: (n, 3) x, y [m], theta [rad], where the robot was at each reading.
        unmatched: scans that agreed with no map.
        seconds: by the wall clock, for the estimation alone.
        cpu_s: processor time of the same [s].
        peak_rss_mb: the most memory that this process has held so far.
    """

    estimator: Estimator
    poses: Floats
    unmatched: int
    seconds: float
    cpu_s: float
    peak_rss_mb: float


def run_slam(
    recording: Recording,
    name: str,
    settings: SlamSettings,
    rng: np.random.Generator,
    range_max: float,
    say: Callable[[int], None] = lambda done: None,
) -> SlamRun:
    """Feed a recording to an estimator, reading by reading.

    Args:
        recording: at least one reading.
        name: the estimator's, see `robot_agent.estimators`.
        settings: all that estimators have in common.
        rng: for those that draw lots.
        range_max: readings from farther away than this [m] only tell that nothing is nearer.
        say: is told now and then how many readings are done.

    Raises:
        EstimatorError: there is no such estimator.
    """
    estimator = make_estimator(name, settings, rng)
    wall, cpu, unmatched = time.perf_counter(), time.process_time(), 0
    T_wheel_last = recording.readings[0].T_wheel_base
    for done, reading in enumerate(recording.readings):
        T_before_after = T_wheel_last.inverse() @ reading.T_wheel_base if done else IDENTITY
        T_wheel_last = reading.T_wheel_base
        estimate = estimator.step(T_before_after, heeded(reading.scan, range_max))
        unmatched += not estimate.matched
        if done % _TELL_EVERY == 0:
            say(done)
    estimator.finish()
    poses = estimator.trajectory()
    return SlamRun(
        estimator,
        poses,
        unmatched,
        time.perf_counter() - wall,
        time.process_time() - cpu,
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    )


def heeded(scan: LaserScan, range_max: float) -> LaserScan:
    """Return a real laser's scan with what can be believed of it.

    A beam without a return says nothing: glass, a black coat and a mirror give none either. A
    return from far away says at least that nothing is nearer.

    Args:
        scan: as recorded.
        range_max: [m].
    """
    return scan.without(scan.ranges >= scan.range_max).within(range_max)
