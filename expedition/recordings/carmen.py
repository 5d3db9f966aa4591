"""CARMEN's text logs: one message per line, some of them damaged."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from expedition.recordings.carmen_messages import (
    RANGE_MAX,
    Laser,
    reach,
    read_flaser,
    read_param,
    read_robotlaser,
)
from expedition.recordings.duplicates import repeated
from expedition.recordings.fields import DamagedError
from expedition.recordings.recording import Reading, Recording, RecordingError, Skipped
from expedition.recordings.time_order import LATE, out_of_time

READERS = {"FLASER": read_flaser, "ROBOTLASER1": read_robotlaser}


def parse(lines: Iterable[str], range_max: float = RANGE_MAX, late: float = LATE) -> Recording:
    """Return the readings of a log.

    Damaged lines, lines stamped against the order of the others and repeated readings are skipped:
    the readings are those of the same log without such lines. Other messages and comments are
    ignored; ODOM too, because every laser line carries the odometry of its own moment.

    Args:
        lines: the log's.
        range_max: the laser's reach [m] in logs that do not say it.
        late: a line may be stamped so much [s] before the newest one; clocks jitter.

    Raises:
        RecordingError: there is no laser line at all.
    """
    laser = Laser(range_max=reach(range_max))
    numbers: list[int] = []
    readings: list[Reading] = []
    skipped: list[Skipped] = []
    seen = 0
    for line_number, line in enumerate(lines, 1):
        if not line.startswith(("FLASER", "ROBOTLASER1", "PARAM")):
            continue
        fields = line.split()
        try:
            if fields[0] == "PARAM":
                read_param(fields, laser)
            elif fields[0] in READERS:
                readings.append(READERS[fields[0]](fields, laser))
                numbers.append(line_number)
        except DamagedError as damage:
            skipped.append(Skipped(line_number, str(damage)))
        seen += fields[0] in READERS
    if not seen:
        raise RecordingError(
            "no laser readings in it: give a CARMEN log with FLASER or ROBOTLASER1 lines, "
            "or a rosbag2"
        )
    return _in_order(readings, numbers, skipped, late)


def _in_order(
    readings: list[Reading], numbers: list[int], skipped: list[Skipped], late: float
) -> Recording:
    """Return the recording of the readings that are neither out of time nor repeated.

    Order comes first: of a reading and its copy with a stale stamp the copy goes.
    """
    stamps = np.array([reading.scan.stamp for reading in readings])
    places = np.array([[r.T_wheel_base.x, r.T_wheel_base.y] for r in readings]).reshape(-1, 2)
    stray = out_of_time(stamps, places, late)
    timely = [index for index in range(len(readings)) if not stray[index]]
    copies = repeated([readings[index] for index in timely])
    kept = [readings[index] for index, copy in zip(timely, copies, strict=True) if not copy]
    skipped += [
        Skipped(numbers[index], "stamped against the order of the lines around it")
        for index in np.flatnonzero(stray)
    ]
    skipped += [
        Skipped(numbers[index], "a reading once more")
        for index, copy in zip(timely, copies, strict=True)
        if copy
    ]
    return Recording(kept, sorted(skipped, key=lambda part: part.line))
