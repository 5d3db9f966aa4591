"""Loop closures against the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from expedition.experiments.slam_teams import closure_errors
from expedition.results.record import PoseGraphRecord, RobotRecord


def test_a_closure_is_as_wrong_as_the_true_ways_say() -> None:
    # One drives along x, the other stands at (1, 2), turned to the left.
    along = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0]])
    stands = np.array([[0.0, 1.0, 2.0, 0.5 * math.pi], [2.0, 1.0, 2.0, 0.5 * math.pi]])
    robots = {
        "a": RobotRecord("a", track_world=along),
        "b": RobotRecord("b", track_world=stands),
    }
    graph = PoseGraphRecord(
        chains={"b": np.zeros((1, 3)), "a": np.zeros((2, 3))},
        ends=np.array([(0, 0, 0, 1), (0, 1, 1, 0), (0, 0, 1, 0)]),
        measured=np.array([(9.0, 9.0, 9.0), (0.0, 2.0, 0.5 * math.pi), (1.0, 2.4, 1.5)]),
        information=np.tile(np.eye(3), (3, 1, 1)),
        stamps={"a": np.array([0.0, 1.0]), "b": np.array([1.5])},
        doubted=np.array([False, True, True]),
    )
    errors = closure_errors(graph, robots)
    turn = 0.5 * math.pi - 1.5
    assert errors[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert errors[1] == pytest.approx([0.4, turn, math.hypot(0.4, turn)])
