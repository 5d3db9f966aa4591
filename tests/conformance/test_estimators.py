"""Every estimator in the table does what an estimator does."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest

from mapping.estimator import Estimator, OthersScan, TakesOthersScans
from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.incremental_slam import SlamSettings
from mapping.match_map import MapSettings
from mapping.scan import LaserScan
from robot_agent.estimators import ESTIMATORS, EstimatorError, find_estimator, make_estimator
from tests.unit.tours import RESOLUTION, Tour, around

SETTINGS = SlamSettings(map=MapSettings(resolution=RESOLUTION))
EMPTY = LaserScan(np.zeros(60, dtype=np.float32), -3.0, 0.1, 6.0, 0.0)

every = pytest.mark.parametrize("name", sorted(ESTIMATORS))


@cache
def tour() -> Tour:
    return around(0.3, seed=1)


def after(name: str, seed: int = 3) -> Estimator:
    estimator = make_estimator(name, SETTINGS, np.random.default_rng(seed))
    for move, scan in zip(tour().moves, tour().scans, strict=True):
        estimate = estimator.step(move, scan)
        assert estimate.T_odom_base == estimator.T_odom_base
    estimator.finish()
    return estimator


def by_wheels(driven: Tour) -> Floats:
    """Where the wheels alone have the robot at each scan, (n, 3)."""
    poses = list(itertools.accumulate(driven.moves, Pose2.__matmul__, initial=IDENTITY))[1:]
    return np.array([pose.as_tuple() for pose in poses])


@every
def test_it_follows_the_robot_and_draws_where_it_was(name: str) -> None:
    estimator = after(name)
    poses = estimator.trajectory()
    assert poses.shape == (len(tour().scans), 3)
    assert tour().errors(poses).max() < 0.6 * tour().errors(by_wheels(tour())).max()
    assert estimator.covariance.shape == (3, 3)
    assert np.linalg.eigvalsh(estimator.covariance).min() >= 0.0
    log_odds = estimator.occupancy().log_odds
    assert (log_odds > 0.0).any() and (log_odds < 0.0).any()
    graph = estimator.pose_graph()
    assert graph is None or (len(graph) > 1 and graph.edges)


@every
def test_the_same_seed_gives_the_same_to_the_bit(name: str) -> None:
    one, other = after(name), after(name)
    assert one.trajectory().tobytes() == other.trajectory().tobytes()
    assert one.occupancy().log_odds.tobytes() == other.occupancy().log_odds.tobytes()


@every
def test_without_any_scan_there_is_no_way_and_with_empty_ones_the_wheels_stand(name: str) -> None:
    estimator = make_estimator(name, SETTINGS, np.random.default_rng(0))
    estimator.finish()
    assert estimator.trajectory().shape == (0, 3)
    estimator.step(Pose2(0.1, 0.0, 0.0), None)
    for _ in range(20):
        estimator.step(Pose2(0.1, 0.0, 0.0), EMPTY)
    estimator.finish()
    poses = estimator.trajectory()
    assert len(poses) == 20 and np.isfinite(poses).all()
    assert poses[-1, 0] - poses[0, 0] == pytest.approx(1.9, abs=0.6)


@every
def test_a_robot_at_rest_stays_where_it_is(name: str) -> None:
    estimator = make_estimator(name, SETTINGS, np.random.default_rng(0))
    for _ in range(20):
        estimator.step(IDENTITY, tour().scans[0])
    estimator.finish()
    assert np.abs(estimator.trajectory()).max() < 0.05


takes = pytest.mark.parametrize(
    "name", sorted(n for n in ESTIMATORS if issubclass(find_estimator(n), TakesOthersScans))
)


def with_a_mate(name: str, shift: float, seed: int = 3) -> Estimator:
    """One whose teammate drove ahead, sees what it sees, and is off by `shift` [m] along x."""
    estimator = make_estimator(name, SETTINGS, np.random.default_rng(seed))
    assert isinstance(estimator, TakesOthersScans)
    ahead = [
        OthersScan(("mate", 0), k, scan, Pose2(pose.x + shift, pose.y, pose.theta))
        for k, (scan, pose) in enumerate(zip(tour().scans, tour().truth, strict=True))
    ]
    for k, (move, scan) in enumerate(zip(tour().moves, tour().scans, strict=True)):
        estimator.take_others(ahead[: 10 * (k // 10 + 2) : 3])
        estimator.step(move, scan)
    return estimator


@takes
def test_what_others_saw_well_does_no_harm_and_is_the_same_to_the_bit(name: str) -> None:
    one = with_a_mate(name, 0.0)
    errors = tour().errors(one.trajectory())
    assert errors.max() < 0.1
    assert one.trajectory().tobytes() == with_a_mate(name, 0.0).trajectory().tobytes()
    assert one.trajectory().tobytes() != after(name).trajectory().tobytes()


@takes
def test_what_others_saw_elsewhere_is_not_followed(name: str) -> None:
    assert tour().errors(with_a_mate(name, 1.0).trajectory()).max() < 0.15


@takes
def test_what_others_took_back_counts_no_more(name: str) -> None:
    estimator = make_estimator(name, SETTINGS, np.random.default_rng(3))
    assert isinstance(estimator, TakesOthersScans)
    estimator.take_others([OthersScan(("mate", 0), 1, tour().scans[0], IDENTITY)])
    estimator.take_others([])
    for move, scan in zip(tour().moves, tour().scans, strict=True):
        estimator.step(move, scan)
    assert estimator.trajectory().tobytes() == after(name).trajectory().tobytes()


def test_an_estimator_nobody_knows_is_refused_with_those_there_are() -> None:
    with pytest.raises(EstimatorError, match="choose one of graph"):
        find_estimator("nothing")
    with pytest.raises(EstimatorError, match="cannot load"):
        find_estimator("mapping.nowhere:Nobody")
