from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from mapping.geometry import Pose2
from protocol.fields import LARGEST_COORDINATE, ArrayField, Name, PoseField, is_name

POSES = TypeAdapter(PoseField)
NAMES = TypeAdapter(Name)
TABLE = ArrayField("float32", (None, 2), 8)


def test_an_array_of_the_declared_kind_is_taken_and_locked() -> None:
    given_array = np.zeros((3, 2), dtype=np.float32)
    taken = TABLE.check(given_array)
    assert not taken.flags.writeable
    assert given_array.flags.writeable  # the sender's own array stays as it was
    assert TABLE.check(taken) is taken


def test_an_array_with_gaps_is_made_contiguous() -> None:
    strided = np.arange(12, dtype=np.float32).reshape(6, 2)[::2]
    taken = TABLE.check(strided)
    assert taken.flags.c_contiguous
    assert (taken == strided).all()


@pytest.mark.parametrize(
    ("value", "why"),
    [
        ([[1.0, 2.0]], "not an array"),
        (np.zeros((3, 2)), "dtype"),
        (np.zeros(2, dtype=np.float32), "dimensions"),
        (np.zeros((3, 3), dtype=np.float32), "shape"),
        (np.zeros((5, 2), dtype=np.float32), "at most 8"),
        (np.array([[np.nan, 0.0]], dtype=np.float32), "finite"),
        (np.array([[np.inf, 0.0]], dtype=np.float32), "finite"),
    ],
)
def test_any_other_array_is_refused(value: Any, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        TABLE.check(value)


def test_an_array_may_hold_anything_where_that_is_allowed() -> None:
    free = ArrayField("float32", (None,), 8, finite=False)
    assert np.isnan(free.check(np.array([np.nan], dtype=np.float32))).all()
    bytes_field = ArrayField("uint8", (None,), 8)
    assert bytes_field.check(np.zeros(3, dtype=np.uint8)).size == 3


def test_a_pose_is_three_numbers_and_its_angle_is_wrapped() -> None:
    assert POSES.validate_python([1, 2.0, 0.5]) == Pose2(1.0, 2.0, 0.5)
    assert POSES.validate_python((0.0, 0.0, 3.0 * math.pi)).theta == pytest.approx(math.pi)
    assert POSES.validate_python(Pose2(1.0, 2.0, 3.0)) == Pose2(1.0, 2.0, 3.0)
    assert POSES.dump_python(Pose2(1.0, 2.0, 3.0)) == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    "value",
    [
        None,
        "pose",
        [1.0, 2.0],
        [1.0, 2.0, "3"],
        [1.0, 2.0, True],
        [1.0, 2.0, math.nan],
        [math.inf, 0.0, 0.0],
        [0.0, -2.0 * LARGEST_COORDINATE, 0.0],
        [0.0, 0.0, 1.0e4],
        Pose2(math.nan, 0.0, 0.0),
        Pose2(1.0e9, 0.0, 0.0),
    ],
)
def test_what_is_no_pose_is_refused(value: Any) -> None:
    with pytest.raises(ValidationError):
        POSES.validate_python(value)


@given(st.text(max_size=40))
def test_a_name_is_short_and_safe_to_print(text: str) -> None:
    allowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_."
    good = 1 <= len(text) <= 32 and all(letter in allowed for letter in text)
    assert is_name(text) == good
    if good:
        assert NAMES.validate_python(text) == text
    else:
        with pytest.raises(ValidationError):
            NAMES.validate_python(text)


def test_a_name_with_a_line_end_is_none() -> None:
    assert not is_name("robot1\n")
