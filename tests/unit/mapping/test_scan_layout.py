from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan
from mapping.scan_layout import (
    BEAMS_MOST,
    IN_FULL,
    KNOWN_LAYOUTS,
    SensorLayout,
    layout_of,
    number_of,
    pack_layout,
    unpack_layout,
)

ODD = SensorLayout(77, -0.7, -0.02, Pose2(0.1, 0.0, math.pi))


def test_known_layouts_have_numbers_and_differ():
    assert [number_of(layout, KNOWN_LAYOUTS) for layout in KNOWN_LAYOUTS] == list(
        range(len(KNOWN_LAYOUTS))
    )
    assert len(KNOWN_LAYOUTS) < IN_FULL


def test_rounding_does_not_matter_and_the_mounting_does():
    known = KNOWN_LAYOUTS[3]
    scan = LaserScan(np.zeros(361, dtype=np.float32), -math.pi / 2, math.pi / 360, 8.0, 0.0)
    assert number_of(layout_of(scan), KNOWN_LAYOUTS) == 3
    moved = dataclasses.replace(known, T_base_laser=Pose2(0.1, 0.0, 0.0))
    assert number_of(moved, KNOWN_LAYOUTS) == IN_FULL
    assert number_of(ODD, (*KNOWN_LAYOUTS, ODD)) == len(KNOWN_LAYOUTS)


def test_a_layout_in_full_comes_back_as_it_is():
    assert unpack_layout(b"x" + pack_layout(ODD) + b"y", 1) == (ODD, 43)
    assert unpack_layout(pack_layout(KNOWN_LAYOUTS[0]), 0)[0].T_base_laser is IDENTITY


def test_bytes_that_end_too_soon_are_no_layout():
    with pytest.raises(ValueError, match="end within"):
        unpack_layout(pack_layout(ODD)[:-1], 0)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"beams": 0}, "beams"),
        ({"beams": BEAMS_MOST + 1}, "beams"),
        ({"bearing_start": math.nan}, "finite"),
        ({"T_base_laser": Pose2(math.inf, 0.0, 0.0)}, "finite"),
        ({"bearing_step": 7.0}, "around"),
        ({"bearing_step": math.nan}, "around"),
    ],
)
def test_there_is_no_such_laser(change, says):
    with pytest.raises(ValueError, match=says):
        dataclasses.replace(ODD, **change)
