"""Walls drawn twice."""

from __future__ import annotations

import math

import numpy as np
import pytest

from expedition.experiments.double_walls import WallThickness, wall_thickness
from mapping.geometry import Pose2
from mapping.grid import CLEAR, OBSTACLE, GridGeometry
from sim_world.truth import CoverageJudge, reachable_area

EDGE = 0.05
# Two rooms of 4 x 4 m, a wall of 0.15 m with a door between them, massive all around.
GEOMETRY = GridGeometry(EDGE, 0.0, 0.0, 120, 200)
STARTS = [(2.0, 3.0)]


def rooms() -> np.ndarray:
    solid = np.ones(GEOMETRY.shape, dtype=bool)
    solid[20:100, 20:98] = False
    solid[20:100, 101:180] = False
    solid[50:72, 98:101] = False
    return solid


SOLID = rooms()
REACHABLE = reachable_area(SOLID, GEOMETRY, STARTS, 0.25)


def faces(solid: np.ndarray) -> np.ndarray:
    """Return the classes of a perfect map: solid cells that touch a free one are occupied."""
    near = np.zeros_like(solid)
    for axis, by in ((0, 1), (0, -1), (1, 1), (1, -1)):
        near |= np.roll(~solid, by, axis)
    classes = np.where(solid, 0, CLEAR).astype(np.uint8)
    classes[solid & near] = OBSTACLE
    return classes


def judged(classes: np.ndarray, pose: Pose2 | None = None) -> WallThickness:
    return wall_thickness(
        SOLID, REACHABLE, GEOMETRY, classes, GEOMETRY, pose or Pose2(0.0, 0.0, 0.0)
    )


def shifted(classes: np.ndarray, rows: int, cols: int) -> np.ndarray:
    return np.roll(np.roll(classes, rows, 0), cols, 1)


def twice(classes: np.ndarray, cells: int) -> np.ndarray:
    """Return a map in which all walls are drawn again, shifted to the right and up."""
    doubled = classes.copy()
    doubled[shifted(classes, cells, cells) == OBSTACLE] = OBSTACLE
    return doubled


def test_a_right_map_has_no_double_walls():
    found = judged(faces(SOLID))
    assert found.cuts > 300
    assert found.doubled == 0.0
    assert found.excess_p95_m < EDGE


@pytest.mark.parametrize("cells", [4, 5, 6, 7])
def test_walls_doubled_by_0_2_m_and_more_are_seen(cells: int):
    found = judged(twice(faces(SOLID), cells))
    assert found.doubled > 0.8
    assert found.excess_m > 0.1


def test_a_map_that_is_whole_but_out_of_place_is_not_blamed():
    found = judged(shifted(faces(SOLID), 3, -3))
    assert found.doubled < 0.03


def test_scores_with_a_tolerance_hardly_see_what_this_one_sees():
    doubled = twice(faces(SOLID), 3)
    judge = CoverageJudge(SOLID, GEOMETRY, REACHABLE)
    scores = judge.scores(doubled, GEOMETRY, Pose2(0.0, 0.0, 0.0))
    assert scores.precision_occupied > 0.99
    assert judged(doubled).doubled > 0.1


def test_half_a_map_doubled_is_half_as_bad():
    half = faces(SOLID)
    half[:, :100] = twice(half, 4)[:, :100]
    assert 0.3 < judged(half).doubled < 0.6


def test_maps_in_a_frame_of_their_own():
    pose = Pose2(1.0, -2.0, 0.5 * math.pi)
    larger = GridGeometry(EDGE, -10.0, -10.0, 400, 400)
    for classes, low, high in ((faces(SOLID), 0.0, 0.02), (twice(faces(SOLID), 4), 0.8, 1.0)):
        points = pose.inverse().apply(GEOMETRY.centres_of(np.argwhere(classes == OBSTACLE)))
        turned = np.zeros(larger.shape, dtype=np.uint8)
        cells = larger.cells_at(points)
        turned[cells[:, 0], cells[:, 1]] = OBSTACLE
        found = wall_thickness(SOLID, REACHABLE, GEOMETRY, turned, larger, pose)
        assert low <= found.doubled <= high


def test_nothing_to_cut():
    nothing = WallThickness(0, 0.0, 0.0, 0.0)
    assert judged(np.zeros(GEOMETRY.shape, dtype=np.uint8)) == nothing
    empty = np.zeros_like(SOLID)
    assert (
        wall_thickness(empty, ~empty, GEOMETRY, faces(SOLID), GEOMETRY, Pose2(0, 0, 0)) == nothing
    )
