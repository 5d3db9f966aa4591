"""Getting loose."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import Pose2
from robot_agent.navigation_settings import RecoverySettings
from robot_agent.recovery import Recovery, StallWatch, room_behind
from robot_agent.right_of_way import Sighting, Teammate
from tests.unit.robot_agent.closed_loop import Grid, planning_map_of

SETTINGS = RecoverySettings()


def test_a_robot_that_drives_is_not_stalled() -> None:
    watch = StallWatch(SETTINGS)
    watch.start(0.0)
    for k in range(400):
        assert not watch.stalled(0.1 * k, 0.05 * k, 0.0, 30.0 - 0.05 * k, False)


def test_one_that_stands_is() -> None:
    watch = StallWatch(SETTINGS)
    watch.start(0.0)
    stalled = [0.1 * k for k in range(60) if watch.stalled(0.1 * k, 1.0, 1.0, 5.0, False)]
    assert stalled[0] == pytest.approx(SETTINGS.stalled_after_s + 0.1)
    watch.excuse(6.0)
    assert not watch.stalled(6.1, 1.0, 1.0, 5.0, False)


def test_one_that_goes_to_and_fro_is() -> None:
    watch = StallWatch(SETTINGS)
    watch.start(0.0)
    times = [
        0.1 * k for k in range(300) if watch.stalled(0.1 * k, math.sin(0.1 * k), 0.0, 5.0, False)
    ]
    assert times[0] > SETTINGS.no_progress_after_s


def test_a_bump_counts_when_it_lasts() -> None:
    watch = StallWatch(SETTINGS)
    watch.start(0.0)
    assert not watch.stalled(0.1, 0.0, 0.0, 5.0, True)
    assert not watch.stalled(0.2, 0.0, 0.0, 5.0, False)
    assert not watch.stalled(0.3, 0.0, 0.0, 5.0, True)
    assert watch.stalled(0.6, 0.0, 0.0, 5.0, True)


def test_recoveries_are_counted_until_way_is_gained() -> None:
    watch = StallWatch(SETTINGS)
    watch.start(0.0)
    assert watch.recovering(1.0, 5.0) == 1
    assert watch.recovering(2.0, 4.8) == 2
    watch.stalled(3.0, 0.0, 0.0, 4.0, False)
    assert watch.recovering(4.0, 4.0) == 3
    watch.stalled(5.0, 0.0, 0.0, 2.0, False)
    assert watch.recovering(6.0, 2.0) == 1


def test_back_up_then_turn_then_through() -> None:
    recovery = Recovery.begin(0.0, Pose2(0, 0, 0), 0.5, 1, SETTINGS)
    assert recovery.step(0.1, Pose2(0, 0, 0), SETTINGS, 1.2) == (-0.12, 0.0)
    speed, turn = recovery.step(1.8, Pose2(-0.2, 0, 0), SETTINGS, 1.2)
    assert speed == 0.0 and turn > 0.0
    assert recovery.step(2.4, Pose2(-0.2, 0, 0.7), SETTINGS, 1.2) is not None
    assert recovery.step(2.5, Pose2(-0.2, 0, 0.85), SETTINGS, 1.2) is None


def test_without_room_it_turns_at_once_and_the_other_way_next_time() -> None:
    recovery = Recovery.begin(0.0, Pose2(0, 0, 0), 0.0, 2, SETTINGS)
    speed, turn = recovery.step(0.0, Pose2(0, 0, 0), SETTINGS, 1.2)
    assert speed == 0.0 and turn < 0.0
    assert recovery.step(2.0, Pose2(0, 0, 0), SETTINGS, 1.2) is None


def test_backing_up_ends_in_time_even_if_the_wheels_slip() -> None:
    recovery = Recovery.begin(0.0, Pose2(0, 0, 0), 0.2, 1, SETTINGS)
    assert recovery.step(5.0, Pose2(0, 0, 0), SETTINGS, 1.2)[0] == 0.0


def test_room_behind_by_the_map_and_the_teammates() -> None:
    held = planning_map_of(Grid.walled(4.0, 3.0, 0.1))
    assert room_behind(held, Pose2(2, 1.5, 0), [], 0.25, 0.3) == pytest.approx(0.3)
    assert room_behind(held, Pose2(0.6, 1.5, 0), [], 0.25, 0.3) < 0.15
    assert room_behind(held, Pose2(0.6, 1.5, math.pi), [], 0.25, 0.3) == pytest.approx(0.3)
    assert room_behind(held, Pose2(-9.0, 1.5, 0), [], 0.25, 0.3) == pytest.approx(0.3)
    mate = Teammate("b", Pose2(1.2, 1.5, 0.0), 0.0, 0.25, np.empty((0, 2)), False)
    other = Sighting(mate, 1.2, 1.5, 0.0, 0.0, np.array([[1.2, 1.5]]), 0.0, False)
    assert room_behind(held, Pose2(2, 1.5, 0), [other], 0.25, 0.3) == 0.0
