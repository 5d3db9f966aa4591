"""Wrong loop closures do not bend a graph, and right ones are not lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.wrong_loops import relative_error, trajectory_error, with_wrong_loops
from expedition.graph_files.g2o import read_g2o
from mapping.batch_optimisation import held_nodes, optimise
from mapping.constraints import Constraints
from mapping.geometry import Pose2, pose_from
from mapping.robust_optimisation import dead_reckoned, optimise_robustly, ways
from tests.unit.mapping.looped_walk import looped_walk


def stated(constraints: Constraints, factor: float) -> Constraints:
    """The same with covariances that many times as large."""
    return Constraints(constraints.ends, constraints.measured, constraints.information / factor)


@pytest.mark.parametrize("factor", [0.2, 1.0, 40.0])
def test_a_right_graph_keeps_everything(factor: float) -> None:
    """Whatever its covariances are called: smaller than they are, just so, or larger."""
    _, way, constraints = looped_walk()
    told = stated(constraints, factor)
    held = held_nodes(len(way), told, [])
    plain, robust = optimise(way, told, held), optimise_robustly(way, told, held)
    assert robust.kept.all()
    assert robust.chi2 == pytest.approx(plain.chi2, rel=1e-5)
    assert trajectory_error(robust.poses, plain.poses) < 1e-3


@pytest.mark.parametrize("kind", ["random near", "random far", "group near", "group far"])
@pytest.mark.parametrize("factor", [1.0, 40.0])
def test_wrong_loops_are_left_out(kind: str, factor: float) -> None:
    truth, way, constraints = looped_walk()
    told = stated(constraints, factor)
    clean = optimise(way, told, held_nodes(len(way), told, []))
    both, wrong = with_wrong_loops(told, way, 1.0, kind, seed=1)
    best = optimise_robustly(way, both, held_nodes(len(way), both, []))
    # A claim that is wrong by no more than errors are large does no harm.
    harmful = wrong & (both.squared_errors(clean.poses) > 30.0)
    assert not np.any(best.kept & harmful)
    assert np.mean(best.kept[~wrong]) > 0.97
    assert trajectory_error(best.poses, truth) < 1.05 * trajectory_error(clean.poses, truth) + 0.01
    assert relative_error(best.poses, clean.poses) < 0.01
    assert best.iterations > 5


def test_a_bad_guess_does_not_matter_where_ways_are_known() -> None:
    truth, _, constraints = looped_walk()
    both, wrong = with_wrong_loops(constraints, truth, 0.5, "group far", seed=3)
    guess = np.zeros_like(truth)
    best = optimise_robustly(guess, both, held_nodes(len(truth), both, []))
    assert not np.any(best.kept & wrong)
    assert trajectory_error(best.poses, truth) < 0.1


@pytest.mark.parametrize("T_map_other", [Pose2(0.0, 0.0, 0.0), Pose2(3.0, -5.0, 2.0)])
def test_two_robots_are_tied_by_the_loops_that_agree(T_map_other: Pose2) -> None:
    """Nothing is known of one robot's frame in the other's but by loops, and some are wrong."""
    truth, way, constraints = looped_walk()
    between = (constraints.ends.min(axis=1) < 40) & (constraints.ends.max(axis=1) >= 40)
    cut = constraints.only(~(between & ways(constraints)))
    both, wrong = with_wrong_loops(cut, way, 0.2, "random far", seed=2)
    for k in range(40, len(way)):
        way[k] = (T_map_other @ pose_from(way[k])).as_tuple()
    best = optimise_robustly(way, both, held_nodes(len(way), both, []))
    assert np.array_equal(best.kept, ~wrong)
    assert trajectory_error(best.poses, truth) < 0.1


def test_loops_alone_are_judged_by_each_other() -> None:
    """No two consecutive nodes are connected: there is no way to trust."""
    ends = np.array([(0, 2), (2, 4), (4, 6), (0, 4), (2, 6), (0, 6), (0, 6)])
    places = {0: 0.0, 2: 1.0, 4: 2.0, 6: 3.0, 1: 0.0, 3: 0.0, 5: 0.0}
    measured = np.array([(places[j] - places[i], 0.0, 0.0) for i, j in ends.tolist()])
    measured[-1] = (80.0, 3.0, 1.0)
    constraints = Constraints(ends, measured, np.tile(1e4 * np.eye(3), (len(ends), 1, 1)))
    guess = np.array([(places[k], 0.0, 0.0) for k in range(7)])
    guess[:, 1] = 0.1
    best = optimise_robustly(guess, constraints, held_nodes(7, constraints, []))
    assert best.kept.tolist() == [True] * 6 + [False]


def test_of_two_steps_between_the_same_nodes_one_is_trusted() -> None:
    _, way, constraints = looped_walk()
    twice = Constraints(
        np.concatenate((constraints.ends, [(8, 7)])),
        np.concatenate((constraints.measured, [(30.0, 0.0, 1.0)])),
        np.concatenate((constraints.information, constraints.information[:1])),
    )
    assert ways(twice).sum() == len(way) - 1
    best = optimise_robustly(way, twice, held_nodes(len(way), twice, []))
    assert best.kept.tolist() == [True] * len(constraints) + [False]


def test_dead_reckoning_follows_steps_either_way_and_minds_what_is_fixed() -> None:
    steps = Constraints(
        np.array([(0, 1), (2, 1), (3, 4)]),
        np.array([(1.0, 0.0, np.pi / 2), Pose2(2.0, 0.0, 0.0).inverse().as_tuple(), (1, 0, 0)]),
        np.tile(np.eye(3), (3, 1, 1)),
    )
    guess = np.array([(0.0, 0, 0), (9, 9, 9), (9, 9, 9), (5, 5, np.pi), (9, 9, 9)])
    reckoned = dead_reckoned(guess, steps, held_nodes(5, steps, [0]))
    assert reckoned[2] == pytest.approx([1.0, 2.0, np.pi / 2])
    assert reckoned[4] == pytest.approx([4.0, 5.0, np.pi])
    kept = dead_reckoned(guess, steps, held_nodes(5, steps, [0, 2]))
    assert kept[2] == pytest.approx(guess[2])


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize(("name", "chi2"), [("m3500", 146.077), ("intel", 45.005)])
def test_real_graphs_reach_the_known_minimum(data_dir: Path, name: str, chi2: float) -> None:
    graph = read_g2o(data_dir / "graphs" / f"{name}.g2o.gz")
    held = held_nodes(len(graph.poses), graph.constraints, [])
    plain = optimise(graph.poses, graph.constraints, held)
    assert plain.chi2 == pytest.approx(chi2, rel=1e-4)
    assert plain.iterations <= 6
    robust = optimise_robustly(graph.poses, graph.constraints, held)
    assert robust.kept.all()
    assert robust.chi2 == plain.chi2


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["random near", "group near", "group far"])
@pytest.mark.parametrize("name", ["m3500", "intel"])
def test_real_graphs_with_as_many_wrong_loops(data_dir: Path, name: str, kind: str) -> None:
    graph = read_g2o(data_dir / "graphs" / f"{name}.g2o.gz")
    held = held_nodes(len(graph.poses), graph.constraints, [])
    clean = optimise(graph.poses, graph.constraints, held).poses
    way = dead_reckoned(graph.poses, graph.constraints.only(ways(graph.constraints)), held)
    both, wrong = with_wrong_loops(graph.constraints, way, 1.0, kind, seed=1)
    best = optimise_robustly(graph.poses, both, held)
    assert np.count_nonzero(best.kept & wrong) <= 5
    assert np.count_nonzero(~best.kept & ~wrong) <= 10
    assert trajectory_error(best.poses, clean) < 0.05 * trajectory_error(way, clean)
    assert trajectory_error(best.poses, clean) < 0.02
    assert pose_from(best.poses[0]) == pose_from(graph.poses[0])
