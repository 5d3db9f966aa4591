from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.scan import LaserScan
from mapping.scan_coding import (
    DamagedScanError,
    ScanCodingSettings,
    decode_scan,
    encode_scan,
)
from mapping.scan_integration import beam_ends
from mapping.scan_layout import KNOWN_LAYOUTS, SensorLayout

HERE = Pose2(0.3, -0.2, 0.5)
MOUNTED = SensorLayout(181, -math.pi / 2, math.radians(1.0), Pose2(0.2, 0.0, 0.1))


def room_scan(beams: int = 181) -> LaserScan:
    """A room of 4 m by 3 m, a pillar, a door to nowhere, a masked teammate; made without libm."""
    x = np.arange(beams) / beams
    ranges = np.where(x < 0.3, 2.0 + x, np.where(x < 0.7, 3.0 - 2.0 * x, 1.5 + x * x))
    ranges = ranges + 0.03 * (((np.arange(beams) * 7919) % 101) / 50.0 - 1.0)
    ranges[beams // 4 : beams // 3] = 8.0
    ranges[beams // 2 : beams // 2 + 5] = 0.0
    ranges[beams // 2 + 20] = np.inf
    return LaserScan(ranges.astype(np.float32), -math.pi / 2, math.pi / (beams - 1), 8.0, 250.125)


def alike(back: LaserScan, scan: LaserScan, bound: float) -> None:
    np.testing.assert_array_equal(back.hits, scan.hits)
    np.testing.assert_array_equal(back.ranges > 0.0, scan.ranges > 0.0)
    off = np.abs(back.ranges.astype(np.float64) - scan.ranges.astype(np.float64))
    assert (off[scan.hits] <= bound).all()
    assert back.bearing_start == pytest.approx(scan.bearing_start, abs=1e-9)
    assert back.bearing_step == pytest.approx(scan.bearing_step, abs=1e-9)
    assert back.T_base_laser == scan.T_base_laser
    assert abs(back.stamp - scan.stamp) <= 0.0005 + 1e-9 * abs(scan.stamp)


@pytest.mark.parametrize("bound", [0.001, 0.01, 0.05])
def test_a_scan_comes_back_within_the_bound(bound):
    scan = room_scan()
    alike(decode_scan(encode_scan(scan, ScanCodingSettings(bound))), scan, bound)


@settings(max_examples=60)
@given(
    st.lists(
        st.one_of(st.floats(0.0, 9.0, width=32), st.sampled_from([0.0, 8.0, np.inf, np.nan, -1.0])),
        min_size=1,
        max_size=40,
    ),
    st.integers(2, 3000),
    st.floats(-1e7, 2e9),
)
def test_any_readings_come_back_within_the_bound_and_mean_the_same(ranges, bound, stamp):
    scan = LaserScan(np.array(ranges, dtype=np.float32), -1.0, 0.05, 8.0, stamp)
    data = encode_scan(scan, ScanCodingSettings(bound / 10_000))
    back = decode_scan(data)
    alike(back, scan, bound / 10_000)
    assert encode_scan(back, ScanCodingSettings(bound / 10_000))  # it is a scan as any other
    np.testing.assert_array_equal(decode_scan(data).ranges, back.ranges)


def test_integration_sees_the_same_beams():
    scan = room_scan()
    back = decode_scan(encode_scan(scan))
    (ends, hits), (ends_back, hits_back) = beam_ends(scan, HERE), beam_ends(back, HERE)
    np.testing.assert_array_equal(hits, hits_back)
    np.testing.assert_allclose(ends_back, ends, atol=0.0100001)
    np.testing.assert_allclose(ends_back[~hits], ends[~hits], atol=1e-9)


def test_the_bytes_are_the_same_on_every_machine():
    # Compiled or not, whatever the processor: what one robot writes another one reads.
    assert encode_scan(room_scan()).hex() == (
        "19108da20f4244e017c545a56145646c48fa4bbedf2b973fff90aa6e3d400242dda731255c1d4e"
        "4a9ff9d7542bed1409f78ebec603c42ad80b088cb163603b41d23e239a18afacfa8a"
    )


def test_the_head_is_short():
    nothing = dataclasses.replace(room_scan(361), ranges=np.full(361, np.inf, dtype=np.float32))
    assert len(encode_scan(nothing)) <= 8 + 4


def test_beams_are_coded_in_the_shorter_direction():
    turned = set()
    for beams in (46, 51, 57):
        scan = room_scan(beams)
        mirrored = dataclasses.replace(scan, ranges=scan.ranges[::-1].copy())
        data, other = encode_scan(scan), encode_scan(mirrored)
        assert len(data) == len(other)
        np.testing.assert_array_equal(decode_scan(data).ranges, decode_scan(other).ranges[::-1])
        turned |= {data[1] & 1, other[1] & 1}
    assert turned == {0, 1}


@pytest.mark.parametrize(
    ("reach", "bound", "ends"),
    [
        (8.0, 0.01, []),
        (8.1, 0.01, [True, False, True]),
        (8.0, 0.02, [False, True, False, True]),
    ],
)
def test_usual_reaches_and_bounds_take_no_room(reach, bound, ends):
    scan = dataclasses.replace(room_scan(), range_max=reach)
    data = encode_scan(scan, ScanCodingSettings(error_bound_m=bound))
    assert decode_scan(data).range_max == reach
    assert data[1] >> 4 == (15 if ends else 1)
    assert [byte < 128 for byte in data[2 : 2 + len(ends)]] == ends


@pytest.mark.parametrize("stamp", [0.0, 12.345, -12.345, -0.0004])
def test_stamps_come_back_to_the_millisecond(stamp):
    data = encode_scan(dataclasses.replace(room_scan(), stamp=stamp))
    assert decode_scan(data).stamp == round(stamp, 3)


def test_known_noise_is_taken_at_its_word():
    scan = room_scan()
    data = encode_scan(scan, ScanCodingSettings(noise_m=0.03))
    assert data[0] & 15 == 9
    alike(decode_scan(data), scan, 0.01)


def test_a_layout_of_the_team_costs_no_bytes():
    scan = dataclasses.replace(room_scan(), T_base_laser=MOUNTED.T_base_laser)
    in_full = encode_scan(scan)
    named = encode_scan(scan, ScanCodingSettings(layouts=(*KNOWN_LAYOUTS, MOUNTED)))
    assert len(named) == len(in_full) - 42
    alike(decode_scan(in_full), scan, 0.01)
    alike(decode_scan(named, (*KNOWN_LAYOUTS, MOUNTED)), scan, 0.01)
    with pytest.raises(DamagedScanError):
        decode_scan(named)


def test_a_table_has_fifteen_layouts_at_most():
    with pytest.raises(ValueError, match="at most 15"):
        ScanCodingSettings(layouts=(MOUNTED,) * 16)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"stamp": math.nan}, "no time"),
        ({"stamp": 1e12}, "no time"),
        ({"range_max": math.inf}, "finite"),
        ({"range_max": 1e6}, "reach"),
        ({"ranges": np.zeros(0, dtype=np.float32)}, "beams"),
        ({"ranges": np.zeros(5000, dtype=np.float32)}, "beams"),
    ],
)
def test_scans_that_no_laser_makes_are_refused(change, says):
    with pytest.raises(ValueError, match=says):
        encode_scan(dataclasses.replace(room_scan(), **change))


