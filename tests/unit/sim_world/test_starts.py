import numpy as np
import pytest

from mapping.geometry import Pose2
from mapping.grid import GridGeometry
from sim_world.errors import WorldError
from sim_world.scene import GridScene, WallScene
from sim_world.starts import check_starts, start_poses
from sim_world.walls import build_walls

# A corridor of 6 x 1.6 m below a closed room.
SCENE = WallScene(
    build_walls([], [[0, 0, 6, 0], [6, 0, 6, 4], [6, 4, 0, 4], [0, 4, 0, 0], [0, 1.6, 6, 1.6]])
)
FIRST = Pose2(0.8, 0.8, 0.5)


def test_own_starts_come_first():
    own = (FIRST, Pose2(1.8, 0.8, 0.0))
    assert start_poses(SCENE, own, 1) == [FIRST]
    assert start_poses(SCENE, own, 2) == list(own)
    assert start_poses(SCENE, own, 0) == []


def test_more_robots_stand_near_the_first_on_its_side_of_the_wall():
    poses = start_poses(SCENE, (FIRST,), 6)
    assert poses == start_poses(SCENE, (FIRST,), 6)
    assert all(pose.theta == 0.5 for pose in poses)
    assert all(pose.y < 1.6 for pose in poses)
    gaps = [a.distance_to(b) for i, a in enumerate(poses) for b in poses[:i]]
    assert min(gaps) >= 0.8
    assert max(pose.x for pose in poses) < 5.5
    check_starts(SCENE, poses)


def test_a_world_without_starts_begins_at_the_left_of_its_largest_part():
    poses = start_poses(SCENE, (), 2)
    assert poses[0].x < 0.6 and poses[0].y > 1.6 and poses[0].theta == 0.0
    check_starts(SCENE, poses)


def test_too_many_robots():
    with pytest.raises(WorldError, match=r"room for \d+ robots around the first start, not for 60"):
        start_poses(SCENE, (FIRST,), 60)


def test_no_room_at_all():
    full = GridScene(np.ones((5, 5), dtype=bool), GridGeometry(0.1, 0.0, 0.0, 5, 5))
    with pytest.raises(WorldError, match="no free place large enough"):
        start_poses(full, (), 1)
    with pytest.raises(WorldError, match="room for 1 robots"):
        start_poses(full, (Pose2(0.2, 0.2, 0.0),), 2)
    with pytest.raises(WorldError, match="there is no free place in this world"):
        check_starts(full, [Pose2(0.2, 0.2, 0.0)])


def test_a_start_in_a_wall_is_refused_with_the_nearest_free_place():
    with pytest.raises(WorldError) as caught:
        check_starts(SCENE, [FIRST, Pose2(3.02, 1.5, 0.0)])
    assert str(caught.value) == (
        "robot 2 cannot start at (3.02, 1.50): something solid is there; "
        "the nearest free place is (3.03, 1.32)"
    )


def test_the_place_advised_is_free():
    for pose in (Pose2(3.02, 1.5, 0.0), Pose2(-9.0, 2.0, 0.0), Pose2(6.0, 4.0, 0.0)):
        with pytest.raises(WorldError) as caught:
            check_starts(SCENE, [FIRST, pose])
        x, y = str(caught.value).split("is (")[-1].rstrip(")").split(", ")
        check_starts(SCENE, [FIRST, Pose2(float(x), float(y), 0.0)])


def test_robots_may_not_start_in_each_other():
    with pytest.raises(WorldError, match=r"robot 2 .* another robot starts there; .* place is \("):
        check_starts(SCENE, [FIRST, Pose2(1.1, 0.8, 0.0)])
    outside = [Pose2(50.0, 50.0, 0.0)]
    with pytest.raises(WorldError, match="robot 1"):
        check_starts(SCENE, outside)
