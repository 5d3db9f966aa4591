from __future__ import annotations

import gzip
import itertools
import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from expedition.recordings.carmen import parse
from expedition.recordings.recording import Reading, RecordingError
from mapping.geometry import IDENTITY, Pose2
from tests.unit.expedition.recordings.logs import flaser, log, robotlaser

Key = tuple[float, bytes, tuple[float, float, float]]


def keys(readings: list[Reading]) -> list[Key]:
    return [(r.scan.stamp, r.scan.ranges.tobytes(), r.T_wheel_base.as_tuple()) for r in readings]


def test_a_flaser_line() -> None:
    line = "FLASER 3 1.5 81.83 0 9 9 9 1.25 -2.5 3.5 976052857.337530 nohost 0.000246"
    recording = parse(["PARAM robot_frontlaser_offset 0.25 nohost 0\n", line + "\n"])
    (reading,) = recording.readings
    assert recording.skipped == []
    assert reading.scan.stamp == 976052857.337530
    assert reading.T_wheel_base == Pose2(1.25, -2.5, 3.5 - 2 * math.pi)
    assert reading.scan.T_base_laser == Pose2(0.25, 0.0, 0.0)
    assert reading.scan.ranges.dtype == np.float32
    assert reading.scan.range_max == 80.0
    assert reading.scan.hits.tolist() == [True, False, False]
    np.testing.assert_allclose(reading.scan.bearings, [-math.pi / 2, 0.0, math.pi / 2])


@pytest.mark.parametrize(
    ("beams", "first", "step"),
    [
        (180, -90, 1),
        (181, -90, 1),
        (360, -90, 0.5),
        (361, -90, 0.5),
        (720, -90, 0.25),
        (721, -90, 0.25),
        (401, -50, 0.25),
        (91, -90, 2),
    ],
)
def test_bearings_by_the_number_of_readings(beams: int, first: float, step: float) -> None:
    scan = parse([flaser(1, beams)]).readings[0].scan
    assert math.degrees(scan.bearing_start) == pytest.approx(first)
    assert math.degrees(scan.bearing_step) == pytest.approx(step)


@pytest.mark.parametrize(
    ("param", "reach"),
    [
        ("PARAM robot_front_laser_max 30.5 nohost 0", 30.5),
        ("PARAM laser_max_range 81.91 nohost 0", 81.0),
        ("PARAM other 5 nohost 0", 50.0),
        ("PARAM", 50.0),
    ],
)
def test_the_reach_is_the_logs_own_or_the_callers(param: str, reach: float) -> None:
    assert parse([param, flaser(1)], range_max=50.0).readings[0].scan.range_max == reach


@pytest.mark.parametrize(
    "param",
    [
        "PARAM laser_max_range",
        "PARAM laser_max_range nan nohost 0",
        "PARAM laser_max_range -3 nohost 0",
        "PARAM robot_frontlaser_offset 1e4 nohost 0",
    ],
)
def test_a_damaged_param_is_told(param: str) -> None:
    recording = parse([param, flaser(1)])
    assert [part.line for part in recording.skipped] == [1]
    assert recording.readings[0].scan.range_max == 80.0
    assert recording.readings[0].scan.T_base_laser is IDENTITY


def test_a_robotlaser_line() -> None:
    (reading,) = parse([robotlaser(remissions="2 11 12")]).readings
    assert reading.scan.stamp == 1000.5
    assert reading.T_wheel_base == Pose2(1.0, 2.0, 0.0)
    assert reading.scan.T_base_laser == Pose2(0.1, 0.0, 0.0)
    assert (reading.scan.bearing_start, reading.scan.bearing_step) == (-0.5, 0.5)
    assert reading.scan.hits.tolist() == [True, True, False]


