"""Laying the local maps of many robots together by what they see of each other.

Of many robots that stand close, each sighting fits several others. So maps are laid together two at
a time, the clearest first: how clear is how many of the discs that one group sees lie where the
other has a robot or sees a disc, too. Each step narrows what is left, since no two robots stand in
one place. A step that another would explain about as well is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import IDENTITY, Floats, Pose2, fit_rigid, wrap_angle
from mapping.sighting_pairs import SightingPair

# Sightings this close to each other [m] are of the same disc.
SAME = 0.15
# No two robots stand closer than this [m].
_APART = 0.3
# A step must explain so many more discs than each other one that it excludes.
_CLEARLY = 2
# Two ways of laying maps together that differ by less than this are one [m], [rad].
_ALIKE, _ALIKE_TURN = 0.2, 0.15


@dataclass(frozen=True, slots=True)
class View:
    """What one robot saw from where it stood.

    Attributes:
        place: (2,) [m] where it stood, its odom frame.
        discs: (k, 2) [m] where it saw discs of a robot's size, same frame.
    """

    place: Floats
    discs: Floats


@dataclass(frozen=True, slots=True)
class _Step:
    """One way of laying two groups together, and how many discs it explains."""

    pair: SightingPair
    one: int
    other: int
    T_one_other: Pose2
    explained: int

    def excludes(self, step: _Step) -> bool:
        """Whether both cannot be true."""
        mine = {(self.pair.a, self.pair.i), (self.pair.b, self.pair.j)}
        theirs = {(step.pair.a, step.pair.i), (step.pair.b, step.pair.j)}
        if (self.one, self.other) != (step.one, step.other):
            return bool(mine & theirs)
        return not _alike(self.T_one_other, step.T_one_other)


def lay_together(pairs: Sequence[SightingPair], views: Mapping[str, View]) -> list[SightingPair]:
    """Return the pairs that agree with how all maps lie when laid together step by step.

    Args:
        pairs: all guesses of who saw whom.
        views: what each of their robots saw.
    """
    group_of = {name: k for k, name in enumerate(sorted(views))}
    T_group_odom = dict.fromkeys(views, IDENTITY)
    while True:
        steps = _steps(pairs, views, group_of, T_group_odom)
        clear = next((step for step in steps if _is_clear(step, steps)), None)
        if clear is None:
            break
        for name in [name for name, group in group_of.items() if group == clear.other]:
            T_group_odom[name] = clear.T_one_other @ T_group_odom[name]
            group_of[name] = clear.one
    return [
        pair
        for pair in pairs
        if group_of[pair.a] == group_of[pair.b]
        and _alike(T_group_odom[pair.a].inverse() @ T_group_odom[pair.b], pair.T_a_b)
    ]


def _is_clear(step: _Step, steps: Sequence[_Step]) -> bool:
    """Whether a step explains clearly more than each that it excludes."""
    return all(
        step.explained >= other.explained + _CLEARLY
        for other in steps
        if other is not step and step.excludes(other)
    )


def _steps(
    pairs: Sequence[SightingPair],
    views: Mapping[str, View],
    group_of: Mapping[str, int],
    T_group_odom: Mapping[str, Pose2],
) -> list[_Step]:
    """Return all ways of laying two groups together, those first that explain most."""
    groups = {
        group: _of_group(views, T_group_odom, [n for n, g in group_of.items() if g == group])
        for group in set(group_of.values())
    }
    steps = []
    for pair in pairs:
        a, b, T_a_b = pair.a, pair.b, pair.T_a_b
        if group_of[a] > group_of[b]:
            a, b, T_a_b = b, a, T_a_b.inverse()
        one, other = group_of[a], group_of[b]
        if one == other:
            continue
        T_one_other = T_group_odom[a] @ T_a_b @ T_group_odom[b].inverse()
        T_one_other, explained = _explained(groups[one], groups[other], T_one_other)
        if explained:
            steps.append(_Step(pair, one, other, T_one_other, explained))
    return sorted(steps, key=lambda step: -step.explained)


def _of_group(
    views: Mapping[str, View], T_group_odom: Mapping[str, Pose2], names: Sequence[str]
) -> View:
    """Return where the robots of a group stand (n, 2) and where they see discs, its frame."""
    return View(
        np.array([T_group_odom[name].apply(views[name].place) for name in names]),
        np.concatenate([T_group_odom[name].apply(views[name].discs) for name in names]),
    )


def _explained(one: View, other: View, T_one_other: Pose2) -> tuple[Pose2, int]:
    """Return how two groups lie to each other, drawn to what agrees, and how many discs do."""
    here, there = np.vstack((one.place, one.discs)), np.vstack((other.place, other.discs))
    apart = _distances(here, T_one_other.apply(there))
    n, m = len(one.place), len(other.place)
    if apart[:n, :m].min() < _APART:
        return T_one_other, 0
    same = apart <= SAME
    explained = int(same[n:].any(axis=1).sum() + same[:, m:].any(axis=0).sum())
    i, j = np.nonzero(same)
    if len(i) >= 2:
        T_one_other = fit_rigid(here[i], there[j])
    return T_one_other, explained


def _distances(points: Floats, others: Floats) -> Floats:
    """Return the distances (n, m) [m] between points (n, 2) and others (m, 2)."""
    off = points[:, None, :] - others[None, :, :]
    distances: Floats = np.hypot(off[..., 0], off[..., 1])
    return distances


def _alike(T: Pose2, other: Pose2) -> bool:
    """Whether two relative poses are the same but for small errors."""
    return T.distance_to(other) <= _ALIKE and abs(wrap_angle(T.theta - other.theta)) <= _ALIKE_TURN