# Small ones, so that this is quick in plain Python, too.
SMALL = (
    *(SensorLayout(beams, -1.0, 0.05) for beams in (1, 2, 20, 60, 61)),
    SensorLayout(60, -math.pi / 2, math.pi / 59),
)


def decoded_or_refused(data: bytes) -> None:
    try:
        scan = decode_scan(data, SMALL)
    except DamagedScanError:
        return
    assert 1 <= len(scan.ranges) <= 4096
    assert np.isfinite(scan.ranges).all()
    assert (scan.ranges >= 0.0).all()
    assert math.isfinite(scan.stamp)


WHOLE = encode_scan(room_scan(60), ScanCodingSettings(layouts=SMALL))


@settings(max_examples=40)
@given(st.data())
def test_damaged_bytes_are_another_scan_or_refused(data):
    whole = bytearray(WHOLE)
    for _ in range(data.draw(st.integers(0, 3))):
        whole[data.draw(st.integers(0, len(whole) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    decoded_or_refused(bytes(whole[: data.draw(st.integers(0, len(whole)))]))


@settings(max_examples=60)
@given(st.binary(max_size=60))
def test_random_bytes_are_some_scan_or_refused(data):
    decoded_or_refused(data)
    decoded_or_refused(b"\x24\x10\x00" + data)  # a head, and anything


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "no head"),
        (b"\x39\x10", "end within a number"),
        (b"\x39\x10\xff\xff\xff\xff\xff\xff\xff\x01", "too long"),
        (b"\x39\xe0\x00", "no error bound and reach have the number 14"),
        (b"\x39\xf0\x00\x40\x00", "bound"),
        (b"\xe9\x10\x00", "no laser has the number 14"),
        (b"\xf9\x10\x00\x01", "end within the layout"),
        (encode_scan(room_scan()) + b"\x01\x02\x03\x04\x05", "left after the last beam"),
    ],
)
def test_it_says_what_is_wrong(data, says):
    with pytest.raises(DamagedScanError, match=says):
        decode_scan(data)
