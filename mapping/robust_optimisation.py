"""The likeliest poses of a pose graph of which some loop closures are wrong.

Each robot's way is trusted; whether two places are the same one is not, as places look alike. The
graph begins with the ways alone and grows by the loops it can judge: first those whose ends it
already knows well of each other, and as each loop makes it stiffer, longer and longer ones. Whether
a loop may be right is asked of

  * the graph: its error must be likely for what the graph predicts (a gate, by Mahalanobis), which
    shows up a wrong loop where the graph is stiff, however well it agrees with others as wrong,
  * the others of its kind: those that pass must hold together (`graduated_loss`), which shows up a
    wrong loop where the graph is slack, but the right ones are the more.

Files often state covariances that are too large by far. How far is told by the loops that are in
(the sum of their squared errors should be the number of degrees of freedom), and the limits of both
tests shrink or grow by that factor: with deviations six times too large, no test would find much.

Source: Mangelson, Dominic, Eustice & Vasudevan 2018, "Pairwise consistent measurement set
maximization", equation 3, for the gate, here of a loop against the whole graph instead of against
one other; Olivastri & Pretto 2024, "IPC: incremental probabilistic consensus", for the growing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.batch_optimisation import Optimum, optimise, system_of
from mapping.constraints import Constraints, Flags, Indices
from mapping.error_spread import predicted_spread
from mapping.geometry import Floats, pose_from
from mapping.graduated_loss import select
from mapping.normal_equations import HELD

# Of right constraints one in 100,000 has a squared error beyond (chi2, three degrees).
_UNLIKELY = 25.9
# A graph whose doubted errors are all less than one stated deviation has none that is wrong.
_CERTAIN = 1.0
# In the end no constraint is called wrong whose squared error is as its stated covariance allows:
# 95 of 100 would be less (chi2, three degrees).
_LIKELY = 7.81
# How many times more volume an error may fill by the poses of its ends than by the measurement
# alone (cube root), for the first loops; then each time by how many more.
_FIRST_LEVEL, _NEXT_LEVEL = 8.0, 4.0
# Beyond, nothing connects the ends: all such loops are judged together, by each other.
_UNCONNECTED = 1e6
# The factor of the stated covariances is 1 before anything is known: as by so many degrees.
_PRIOR_DEGREES = 10.0
# A mean squared error above, at the first guess, is hardly that of a graph without wrong loops.
_HOPELESS = 100.0
_TRIAL_STEPS, _ROUNDS = 30, 5


@dataclass(frozen=True, slots=True)
class RobustOptimum:
    """Where a graph came to rest, and by which of its constraints.

    Attributes:
        poses: (N, 3) poses (x, y, theta) of all nodes, map frame; theta wrapped.
        kept: (E,) which constraints count; the others were judged wrong.
        chi2: sum of squared weighed errors of those that count.
        iterations: linear systems solved.
    """

    poses: Floats
    kept: Flags
    chi2: float
    iterations: int


def optimise_robustly(poses: Floats, constraints: Constraints, held: Floats) -> RobustOptimum:
    """Move the nodes of a graph to the optimum of those constraints that are right.

    The first constraint of each two consecutive nodes is trusted. A graph whose plain optimum
    leaves no error worth speaking of keeps all constraints, and that optimum is the result.

    Args:
        poses: (N, 3) a first guess of the poses (x, y, theta), map frame.
        constraints: between them; at least one.
        held: (N,) which nodes stay; see `batch_optimisation.held_nodes`.
    """
    trusted = ways(constraints)
    iterations = 0
    if trusted.all() or constraints.squared_errors(poses).mean() < _HOPELESS:
        plain = optimise(poses, constraints, held, most_steps=_TRIAL_STEPS)
        iterations = plain.iterations
        doubted = constraints.squared_errors(plain.poses)[~trusted]
        if doubted.max(initial=0.0) <= _CERTAIN:
            return RobustOptimum(plain.poses, np.ones_like(trusted), plain.chi2, iterations)
    reckoned = dead_reckoned(poses, constraints.only(trusted), held)
    graph = _GrowingGraph(reckoned, constraints, trusted, held)
    while graph.waiting.any():
        graph.grow()
    best = graph.settle()
    return RobustOptimum(best.poses, graph.kept, best.chi2, iterations + graph.iterations)


def ways(constraints: Constraints) -> Flags:
    """Return which constraints (E,) are robots' ways: of each two consecutive nodes the first."""
    low, high = constraints.ends.min(axis=1), constraints.ends.max(axis=1)
    steps = np.flatnonzero(high - low == 1)
    firsts = np.zeros(len(constraints), dtype=bool)
    firsts[steps[np.unique(low[steps], return_index=True)[1]]] = True
    return firsts


