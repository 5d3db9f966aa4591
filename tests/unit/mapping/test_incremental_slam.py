from __future__ import annotations

import math
import os
from dataclasses import replace

import numpy as np
import pytest

from mapping.correlative_search import SearchWindow
from mapping.geometry import IDENTITY, Pose2, wrap_angle
from mapping.incremental_slam import IncrementalSlam, SlamSettings
from mapping.match_map import MapSettings
from mapping.scan import LaserScan
from tests.unit.mapping.rectangle import rectangle_scan

COARSE = SlamSettings(
    map=MapSettings(resolution=0.1), wide=SearchWindow(0.8, math.radians(20.0), math.radians(3.0))
)
START = Pose2(1.2, 1.1, 0.2)


def scan_at(T_room_base: Pose2, rng: np.random.Generator, beams: int = 60) -> LaserScan:
    return rectangle_scan(T_room_base, beams=beams, noise=0.02, rng=rng)


def started(rng: np.random.Generator) -> IncrementalSlam:
    slam = IncrementalSlam(COARSE, T_odom_base=START)
    for turn in (0.0, 0.2, 0.2, 0.2):
        pose = slam.T_odom_base @ Pose2(0.0, 0.0, turn)
        slam.step(Pose2(0.0, 0.0, turn), scan_at(pose, rng))
    return slam


def test_the_first_scan_starts_the_map():
    slam = IncrementalSlam(COARSE, T_odom_base=START)
    estimate = slam.step(IDENTITY, scan_at(START, np.random.default_rng(1)))
    assert estimate.matched and estimate.inserted
    assert estimate.T_odom_base == START
    assert slam.occupancy().log_odds.max() > 0.0 and slam.map.scans == 1


def test_a_noisy_way_is_corrected_by_the_scans():
    rng = np.random.default_rng(2)
    slam, truth, wheels = IncrementalSlam(COARSE, T_odom_base=START), START, START
    slam.step(IDENTITY, scan_at(truth, rng))
    for _ in range(24):
        move = Pose2(0.08, 0.0, 0.12)
        noisy = Pose2(0.08 + 0.02 * rng.standard_normal(), 0.0, 0.12 + 0.02 * rng.standard_normal())
        truth, wheels = truth @ move, wheels @ noisy
        estimate = slam.step(noisy, scan_at(truth, rng))
        assert estimate.matched
    assert wheels.distance_to(truth) > 2.0 * estimate.T_odom_base.distance_to(truth)
    assert estimate.T_odom_base.distance_to(truth) < 0.04
    assert abs(wrap_angle(estimate.T_odom_base.theta - truth.theta)) < math.radians(1.0)
    assert estimate.covariance[0, 0] < 0.03**2


def way_along_a_corridor(seed: int) -> tuple[float, float]:
    """Drive 8 m along bare walls; return where wheels and estimate end, short of the truth [m]."""
    rng = np.random.default_rng(seed)
    slam, true_x, told_x = IncrementalSlam(COARSE), 0.0, 0.0
    for k in range(41):
        step = 0.2 if k else 0.0
        told = step + 0.05 * math.sqrt(step) * rng.standard_normal()
        true_x, told_x = true_x + step, told_x + told
        T_room_base = Pose2(500.0 + true_x, 1.03, 0.0)
        scan = rectangle_scan(
            T_room_base, width=1000.0, height=2.06, beams=91, field_of_view=math.pi, noise=0.03,
            rng=rng,
        )  # fmt: skip
        estimate = slam.step(Pose2(told, 0.0, 0.0), scan)
    return told_x - true_x, estimate.T_odom_base.x - true_x


@pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="long drives take plain Python too long"
)
def test_a_corridor_does_not_hold_a_robot_back():
    # Single beams that met the walls far away once held it back by a tenth of a metre and more.
    for seed in (3, 4):
        wheels, estimate = way_along_a_corridor(seed)
        assert abs(estimate - wheels) < 0.06


def test_without_a_scan_the_covariance_grows():
    slam = started(np.random.default_rng(3))
    before = slam.covariance[0, 0]
    estimate = slam.step(Pose2(0.5, 0.0, 0.0), None)
    assert not estimate.matched and not estimate.inserted
    assert estimate.covariance[0, 0] > before + 1e-4


def test_scans_are_inserted_at_keyframes_only():
    rng = np.random.default_rng(4)
    slam = started(rng)
    count = slam.map.scans
    pose = slam.T_odom_base
    for _ in range(3):
        assert not slam.step(IDENTITY, scan_at(pose, rng)).inserted
    assert slam.map.scans == count
    assert slam.step(Pose2(0.25, 0.0, 0.0), scan_at(pose @ Pose2(0.25, 0.0, 0.0), rng)).inserted


def test_scans_between_keyframes_refine_the_walls_once_the_robot_has_moved():
    rng = np.random.default_rng(4)
    slam = started(rng)
    pose, hits = slam.T_odom_base, slam.map.surfaces.sums[:, 0].sum()
    slam.step(IDENTITY, scan_at(pose, rng))
    assert slam.map.surfaces.sums[:, 0].sum() == hits
    ahead = Pose2(0.1, 0.0, 0.0)
    estimate = slam.step(ahead, scan_at(pose @ ahead, rng))
    assert estimate.matched and not estimate.inserted
    assert slam.map.surfaces.sums[:, 0].sum() > hits


