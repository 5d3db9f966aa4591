from __future__ import annotations

import math

import pytest
from pydantic import TypeAdapter, ValidationError

from protocol.body import Body, Lidar, VictimDetector, WireBody


def test_beams_span_the_field_of_view() -> None:
    half = Lidar(field_of_view_deg=180.0, beams=181)
    assert half.bearing_start == pytest.approx(-0.5 * math.pi)
    assert half.bearing_step == pytest.approx(math.radians(1.0))


def test_a_full_turn_does_not_repeat_its_first_beam() -> None:
    full = Lidar(field_of_view_deg=360.0, beams=360)
    assert full.bearing_step == pytest.approx(math.radians(1.0))
    last = full.bearing_start + 359 * full.bearing_step
    assert last < math.pi


def test_a_settings_file_with_an_unknown_key_is_refused() -> None:
    with pytest.raises(ValidationError):
        Body.model_validate({"radius_m": 0.2, "wings": 2})


def test_a_peer_of_a_newer_minor_version_may_know_more_of_a_body() -> None:
    table = {"radius_m": 0.2, "wings": 2, "lidar": {"beams": 90, "colour": "red"}}
    body = TypeAdapter(WireBody).validate_python(table)
    assert body == Body(radius_m=0.2, lidar=Lidar(beams=90))


@pytest.mark.parametrize("value", [3, None, {"radius_m": -1.0}, {"lidar": 5}, {"drive": [1]}])
def test_what_is_no_body_is_refused(value: object) -> None:
    with pytest.raises(ValidationError):
        TypeAdapter(WireBody).validate_python(value)


def test_the_wire_tells_of_a_victim_detector_only_where_there_is_one() -> None:
    wire = TypeAdapter(WireBody)
    without = wire.dump_python(Body())
    assert sorted(without) == ["drive", "lidar", "radius_m"]
    body = Body(victim_detector=VictimDetector(range_m=5.0))
    assert wire.validate_python(wire.dump_python(body)) == body
    assert wire.validate_python(without) == Body()