def dead_reckoned(poses: Floats, way: Constraints, held: Floats) -> Floats:
    """Return poses (N, 3) by the steps of robots' ways, from the first node of each on.

    Nodes that are held, and those that no step leads to, have the poses that were given.
    """
    steps = {}
    for (i, j), measured in zip(way.ends.tolist(), way.measured, strict=True):
        step = pose_from(measured)
        steps[max(i, j)] = step if i < j else step.inverse()
    reckoned = poses.copy()
    for node in sorted(steps):
        if held[node] < HELD:
            reckoned[node] = (pose_from(reckoned[node - 1]) @ steps[node]).as_tuple()
    return reckoned


class _GrowingGraph:
    """A graph that takes in loops, surest first.

    Attributes:
        kept: (E,) which constraints are in.
        waiting: (E,) which were not judged yet.
        iterations: linear systems solved so far.
    """

    def __init__(
        self, poses: Floats, constraints: Constraints, trusted: Flags, held: Floats
    ) -> None:
        self.kept, self.waiting, self.iterations = trusted.copy(), ~trusted, 0
        self._poses, self._constraints, self._trusted, self._held = (
            poses, constraints, trusted, held,
        )  # fmt: skip
        self._level = _FIRST_LEVEL
        self._scale = 1.0  # factor of the stated covariances

    def grow(self) -> None:
        """Judge the loops that can be judged by now, and take in those that seem right."""
        asked = np.flatnonzero(self.waiting)
        slack, squared = self._judged(asked)
        self._level = max(self._level, float(slack.min()))
        now = slack <= self._level
        self.waiting[asked[now]] = False
        passed = asked[now & (squared <= self._scale * _UNLIKELY)]
        if len(passed):
            self._take(passed)
        self._level *= _NEXT_LEVEL

    def settle(self) -> Optimum:
        """Return the optimum; look again, now that all is known, at which constraints are in.

        Loops that were turned away may be in after all, and the other way round.
        """
        for _ in range(_ROUNDS):
            best = self._optimum()
            limit = max(_LIKELY, self._scale * _UNLIKELY)
            likely = self._constraints.squared_errors(self._poses) <= limit
            if np.array_equal(self.kept, self._trusted | likely):
                return best
            self.kept = self._trusted | likely
        return self._optimum()

    def _judged(self, asked: Indices) -> tuple[Floats, Floats]:
        """Return how slack the graph is between the ends of constraints, and their squared errors.

        Slack (n,) is the cube root of how many times more volume the error may fill than by the
        measurement alone; the errors (n,) are weighed by all that they may come from.
        """
        graph, loops = self._constraints.only(self.kept), self._constraints.only(asked)
        system = system_of(len(self._poses), graph, self._held)
        system.fill_weighed(self._poses, np.ones(len(graph)))
        wider = np.eye(3) + loops.information @ predicted_spread(system, self._poses, loops)
        solved = np.linalg.solve(wider, loops.information)
        predicted: Floats = 0.5 * (solved + solved.transpose(0, 2, 1))
        squared = Constraints(loops.ends, loops.measured, predicted).squared_errors(self._poses)
        return np.cbrt(np.clip(np.linalg.det(wider), 1.0, _UNCONNECTED**3)), squared

    def _take(self, passed: Indices) -> None:
        """Take in those of some loops that hold together with all that are in."""
        tried = self.kept.copy()
        tried[passed] = True
        found = select(
            self._poses, self._constraints.only(tried), self._trusted[tried],
            self._scale * _UNLIKELY, self._held,
        )  # fmt: skip
        self._poses, self.iterations = found.poses, self.iterations + found.iterations
        self.kept[tried] = found.kept
        self._optimum()

    def _optimum(self) -> Optimum:
        """Move to the optimum of what is in, and learn from it how large errors are."""
        best = optimise(self._poses, self._constraints.only(self.kept), self._held)
        self._poses, self.iterations = best.poses, self.iterations + best.iterations
        free = int((self._held < HELD).sum())
        degrees = max(3 * (int(self.kept.sum()) - free), 0)
        self._scale = (best.chi2 + _PRIOR_DEGREES) / (degrees + _PRIOR_DEGREES)
        return best
