from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from expedition.recordings.carmen import parse
from expedition.recordings.carmen_messages import bearings
from expedition.recordings.carmen_writer import carmen_lines, write_carmen
from expedition.recordings.read import read_recording
from expedition.recordings.recording import Reading, Recording, RecordingError
from mapping.geometry import IDENTITY, Pose2, wrap_angle
from mapping.scan import LaserScan

metres = st.floats(-1e4, 1e4)
poses = st.builds(Pose2, metres, metres, st.floats(-math.pi, math.pi).map(wrap_angle))


def reading(
    ranges: list[float], stamp: float, T_wheel_base: Pose2, offset: float, reach: float
) -> Reading:
    start, step = bearings(len(ranges))
    mounted = Pose2(offset, 0.0, 0.0) if offset else IDENTITY
    scan = LaserScan(np.array(ranges, dtype=np.float32), start, step, reach, stamp, mounted)
    return Reading(scan, T_wheel_base)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    readings = []
    offset, reach = draw(st.floats(-2.0, 2.0)), draw(st.floats(1.0, 80.0))
    for k in range(draw(st.integers(1, 4))):
        ranges = draw(st.lists(st.floats(0.0, 90.0, width=32), min_size=2, max_size=6))
        ranges[0] = float(k)  # a reading is no copy of another
        stamp = 1e9 + k + draw(st.floats(0.0, 2.0))
        readings.append(reading(ranges, stamp, draw(poses), offset, reach))
    return Recording(readings)


@given(recordings(), poses)
def test_what_is_written_is_read_again(recording: Recording, T_map_base: Pose2) -> None:
    corrected = [T_map_base.as_tuple()] * len(recording.readings)
    again = parse(carmen_lines(recording, corrected))
    assert again.skipped == []
    assert len(again.readings) == len(recording.readings)
    for was, now in zip(recording.readings, again.readings, strict=True):
        np.testing.assert_array_equal(now.scan.ranges, was.scan.ranges)
        assert now.scan.stamp == was.scan.stamp
        assert now.scan.range_max == was.scan.range_max
        assert now.scan.T_base_laser == was.scan.T_base_laser
        assert (now.scan.bearing_start, now.scan.bearing_step) == (
            was.scan.bearing_start,
            was.scan.bearing_step,
        )
        assert now.T_wheel_base == was.T_wheel_base


def test_the_laser_stands_where_it_was_corrected_to(tmp_path: Path) -> None:
    recording = Recording([reading([1.0, math.inf], 5.0, Pose2(1.0, 2.0, 0.5), 0.5, 20.0)])
    write_carmen(tmp_path / "a.log", recording, [[10.0, 20.0, math.pi / 2]])
    line = (tmp_path / "a.log").read_text().splitlines()[-1].split()
    assert line[:4] == ["FLASER", "2", "1.0", "20.0"]
    np.testing.assert_allclose([float(v) for v in line[4:7]], [10.0, 20.5, math.pi / 2])
    assert line[7:10] == ["1.0", "2.0", "0.5"]
    assert not read_recording(tmp_path / "a.log").readings[0].scan.hits[1]


def test_a_laser_that_the_format_cannot_tell_of(tmp_path: Path) -> None:
    scan = LaserScan(np.ones(5, dtype=np.float32), 0.0, 1.0, 10.0, 0.0)
    with pytest.raises(RecordingError, match="180 degrees"):
        write_carmen(tmp_path / "a.log", Recording([Reading(scan, IDENTITY)]), [[0, 0, 0]])
    assert not (tmp_path / "a.log").exists()


def test_one_pose_for_each_reading() -> None:
    with pytest.raises(ValueError, match="2 poses for 0 readings"):
        list(carmen_lines(Recording([]), np.zeros((2, 3))))
