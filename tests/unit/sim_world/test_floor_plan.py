import math

import numpy as np
import pytest

from sim_world.errors import WorldError
from sim_world.floor_plan import FloorPlan, merged, solids_of
from sim_world.scene import WallScene
from sim_world.walls import build_walls


def _plan(**keys):
    return FloorPlan.model_validate(
        {"name": "test", "description": "a test", "size_m": [10.0, 6.0], **keys}
    )


def _scene(plan):
    return WallScene(build_walls(*solids_of(plan)))


def test_an_empty_drawing_is_a_closed_hall():
    scene = _scene(_plan())
    assert scene.extent == pytest.approx((-0.075, -0.075, 10.075, 6.075))
    assert scene.clearance(0.3, 3.0, 1.0) == pytest.approx(0.225)


def test_neighbouring_rooms_share_their_wall_and_a_door_opens_it():
    rooms = [[0, 0, 4, 6], [4, 0, 10, 6]]
    closed = _scene(_plan(rooms=rooms))
    assert closed.collides(4.0, 3.0, 0.1)
    opened = _scene(_plan(rooms=rooms, doors=[[4.0, 3.0, 1.0]]))
    assert opened.clearance(4.0, 3.0, 2.0) == pytest.approx(0.5)


def test_a_door_may_reach_over_the_end_of_a_wall():
    scene = _scene(_plan(walls=[[2, 0, 2, 2]], doors=[[2.0, 1.8, 1.0]]))
    assert not scene.collides(2.0, 2.0, 0.5)
    gone = _scene(_plan(walls=[[2, 2, 3, 2]], doors=[[2.5, 2.0, 3.0]]))
    assert not gone.collides(2.5, 2.0, 1.0)


def test_a_door_on_no_wall_is_refused():
    with pytest.raises(WorldError, match=r"doors\[1\] at \(5, 5\) lies on no wall"):
        solids_of(_plan(rooms=[[0, 0, 4, 6]], doors=[[4, 3, 1], [5, 5, 1]]))


def test_slanted_walls_polylines_and_their_doors():
    scene = _scene(_plan(polylines=[[[1, 1], [4, 5], [8, 5]]], doors=[[2.5, 3.0, 1.0]]))
    assert scene.clearance(2.5, 3.0, 2.0) == pytest.approx(0.5, abs=1e-9)
    assert scene.collides(6.0, 5.0, 0.1)
    assert scene.clearance(6.0, 4.5, 1.0) == pytest.approx(0.425)


def test_walls_without_thickness_are_bare_segments():
    solids, bare = solids_of(_plan(wall_thickness_m=0.0, walls=[[2, 1, 2, 2], [3, 3, 3, 3]]))
    assert solids == []
    assert len(bare) == 6
    plan = _plan(wall_thickness_m=0.0, walls=[[3, 3, 3, 3]], doors=[[0.0, 3.0, 1.0]])
    assert len(solids_of(plan)[1]) == 6


def test_furniture():
    scene = _scene(
        _plan(
            boxes=[[3, 2, 2, 1]],
            turned_boxes=[[5, 3, 2, 1, 90], [7, 3, 2.0, 1.0, 45]],
            pillars=[[9, 3, 0.4]],
        )
    )
    assert scene.clearance(1.6, 1.5, 1.0) == pytest.approx(0.4)
    assert scene.clearance(5.0, 4.2, 1.0) == pytest.approx(0.2)
    step = math.sqrt(0.5)
    assert scene.clearance(7 + 1.3 * step, 3 + 1.3 * step, 1.0) == pytest.approx(0.3)
    assert scene.collides(9.0, 3.0, 0.1)
    assert scene.clearance(8.4, 3.0, 1.0) == pytest.approx(0.2)


def test_overlapping_lines_are_merged():
    lines = [(0, 1, 4, 1), (3, 1, 6, 1), (7, 1, 8, 1), (2, 0, 2, 3), (2, 5, 2, 3), (0, 0, 1, 1)]
    assert sorted(merged(lines)) == [(0, 0, 1, 1), (0, 1, 6, 1), (2, 0, 2, 5), (7, 1, 8, 1)]


def test_merging_keeps_what_is_covered():
    rng = np.random.default_rng(2)
    lines = [(float(a), 1.0, float(b), 1.0) for a, b in rng.integers(0, 40, (12, 2)) if a != b]
    union = merged(lines)
    for x in np.arange(0.5, 40.0):
        before = any(min(a, c) < x < max(a, c) for a, _, c, _ in lines)
        assert before == any(a < x < c for a, _, c, _ in union)
