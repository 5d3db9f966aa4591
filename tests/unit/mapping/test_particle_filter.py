from __future__ import annotations

import math

import numpy as np

from mapping.estimator import OthersScan
from mapping.geometry import IDENTITY, Pose2, wrap_angle
from mapping.incremental_slam import SlamSettings
from mapping.match_map import MapSettings
from mapping.particle_filter import ParticleFilter
from mapping.particle_settings import ParticleSettings
from mapping.scan import LaserScan
from tests.unit.mapping.rectangle import rectangle_scan
from tests.unit.tours import Tour, around

COARSE = SlamSettings(map=MapSettings(resolution=0.1))
FEW = ParticleSettings(count=4, update_distance=0.3, update_turn=0.35, guesses=30)
START = Pose2(1.2, 1.1, 0.2)
BLIND = LaserScan(np.zeros(40, dtype=np.float32), -math.pi, 0.15, 8.0, 0.0)


def scan_at(T_room_base: Pose2, rng: np.random.Generator) -> LaserScan:
    return rectangle_scan(T_room_base, beams=60, noise=0.02, rng=rng)


def started(rng: np.random.Generator, particles: ParticleSettings = FEW) -> ParticleFilter:
    slam = ParticleFilter(COARSE, np.random.default_rng(0), particles, T_odom_base=START)
    for turn in (0.0, 0.4, 0.4):
        slam.step(Pose2(0.0, 0.0, turn), scan_at(slam.T_odom_base @ Pose2(0.0, 0.0, turn), rng))
    return slam


def round_the_room(
    seed: int, particles: ParticleSettings, steps: int = 40
) -> tuple[ParticleFilter, list[Pose2]]:
    rng = np.random.default_rng(seed)
    slam = ParticleFilter(COARSE, np.random.default_rng(seed), particles, T_odom_base=START)
    truth = [START]
    slam.step(IDENTITY, scan_at(START, rng))
    for _ in range(steps):
        noisy = Pose2(0.1 + 0.02 * rng.standard_normal(), 0.0, 0.15 + 0.03 * rng.standard_normal())
        truth.append(truth[-1] @ Pose2(0.1, 0.0, 0.15))
        slam.step(noisy, scan_at(truth[-1], rng))
    slam.finish()
    return slam, truth


def test_a_noisy_way_is_corrected_and_particles_are_drawn_anew() -> None:
    sharp = ParticleSettings(count=6, update_distance=0.3, update_turn=0.35, evidence_weight=1.0)
    slam, truth = round_the_room(3, sharp)
    poses = slam.trajectory()
    assert poses.shape == (41, 3)
    assert np.allclose(poses[-1], slam.T_odom_base.as_array())
    for pose, true in zip(poses, truth, strict=True):
        assert true.distance_to(Pose2(*pose)) < 0.06
        assert abs(wrap_angle(true.theta - pose[2])) < math.radians(3.0)
    # Particles were drawn anew: some have an ancestor in common.
    assert len({tuple(slam._history.path(i)[2]) for i in range(6)}) < 6
    assert slam.weights.sum() > 0.999
    assert slam.pose_graph() is None


def test_the_map_shows_the_walls_and_the_free_space_between_them() -> None:
    slam, _ = round_the_room(4, FEW)
    grid = slam.occupancy()
    inside = grid.geometry.cell_at(2.0, 1.5)
    assert grid.log_odds[inside] < 0.0
    wall = grid.geometry.cells_at([[4.02, y] for y in np.arange(0.5, 2.5, 0.1)])
    assert (grid.log_odds[wall[:, 0], wall[:, 1]] > 0.0).mean() > 0.7


def test_the_map_shows_no_more_than_asked_for() -> None:
    near = ParticleSettings(count=2, free_reach=0.5)
    slam = ParticleFilter(COARSE, None, near)
    slam.step(IDENTITY, rectangle_scan(START))
    ys, xs = np.nonzero(slam.occupancy().log_odds)
    assert 3 <= np.ptp(xs) <= 12 and 3 <= np.ptp(ys) <= 12


def test_seeds_decide_and_nothing_else_does() -> None:
    def run(seed: int) -> tuple[bytes, bytes]:
        slam, _ = round_the_room(seed, FEW, 8)
        return slam.trajectory().tobytes(), slam.occupancy().log_odds.tobytes()

    assert run(5) == run(5)
    assert run(5) != run(6)


def test_before_any_scan_there_is_no_way_and_no_map() -> None:
    slam = ParticleFilter()
    slam.step(Pose2(0.5, 0.0, 0.0), None)
    slam.finish()
    assert slam.trajectory().shape == (0, 3)
    assert not slam.occupancy().log_odds.any()
    assert slam.T_odom_base == Pose2(0.5, 0.0, 0.0)


