import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import Pose2
from sim_world.lidar import RANGE_MIN, LaserSpec, measure
from sim_world.scene import WallScene
from sim_world.walls import build_walls

ROOM = WallScene(build_walls([], [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [0, 5, 0, 0]]))
HERE = Pose2(3.0, 2.0, 0.4)
NOBODY = np.empty((0, 3))


def test_default_laser_looks_all_around():
    bearings = LaserSpec().bearings
    assert len(bearings) == 360
    assert bearings[0] == -math.pi
    assert bearings[180] == pytest.approx(0.0)


def test_noise_has_the_stated_sigma_and_no_bias():
    spec = LaserSpec(beams=4000, bearing_step=2.0 * math.pi / 4000, sigma=0.03)
    exact = ROOM.cast(HERE, spec.bearings, spec.range_max)
    errors = measure(HERE, ROOM, NOBODY, spec, np.random.default_rng(1)) - exact
    assert abs(errors.mean()) < 0.003
    assert errors.std() == pytest.approx(0.03, rel=0.05)


def test_other_robots_are_seen():
    spec = LaserSpec(beams=1, bearing_start=0.0, sigma=0.0)
    ranges = measure(
        Pose2(1, 1, 0), ROOM, [[4.0, 1.0, 0.25], [6.0, 1.0, 0.25]], spec, np.random.default_rng(0)
    )
    assert ranges[0] == pytest.approx(2.75)


def test_the_same_draws_whatever_is_seen():
    spec = LaserSpec(beams=8, bearing_step=math.pi / 4)
    one, other = np.random.default_rng(3), np.random.default_rng(3)
    measure(HERE, ROOM, NOBODY, spec, one)
    measure(Pose2(1, 1, 0), ROOM, [[4.0, 1.0, 0.25]], LaserSpec(8, 0.0, 0.1, 0.5), other)
    assert one.random() == other.random()


@settings(max_examples=40, deadline=None)
@given(st.floats(0.5, 9.0), st.floats(0.0, 3.0), st.integers(0, 1000), st.floats(0.0, 7.99))
def test_noise_never_changes_whether_a_beam_returns(range_max, sigma, seed, x):
    spec = LaserSpec(beams=36, bearing_step=math.pi / 18, range_max=range_max, sigma=sigma)
    pose = Pose2(x, 2.0, 0.0)
    exact = ROOM.cast(pose, spec.bearings, range_max)
    ranges = measure(pose, ROOM, NOBODY, spec, np.random.default_rng(seed))
    assert ranges.dtype == np.float32
    returned = exact < range_max
    assert (ranges[~returned] == np.float32(range_max)).all()
    assert (ranges[returned] < np.float32(range_max)).all()
    assert (ranges >= np.float32(RANGE_MIN)).all()
