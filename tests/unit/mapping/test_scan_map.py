from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry import Pose2
from mapping.scan_map import ScanMap
from tests.unit.mapping.rectangle import rectangle_scan

POSES = (Pose2(1.0, 1.0, 0.0), Pose2(2.5, 1.4, 1.0), Pose2(3.0, 2.0, 2.0))


def filled(poses=POSES) -> ScanMap:
    scans = ScanMap(resolution=0.1)
    for k, pose in enumerate(poses):
        scans.add("robin" if k % 2 == 0 else "marian", rectangle_scan(POSES[k], beams=40), pose)
    return scans


def test_drawing_bit_by_bit_or_at_once_gives_the_same_grid():
    scans = ScanMap(resolution=0.1)
    for k, pose in enumerate(POSES):
        assert scans.add("robin", rectangle_scan(pose, beams=40), pose) == k
        grid, changed = scans.grid()
        assert not changed.empty
    at_once, _ = filled().grid()
    assert grid.geometry == at_once.geometry
    assert np.array_equal(grid.log_odds, at_once.log_odds)
    assert scans.grid()[1].empty


def test_corrected_poses_are_drawn_anew():
    crooked = filled((POSES[0], Pose2(2.8, 1.4, 1.3), POSES[2]))
    crooked.grid()
    crooked.correct({1: POSES[1]})
    assert np.array_equal(crooked.grid()[0].log_odds, filled().grid()[0].log_odds)
    assert crooked.redrawn == 1
    crooked.add("robin", rectangle_scan(POSES[0], beams=40), Pose2(0.0, 0.0, 0.0))
    crooked.correct({3: POSES[0]})
    assert crooked.redrawn == 1 and len(crooked) == 4


def test_scans_know_their_robot():
    scans = filled()
    assert scans.of_robot("robin") == [0, 2]
    assert scans.of_robot("marian") == [1]
    assert scans.of_robot("littlejohn") == []


def test_a_scan_that_is_not_there_cannot_be_corrected():
    with pytest.raises(IndexError):
        filled().correct({7: POSES[0]})
