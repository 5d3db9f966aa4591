from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import Pose2
from mapping.motion_model import MotionModel
from mapping.pose_cloud import composed, drawn, turned


def test_composing_many_is_composing_each() -> None:
    rng = np.random.default_rng(1)
    poses, moves = rng.uniform(-3.0, 3.0, (5, 3)), rng.uniform(-3.0, 3.0, (5, 3))
    each = [(Pose2(*p) @ Pose2(*m)).as_tuple() for p, m in zip(poses, moves, strict=True)]
    assert composed(poses, moves) == pytest.approx(np.array(each))
    same = [(Pose2(*p) @ Pose2(*moves[0])).as_tuple() for p in poses]
    assert composed(poses, moves[0]) == pytest.approx(np.array(same))


def test_poses_are_drawn_with_mean_and_covariance() -> None:
    covariance = MotionModel().covariance(Pose2(1.0, 0.0, 0.3))
    means = np.tile([1.0, 2.0, math.pi - 0.01], (20_000, 1))
    cloud = drawn(means, np.tile(covariance, (20_000, 1, 1)), np.random.default_rng(2))
    assert np.abs(cloud[:, 2]).max() <= math.pi
    off = cloud - means
    off[:, 2] = np.arctan2(np.sin(off[:, 2]), np.cos(off[:, 2]))
    assert off.mean(axis=0) == pytest.approx(np.zeros(3), abs=2e-3)
    assert np.cov(off.T) == pytest.approx(covariance, abs=2e-4)


def test_a_turned_covariance_is_that_of_the_motion_in_the_turned_frame() -> None:
    motion, move = MotionModel(), Pose2(1.0, 0.2, 0.1)
    _, there = motion.propagate(Pose2(3.0, 1.0, 0.7), np.zeros((3, 3)), move)
    assert turned(motion.covariance(move), 0.7) == pytest.approx(there)
