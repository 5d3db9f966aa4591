"""Constraints as arrays are the edges of a pose graph."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.constraints import Constraints
from mapping.geometry import pose_from
from mapping.pose_graph import Edge, PoseGraph


def test_errors_are_those_of_the_edges() -> None:
    rng = np.random.default_rng(4)
    poses, ends = rng.normal(size=(4, 3)), np.array([[0, 1], [3, 1], [2, 3]])
    roots = rng.normal(size=(3, 3, 3))
    constraints = Constraints(ends, rng.normal(size=(3, 3)), roots @ roots.transpose(0, 2, 1))
    graph = PoseGraph()
    for pose in poses:
        graph.add(pose_from(pose))
    edges = [
        Edge(int(i), int(j), pose_from(z), information)
        for (i, j), z, information in zip(
            ends, constraints.measured, constraints.information, strict=True
        )
    ]
    expected = [graph.error(edge)[1] for edge in edges]
    assert constraints.squared_errors(poses) == pytest.approx(expected)
    some = constraints.only(np.array([True, False, True]))
    assert len(some) == 2
    assert some.squared_errors(poses) == pytest.approx([expected[0], expected[2]])
    assert constraints.only(np.array([1])).squared_errors(poses) == pytest.approx(expected[1:2])