def test_a_robotlaser_in_the_middle_of_the_robot() -> None:
    line = robotlaser(laser="3.000001 4.0 2.0", robot="3.0 4.0 2.000001", maximum="0")
    scan = parse([line]).readings[0].scan
    assert scan.T_base_laser is IDENTITY
    assert scan.range_max == 80.0


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("FLASER", "ends before"),
        ("FLASER x 1 2", "not a count"),
        ("FLASER -180 1 2", "not a count"),
        ("FLASER 99999999999 1 2", "not a count"),
        ("FLASER 999999 1 2", "more than any"),
        ("FLASER 0 1 1 1 1 1 1 5 nohost 0", "no sweep"),
        ("FLASER 2 1.0 2.0 1 1 1 1 1 1 5 nohost", "not those of 2"),
        ("FLASER 3 1.0 2.0 1 1 1 1 1 1 5 nohost 0", "not those of 3"),
        ("FLASER 2 1.0.3 2.0 1 1 1 1 1 1 5 nohost 0", "not a number"),
        ("FLASER 2 1_0 2.0 1 1 1 1 1 1 5 nohost 0", "not a number"),
        ("FLASER 2 \u0661 2.0 1 1 1 1 1 1 5 nohost 0", "not a number"),
        ("FLASER 2 nan 2.0 1 1 1 1 1 1 5 nohost 0", "not finite"),
        ("FLASER 2 -1 2.0 1 1 1 1 1 1 5 nohost 0", "not a range"),
        ("FLASER 2 1e30 2.0 1 1 1 1 1 1 5 nohost 0", "not a range"),
        ("FLASER 2 1 2.0 nan 1 1 1 1 1 5 nohost 0", "not finite"),
        ("FLASER 2 1 2.0 1 1 1 1 inf 1 5 nohost 0", "not finite"),
        ("FLASER 2 1 2.0 1 1 1 1 2e5 1 5 nohost 0", "absurdly"),
        ("FLASER 2 1 2.0 1 1 1 1 1 1 -inf nohost 0", "not finite"),
        (f"FLASER 2 1 {'7' * 5000}x 1 1 1 1 1 1 5 nohost 0", "'77777777777777777777...'"),
        ("ROBOTLASER1 0 0 0", "ends before"),
        ("ROBOTLASER1 0 0 3.1 0.1 80 0.1 0 2 1.0 1.0", "not those of 2"),
        (robotlaser(remissions="1"), "remissions"),
        (robotlaser(maximum="-1"), "reach"),
        (robotlaser().replace(" 1.0 0.5 81.91", " 1.0 -0.5 81.91"), "bearings"),
    ],
)
def test_a_damaged_line_is_skipped_with_its_reason(line: str, reason: str) -> None:
    recording = parse([flaser(1), line, flaser(2)])
    assert keys(recording.readings) == keys(parse([flaser(1), flaser(2)]).readings)
    (skipped,) = recording.skipped
    assert skipped.line == 2
    assert reason in skipped.reason


@pytest.mark.parametrize("lines", [[], ["# nothing"], ["ODOM 0 0 0 0 0 0 5 nohost 0", "rubbish"]])
def test_a_file_without_laser_lines(lines: list[str]) -> None:
    with pytest.raises(RecordingError, match="FLASER"):
        parse(lines)


def test_jitter_is_kept() -> None:
    lines = [flaser(k, stamp=1000.0 + 0.2 * k - 0.9 * (k % 3 == 0)) for k in range(30)]
    recording = parse(lines)
    assert len(recording.readings) == 30
    assert recording.skipped == []


def test_a_line_stamped_back_or_far_ahead_goes_whatever_comes_after_it() -> None:
    for wrong in (-100.0, 100.0, 1e12):
        for at in (1, 5, 18):
            lines = log(20)
            lines[1 + at] = flaser(at, stamp=1000.0 + wrong)
            recording = parse(lines)
            assert [part.line for part in recording.skipped] == [2 + at]


def test_a_clock_set_back_is_believed_after_twenty_lines() -> None:
    before = [flaser(k) for k in range(50)]
    for late, kept in ((19, 50), (20, 70)):
        after = [flaser(k, stamp=500.0 + 0.2 * k) for k in range(50, 50 + late)]
        assert len(parse(before + after).readings) == kept


def test_late_lines_with_torn_odometry_are_not_believed() -> None:
    before = [flaser(k) for k in range(50)]
    torn = [flaser(k, stamp=500.0 + 0.2 * k, x=100.0 * (k % 7)) for k in range(50, 80)]
    assert len(parse(before + torn).readings) == 50


def test_a_log_repeated_is_taken_each_time() -> None:
    assert len(parse(log(150) * 4).readings) == 600


def test_a_repeated_reading_goes_whatever_its_stamp() -> None:
    lines = [flaser(k) for k in range(30)]
    lines.insert(20, flaser(3, stamp=1003.9, x=0.6))
    recording = parse(lines)
    assert [part.line for part in recording.skipped] == [21]
    assert len(recording.readings) == 30


