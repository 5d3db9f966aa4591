from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from mapping.observation_coding import (
    Observation,
    ObservationError,
    decode_observation,
    encode_observation,
)
from mapping.scan_coding import ScanCodingSettings
from tests.unit.mapping.rectangle import rectangle_scan

SETTINGS = ScanCodingSettings(error_bound_m=0.01)
SCAN = rectangle_scan(Pose2(1.0, 1.0, 0.3), beams=16)
coordinates = st.floats(-300.0, 300.0)


def seen(victims: list[tuple[float, float]]) -> Observation:
    return Observation(SCAN, np.array(victims, dtype=np.float64).reshape(-1, 2))


@settings(max_examples=25)
@given(st.lists(st.tuples(coordinates, coordinates), max_size=4))
def test_scan_and_victims_come_back_as_well_as_they_are_coded(
    victims: list[tuple[float, float]],
) -> None:
    back = decode_observation(encode_observation(seen(victims), SETTINGS))
    assert back.scan.stamp == SCAN.stamp
    np.testing.assert_allclose(back.scan.ranges, SCAN.ranges, atol=0.0101)
    assert back.victims_base.shape == (len(victims), 2)
    np.testing.assert_allclose(back.victims_base, seen(victims).victims_base, atol=0.0051)


def test_what_is_coded_again_is_the_same_to_the_last_bit() -> None:
    once = encode_observation(seen([(1.234, -0.5)]), SETTINGS)
    assert encode_observation(decode_observation(once), SETTINGS) == once


def test_victims_beyond_all_reason_are_cut_off() -> None:
    many = encode_observation(seen([(1.0, 2.0)] * 300), SETTINGS)
    assert len(decode_observation(many).victims_base) == 255
    far = decode_observation(encode_observation(seen([(1e9, -1e9)]), SETTINGS))
    assert far.victims_base.tolist() == [[327.67, -327.67]]


@pytest.mark.parametrize("data", [b"", b"\x01", b"\x02\x00\x00\x00\x00\x00\x00", b"\x00", b"\x00?"])
def test_bytes_that_hold_none_are_refused(data: bytes) -> None:
    with pytest.raises(ObservationError):
        decode_observation(data)


@given(st.binary(max_size=80))
def test_whatever_the_bytes_nothing_but_a_refusal_comes_of_them(data: bytes) -> None:
    try:
        decode_observation(data)
    except ObservationError as error:
        assert str(error)


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.integers(1, 255))
def test_damaged_bytes_are_an_observation_or_are_refused(place: int, change: int) -> None:
    data = bytearray(encode_observation(seen([(1.0, 2.0)]), SETTINGS))
    data[place % len(data)] ^= change
    try:
        back = decode_observation(bytes(data))
    except ObservationError:
        return
    assert np.isfinite(back.victims_base).all()