def test_updates_are_made_after_some_way_only() -> None:
    rng = np.random.default_rng(6)
    slam = started(rng)
    here = slam.T_odom_base
    for _ in range(3):
        estimate = slam.step(IDENTITY, scan_at(here, rng))
        assert estimate.matched and not estimate.inserted
    ahead = Pose2(0.35, 0.0, 0.0)
    estimate = slam.step(ahead, scan_at(here @ ahead, rng))
    assert estimate.matched and estimate.inserted
    assert estimate.covariance[0, 0] < 0.03**2


def test_blind_scans_leave_the_wheels_word_and_spread_the_particles() -> None:
    slam = started(np.random.default_rng(7))
    before, spread = slam.T_odom_base, slam.poses.std(axis=0)
    for _ in range(12):
        estimate = slam.step(Pose2(0.2, 0.0, 0.0), BLIND)
        assert not estimate.matched
    assert estimate.T_odom_base.distance_to(before @ Pose2(2.4, 0.0, 0.0)) < 0.6
    assert slam.poses.std(axis=0)[0] > spread[0]
    assert np.isfinite(slam.trajectory()).all()


def test_wheels_that_slipped_are_found_out() -> None:
    rng = np.random.default_rng(8)
    slam = started(rng)
    true = slam.T_odom_base @ Pose2(0.4, -0.3, 0.2)
    estimate = slam.step(Pose2(0.02, 0.0, 0.0), scan_at(true, rng))
    assert estimate.matched
    assert estimate.T_odom_base.distance_to(true) < 0.06


def test_wheels_that_told_of_a_leap_which_never_was_are_found_out() -> None:
    rng = np.random.default_rng(9)
    slam = started(rng)
    true = slam.T_odom_base
    estimate = slam.step(Pose2(0.9, 0.5, 0.3), scan_at(true, rng))
    assert estimate.matched
    assert estimate.T_odom_base.distance_to(true) < 0.06


def test_a_scan_from_elsewhere_is_not_believed() -> None:
    rng = np.random.default_rng(10)
    slam = started(rng)
    pose, before = slam.T_odom_base, slam.covariance[0, 0]
    tiny = rectangle_scan(Pose2(0.3, 0.25, 0.0), width=0.6, height=0.5, beams=60)
    estimate = slam.step(Pose2(0.35, 0.0, 0.0), tiny)
    assert not estimate.matched and not estimate.inserted
    assert estimate.T_odom_base == pose @ Pose2(0.35, 0.0, 0.0)
    assert estimate.covariance[0, 0] > before


def test_where_wheels_and_a_poor_match_agree_the_match_counts() -> None:
    rng = np.random.default_rng(11)
    slam = started(rng)
    pose = slam.T_odom_base
    scan = scan_at(pose, rng)
    # Somebody stands close before the laser: of most beams nothing is known any more.
    scan.ranges[:36] = 0.4
    estimate = slam.step(IDENTITY, scan)
    assert estimate.matched
    assert estimate.T_odom_base.distance_to(pose) < 0.05


# --- what others saw -----------------------------------------------------------------------------

AHEAD = around(1.0, seed=9)


def seen_ahead(T_odom_told: Pose2 = IDENTITY) -> list[OthersScan]:
    """A teammate went round before; it says that all was seen so far off."""
    told = zip(AHEAD.scans[::4], AHEAD.truth[::4], strict=True)
    return [
        OthersScan(("bob", 0), k, scan, T_odom_told @ pose) for k, (scan, pose) in enumerate(told)
    ]


def follow(tour: Tour, *told: list[OthersScan]) -> ParticleFilter:
    """Drive a tour; of the others first one thing is told, later the next."""
    particles = ParticleSettings(count=8, update_distance=0.5, update_turn=0.5)
    slam = ParticleFilter(COARSE, np.random.default_rng(1), particles)
    every = math.ceil(len(tour.moves) / max(1, len(told)))
    for k, (move, scan) in enumerate(zip(tour.moves, tour.scans, strict=True)):
        if told and k % every == 0:
            slam.take_others(told[k // every])
        slam.step(move, scan)
    return slam


def test_who_drives_where_others_were_before_drifts_less() -> None:
    tour = around(0.9, seed=1, sigma=0.04, turn_sigma=0.03)
    alone, together = (tour.errors(follow(tour, *t).trajectory()) for t in ((), (seen_ahead(),)))
    assert alone.mean() > 0.1
    assert together.mean() < 0.02 and together.max() < 0.1


def test_what_others_put_right_afterwards_counts_from_then_on() -> None:
    tour = around(0.9, seed=1)
    wrong = seen_ahead(Pose2(0.12, 0.0, 0.0))
    told = ((wrong, wrong, wrong), (wrong, seen_ahead(), seen_ahead()))
    bent, righted = (tour.errors(follow(tour, *each).trajectory())[-1] for each in told)
    assert bent > 0.05
    assert righted < 0.6 * bent


def test_all_particles_share_what_others_saw() -> None:
    slam = follow(around(0.2, seed=1), seen_ahead())
    theirs = slam._maps.others
    assert theirs is not None and theirs.tiles.tables.shape[0] == 1
    assert slam._others.drawn == len(seen_ahead())
