from __future__ import annotations

import math

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan
from mapping.seen_free import count_contradictions, count_seen_free
from tests.unit.mapping.rectangle import rectangle_scan

MIDDLE = Pose2(2.0, 1.5, 0.3)


def count(points: list[tuple[float, float]], scan: LaserScan, T_map_base: Pose2 = MIDDLE) -> int:
    return count_seen_free(np.array(points), [(scan, T_map_base)], 0.3)


def test_points_inside_a_room_are_free_and_those_at_its_walls_and_beyond_are_not() -> None:
    scan = rectangle_scan(MIDDLE)
    assert count([(1.0, 1.0), (3.0, 2.0)], scan) == 2
    assert count([(3.9, 1.5), (4.5, 1.5), (2.0, -1.0)], scan) == 0


def test_behind_a_laser_nothing_is_seen() -> None:
    ahead = Pose2(2.0, 1.5, 0.0)
    scan = rectangle_scan(ahead, field_of_view=math.pi)
    assert count([(3.0, 1.6), (1.0, 1.6)], scan, ahead) == 1


def test_beams_to_ignore_say_nothing_and_too_few_beams_neither() -> None:
    scan = rectangle_scan(MIDDLE)
    assert count([(1.0, 1.0)], scan.without(np.ones(len(scan.ranges), dtype=np.bool_))) == 0
    assert count([(1.0, 0.0)], LaserScan(np.ones(2, dtype=np.float32), 0.0, 0.1, 5.0, 0.0)) == 0


def test_one_scan_of_several_is_enough() -> None:
    here, away = rectangle_scan(MIDDLE), rectangle_scan(MIDDLE)
    views = [(away, Pose2(50.0, 0.0, 0.0)), (here, MIDDLE)]
    assert count_seen_free(np.array([[1.0, 1.0]]), views, 0.3) == 1
    assert count_seen_free(np.zeros((0, 2)), [(here, IDENTITY)], 0.3) == 0


def test_against_a_wrong_pose_speak_end_points_in_free_space_and_walls_looked_through() -> None:
    scan, views = rectangle_scan(MIDDLE), [(rectangle_scan(MIDDLE), MIDDLE)]
    assert count_contradictions(scan, MIDDLE, views) == 0
    assert count_contradictions(scan, Pose2(2.8, 1.5, 0.3), views) > 15
    small = rectangle_scan(Pose2(1.0, 0.8, 0.3), width=2.0, height=1.6)
    # The first and the last beam of a view have a neighbour on one side only: they do not speak.
    least = len(small.ranges) - 2
    assert count_contradictions(small, MIDDLE, views) >= least
    assert count_contradictions(scan, MIDDLE, [(small, MIDDLE)]) >= least