def way_out_of_a_crowd(seed: int, anchor_known: float) -> float:
    """Drive past others that hid the corridor ahead; return where the estimate is too far [m]."""
    rng = np.random.default_rng(seed)
    truth = Pose2(0.6, 1.0, 0.0)
    slam = IncrementalSlam(replace(COARSE, anchor_known=anchor_known), T_odom_base=truth)
    bearings = -0.5 * math.pi + np.arange(181) * math.pi / 181
    for k in range(16):
        step = 0.1 if k > 4 else 0.0
        truth = truth @ Pose2(step, 0.0, 0.0)
        scan = rectangle_scan(
            truth, width=20.0, height=2.0, beams=181, field_of_view=math.pi, range_max=12.0,
            noise=0.03, rng=rng,
        )  # fmt: skip
        if k < 12:
            scan = scan.without(np.abs(bearings) < math.radians(55.0 if k < 5 else 75.0))
        told = Pose2(
            step * (1.0 + 0.02 * rng.standard_normal()), 0.0, 0.002 * rng.standard_normal()
        )
        estimate = slam.step(told, scan)
    return estimate.T_odom_base.x - truth.x


@pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="long drives take plain Python too long"
)
def test_the_few_walls_it_knows_do_not_hold_a_robot_back_where_it_sees_many_new_ones():
    anchored, carried = (
        np.mean([abs(way_out_of_a_crowd(seed, known)) for seed in range(12)])
        for known in (SlamSettings().anchor_known, 0.0)
    )
    assert anchored < 0.6 * carried
    assert anchored < 0.06


def test_wheels_that_slipped_are_found_out_by_two_scans_and_the_place_found_again():
    rng = np.random.default_rng(5)
    slam = started(rng)
    true = slam.T_odom_base @ Pose2(0.55, -0.35, 0.2)
    assert not slam.step(Pose2(0.02, 0.0, 0.0), scan_at(true, rng)).matched
    estimate = slam.step(Pose2(0.01, 0.0, 0.0), scan_at(true @ Pose2(0.01, 0.0, 0.0), rng))
    assert estimate.matched
    assert estimate.T_odom_base.distance_to(true) < 0.06


def test_a_robot_close_by_that_fills_the_view_once_moves_nothing():
    """Half of what it sees is a body nobody told of: somewhere else the rest fits about as well."""
    rng = np.random.default_rng(11)
    slam = started(rng)
    before = slam.T_odom_base
    scan = scan_at(before, rng)
    ranges = scan.ranges.copy()
    ranges[8:44] = np.minimum(ranges[8:44], 0.5)
    slam.step(IDENTITY, replace(scan, ranges=ranges))
    estimate = slam.step(IDENTITY, scan_at(before, rng))
    assert estimate.matched
    assert estimate.T_odom_base.distance_to(before) < 0.03


def test_a_scan_from_elsewhere_is_not_believed():
    rng = np.random.default_rng(6)
    slam = started(rng)
    pose, scans, before = slam.T_odom_base, slam.map.scans, slam.covariance[0, 0]
    tiny = rectangle_scan(Pose2(0.4, 0.3, 0.0), width=0.8, height=0.6, beams=60)
    estimate = slam.step(Pose2(0.3, 0.0, 0.0), tiny)
    assert not estimate.matched and not estimate.inserted
    assert estimate.T_odom_base == pose @ Pose2(0.3, 0.0, 0.0)
    assert estimate.covariance[0, 0] > before and slam.map.scans == scans


def test_blind_scans_are_inserted_but_keep_the_grown_covariance():
    rng = np.random.default_rng(7)
    slam = started(rng)
    blind = LaserScan(np.full(30, 1.0, dtype=np.float32), -math.pi, 0.2, 1.0, 0.0)
    walls = int((slam.occupancy().log_odds > 0.4).sum())
    for _ in range(12):
        estimate = slam.step(Pose2(0.3, 0.0, 0.5), blind)
        assert not estimate.matched
    assert estimate.inserted
    assert estimate.covariance[0, 0] > 0.02**2
    # Uncertain scans clear what is unknown, but no walls: only the first few, still sure, may.
    assert (slam.occupancy().log_odds > 0.4).sum() > 0.8 * walls


def test_a_wall_seen_again_after_a_blind_way_is_matched_within_the_grown_window():
    # A long room of 8 m, a laser of 2.5 m: in the middle no wall is seen ahead or behind, and the
    # side walls are out of reach as well.
    rng = np.random.default_rng(8)
    room = {"width": 8.0, "height": 8.0, "range_max": 2.5, "beams": 60, "noise": 0.02, "rng": rng}
    truth = Pose2(1.5, 1.5, math.pi / 4)
    slam = IncrementalSlam(COARSE, T_odom_base=truth)
    slam.step(IDENTITY, rectangle_scan(truth, **room))
    blind = 0
    for k in range(40):
        move = Pose2(0.2, 0.0, 0.0) if k < 20 else Pose2(0.2, 0.0, math.pi if k == 20 else 0.0)
        truth = truth @ move
        noisy = Pose2(move.x * 1.05, 0.002, move.theta + 0.006)
        estimate = slam.step(noisy, rectangle_scan(truth, **room))
        blind += not estimate.matched
    assert blind >= 4
    assert estimate.matched
    assert estimate.T_odom_base.distance_to(truth) < 0.06


def test_identical_inputs_give_identical_results():
    def run() -> tuple[Pose2, bytes]:
        rng = np.random.default_rng(9)
        slam = started(rng)
        estimate = slam.step(Pose2(0.25, 0.0, 0.1), scan_at(slam.T_odom_base, rng))
        return estimate.T_odom_base, slam.occupancy().log_odds.tobytes()

    assert run() == run()