WRONG = ("truncated", "nan", "back", "copy", "stale copy", "rubbish", "dropped")


@given(
    st.dictionaries(st.integers(1, 38), st.sampled_from(WRONG), max_size=12),
    st.integers(30, 500),
)
def test_wrong_lines_leave_the_readings_of_the_others(faults: dict[int, str], cut: int) -> None:
    lines: list[str] = []
    clean: list[str] = []
    for k in range(40):
        line, fault = flaser(k), faults.get(k)
        copies = {"copy": [line], "stale copy": [flaser(k, stamp=900.0 + k, x=0.2 * k)]}
        wrong = {
            "truncated": [line[:cut]],
            "nan": [line.replace(" 0.500000 ", " nan ", 1)],
            "back": [flaser(k, stamp=980.0 - k, x=0.2 * k)],
            "rubbish": ["FLASER \x00\xff"],
            "dropped": [],
        }
        good = fault not in wrong
        lines += wrong.get(fault or "", [])
        if good:
            clean.append(line)
            lines += [*copies.get(fault or "", []), line]
    assert keys(parse(lines).readings) == keys(parse(clean).readings)


@st.composite
def spoilt(draw: st.DrawFn) -> tuple[list[str], list[str]]:
    """A log with some lines changed at random, and the lines that are as they were."""
    lines = [flaser(k) for k in range(40)]
    places = draw(st.sets(st.integers(0, 39), max_size=10))
    for place in sorted(places):
        line = lines[place]
        at = draw(st.integers(0, len(line)) | st.integers(len(line) - 80, len(line)))
        length = draw(st.integers(0, 4))
        lines[place] = line[:at] + draw(st.text(max_size=4)) + line[at + length :]
    return lines, [line for place, line in enumerate(lines) if place not in places]


@given(spoilt())
def test_random_damage_never_raises_and_never_touches_other_lines(
    logs: tuple[list[str], list[str]],
) -> None:
    lines, untouched = logs
    found = keys(parse(lines).readings)
    expected = keys(parse(untouched).readings)
    assert len(expected) == len(untouched)
    known = set(expected)
    assert [key for key in found if key in known] == expected


@given(st.lists(st.text() | st.text().map(lambda text: "FLASER 2 " + text), max_size=5))
def test_any_text_gives_a_recording_or_a_recording_error(lines: list[str]) -> None:
    try:
        parse(lines)
    except RecordingError as error:
        assert "\n" not in str(error)


@pytest.mark.data
@pytest.mark.parametrize(("name", "scans"), [("intel", 13_631), ("mit_csail", 1_988)])
def test_every_line_of_real_logs_is_kept(data_dir: Path, name: str, scans: int) -> None:
    with gzip.open(data_dir / "logs" / f"{name}.clf.gz", "rt", encoding="latin-1") as file:
        lines = file.readlines()
    start = time.process_time()
    recording = parse(lines)
    assert time.process_time() - start < 5.0
    assert len(recording.readings) == scans
    assert recording.skipped == []


def restamped(line: str, seconds: float) -> str:
    head, stamp, host, logged = line.rsplit(maxsplit=3)
    return f"{head} {float(stamp) + seconds:.6f} {host} {logged}"


@pytest.mark.data
@pytest.mark.parametrize("seed", range(3))
def test_a_real_log_with_wrong_lines_gives_the_readings_of_the_others(
    data_dir: Path, seed: int
) -> None:
    with gzip.open(data_dir / "logs" / "intel.clf.gz", "rt", encoding="latin-1") as file:
        scans = (line for line in file if line.startswith("FLASER"))
        lines = list(itertools.islice(scans, 3000))
    rng = np.random.default_rng(seed)
    wrong, clean = [], []
    for k, line in enumerate(lines):
        fault = int(rng.integers(0, 40)) if k else 40
        seconds = float(rng.uniform(8.0, 2000.0))
        if fault == 0:  # dropped out
            continue
        if fault in (1, 2, 3):
            spoilt = line.replace(".", ".nan", 1), line[: len(line) // 2]
            wrong.append((restamped(line, -seconds), *spoilt)[fault - 1])
            continue
        clean.append(line)
        wrong.append(line)
        if fault in (4, 5):
            wrong.append(line if fault == 4 else restamped(line, 0.3))
            wrong.append(restamped(clean[-int(rng.integers(0, 50)) :][0], -seconds))
    assert keys(parse(wrong).readings) == keys(parse(clean).readings)
