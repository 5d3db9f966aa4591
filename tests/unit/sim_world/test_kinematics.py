import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import IDENTITY, Pose2
from sim_world.kinematics import Body, Motion, OdometryNoise, arc, limited, noisy_arc, step_bodies
from sim_world.scene import WallScene
from sim_world.walls import build_walls

ROOM = WallScene(build_walls([], [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [0, 5, 0, 0]]))
SILENT = OdometryNoise(0.0, 0.0, 0.0)
BRISK = Body(acceleration_max=math.inf, turn_acceleration_max=math.inf, noise=SILENT)


def _drive(motions, commands, dt, count, body=BRISK, scene=ROOM, seed=0):
    rng = np.random.default_rng(seed)
    bodies = [body] * len(motions)
    odometry, bumps = [IDENTITY] * len(motions), [False] * len(motions)
    for _ in range(count):
        steps = step_bodies(motions, commands, dt, scene, bodies, rng)
        motions = [step.motion for step in steps]
        odometry = [T @ s.T_before_after for T, s in zip(odometry, steps, strict=True)]
        bumps = [b or s.bumped for b, s in zip(bumps, steps, strict=True)]
    return motions, odometry, bumps


def test_an_arc_is_exact_for_any_step_length():
    ends = []
    for count in (1, 10, 100):
        motions, odometry, bumps = _drive(
            [Motion(Pose2(3.0, 2.0, 0.3))], [(0.4, 0.5)], 2.0 / count, count
        )
        ends.append(motions[0].T_world_base.as_array())
        assert (Pose2(3.0, 2.0, 0.3) @ odometry[0]).as_array() == pytest.approx(ends[-1])
        assert bumps == [False]
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
    assert ends[2] == pytest.approx(ends[0], abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.floats(-1.0, 1.0), st.floats(-3.0, 3.0), st.integers(2, 7))
def test_arcs_compose(distance, turn, count):
    T = IDENTITY
    for _ in range(count):
        T = T @ arc(distance / count, turn / count)
    whole = arc(distance, turn)
    assert (T.x, T.y) == pytest.approx((whole.x, whole.y), abs=1e-9)


def test_limits_of_speed_and_acceleration():
    body = Body()
    assert limited(Motion(IDENTITY), (9.0, -9.0), 0.1, body) == pytest.approx((0.1, -0.3))
    assert limited(Motion(IDENTITY, 0.5, -1.2), (9.0, -9.0), 0.1, body) == (0.5, -1.2)
    assert limited(Motion(IDENTITY, 0.5, 0.0), (0.0, 0.0), 0.1, body) == pytest.approx((0.4, 0.0))


def test_a_body_stops_at_a_wall_a_millimetre_away():
    motions, _, bumps = _drive([Motion(Pose2(6.0, 2.0, 0.0))], [(0.5, 0.0)], 0.1, 60)
    assert bumps == [True]
    pose = motions[0].T_world_base
    assert 7.75 - 0.0015 < pose.x <= 7.75
    assert motions[0].speed == 0.0
    assert not ROOM.collides(pose.x, pose.y, 0.25)
    # it can turn on the spot and drive away
    motions, _, bumps = _drive(motions, [(0.0, 1.0)], 0.1, 10)
    assert bumps == [False]
    motions, _, bumps = _drive(motions, [(-0.5, 0.0)], 0.1, 10)
    assert bumps == [False]
    assert motions[0].T_world_base.x < 7.6


def test_one_long_step_does_not_jump_through_a_wall():
    scene = WallScene(build_walls([], [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [4, 0, 4, 5]]))
    motions, _, bumps = _drive([Motion(Pose2(2.0, 2.0, 0.0))], [(0.5, 0.0)], 8.0, 1, scene=scene)
    assert bumps == [True]
    assert motions[0].T_world_base.x == pytest.approx(3.75, abs=2e-3)


def test_robots_do_not_drive_into_each_other():
    motions, _, bumps = _drive(
        [Motion(Pose2(2.0, 2.0, 0.0)), Motion(Pose2(4.0, 2.0, math.pi))],
        [(0.5, 0.0), (0.5, 0.0)],
        0.1,
        40,
    )
    a, b = (motion.T_world_base for motion in motions)
    assert bumps == [True, True]
    assert 0.5 <= a.distance_to(b) < 0.505


def test_a_body_that_overlaps_something_can_back_out_but_not_go_deeper():
    start = Motion(Pose2(7.9, 2.0, 0.0))
    motions, _, bumps = _drive([start], [(0.5, 0.0)], 0.1, 3)
    assert bumps == [True]
    assert motions[0].T_world_base.x == 7.9
    motions, _, bumps = _drive([start], [(-0.5, 0.0)], 0.1, 10)
    assert bumps == [False]
    assert motions[0].T_world_base.x == pytest.approx(7.4)


@pytest.mark.parametrize("count", [4, 40])
def test_the_wheels_error_does_not_depend_on_the_step_length(count):
    draws = np.random.default_rng(5).standard_normal((3000, count, 2))
    distances, headings, turns = [], [], []
    for run in draws[: 12000 // count]:
        straight = [noisy_arc(1.0 / count, 0.0, OdometryNoise(), d) for d in run]
        distances.append(sum(math.copysign(math.hypot(T.x, T.y), T.x) for T in straight))
        headings.append(sum(T.theta for T in straight))
        turns.append(sum(noisy_arc(0.0, 1.0 / count, OdometryNoise(), d).theta for d in run))
    assert np.std(distances) == pytest.approx(0.05, rel=0.12)
    assert np.std(headings) == pytest.approx(math.radians(2.0), rel=0.12)
    assert np.std(turns) == pytest.approx(0.05, rel=0.12)
    assert np.mean(turns) == pytest.approx(1.0, abs=0.01)


def test_standing_still_adds_no_error_but_makes_its_draws():
    bodies = [Body(), Body()]
    motions = [Motion(Pose2(2, 2, 0)), Motion(Pose2(5, 2, 0))]
    rng, other = np.random.default_rng(9), np.random.default_rng(9)
    steps = step_bodies(motions, [(0.0, 0.0), (0.5, 0.0)], 0.1, ROOM, bodies, rng)
    moving = step_bodies(motions, [(0.5, 0.4), (0.5, 0.0)], 0.1, ROOM, bodies, other)
    assert steps[0].T_before_after == Pose2(0.0, 0.0, 0.0)
    assert steps[0].travelled == 0.0
    assert steps[1] == moving[1]
    assert step_bodies([], [], 0.1, ROOM, [], rng) == []


def test_bit_identical_for_the_same_seed():
    motions = [Motion(Pose2(2.0, 2.0, 0.1)), Motion(Pose2(2.9, 2.2, 3.0))]
    commands = [(0.5, 0.3), (0.4, -0.2)]
    assert _drive(motions, commands, 0.1, 30, Body()) == _drive(motions, commands, 0.1, 30, Body())
