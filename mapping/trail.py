"""What a robot's own map says of its way over many metres.

A robot matches each scan with its own map, so its poses scatter around that map and hardly drift:
a few tenths of a degree over thirty metres. The steps from one report to the next do not tell that:
added up, their errors grow as if each were new. So the pose graph is told of longer pieces of way
as well, each as a whole: of what it knows of them, that which the steps do not tell already. Where
it saw nothing, that is nothing. Spans overlap, and what they have in common is counted several
times; they count less by as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Floats, Pose2
from mapping.pose_graph import carried_covariance, turned_covariance
from mapping.way import Report, Way

# One scan's pose scatters by this around a robot's own map [m], [rad].
_SCATTER = np.diag([0.007**2, 0.007**2, math.radians(0.14) ** 2])
# The map itself drifts by this over a metre of way [m], [rad].
_DRIFT = np.diag([0.005**2, 0.005**2, math.radians(0.06) ** 2])
# A step that a robot saw this well or better adds nothing to the drift of its map [m]; a turn
# counts like a shift at a distance of so much [m].
_SEEN, _LEVER = 0.03, 2.5
# So many spans of one length overlap at each place, and their errors are the same in part.
_OVERLAP = 4
_COUNTED = 4.0


@dataclass(frozen=True, slots=True)
class Span:
    """A longer piece of a robot's way.

    Attributes:
        first: the pose graph's node where it begins.
        T_first_last: where it ends, as seen from there.
        information: (3, 3) of that, frame of the end; only what its steps do not tell, may be
            singular.
    """

    first: int
    T_first_last: Pose2
    information: Floats


@dataclass(frozen=True, slots=True)
class _Stop:
    """A node of the pose graph on a robot's way.

    Attributes:
        node: its number.
        T_odom_base: the robot's pose there, in its own map.
        error: (3, 3) covariance of the step from the stop before, odom frame,
        blind: and of it the part that was driven blindly.
        driven: way driven so far [m].
    """

    node: int
    T_odom_base: Pose2
    error: Floats
    blind: Floats
    driven: float


class Trail:
    """The last metres of one robot's way, as its own map has them."""

    def __init__(self, lengths: Sequence[float]) -> None:
        """Tell of spans of these lengths [m]."""
        self._lengths = sorted(lengths)
        self._stops: list[_Stop] = []
        self._told = [0.0 for _ in lengths]

    def begin(self, node: int, report: Report) -> None:
        """Begin anew at a node: nothing is known of the way from those before."""
        none = np.zeros((3, 3))
        self._stops = [_Stop(node, report.T_odom_base, none, none, self._driven)]

    def add(self, node: int, report: Report, way: Way) -> list[Span]:
        """Go on to a node.

        Args:
            node: its number.
            report: what was placed there.
            way: how the robot came there from the node before.

        Returns:
            The spans that end here.
        """
        if way.by_wheels or not self._stops:
            self.begin(node, report)
            return []
        driven = self._driven + math.hypot(way.T_last_base.x, way.T_last_base.y)
        T_odom_base = report.T_odom_base
        error = turned_covariance(way.covariance, -T_odom_base.theta)
        stop = _Stop(node, T_odom_base, error, _blind_part(way.error), driven)
        self._stops.append(stop)
        spans = []
        for k, length in enumerate(self._lengths):
            first = self._first(length)
            if first is None or driven - self._told[k] < length / _OVERLAP:
                continue
            self._told[k] = driven
            spans.append(self._span_from(first))
        self._forget()
        return spans

    @property
    def _driven(self) -> float:
        return self._stops[-1].driven if self._stops else 0.0

    def _first(self, length: float) -> int | None:
        """Return the last stop at least `length` [m] before the newest."""
        for k in range(len(self._stops) - 2, -1, -1):
            if self._driven - self._stops[k].driven >= length:
                return k
        return None

    def _span_from(self, first: int) -> Span:
        """Return the span from a stop to the newest."""
        start, end = self._stops[first], self._stops[-1]
        blind, steps = np.zeros((3, 3)), np.zeros((3, 3))
        for before, stop in zip(self._stops[first:], self._stops[first + 1 :], strict=False):
            dx = stop.T_odom_base.x - before.T_odom_base.x
            dy = stop.T_odom_base.y - before.T_odom_base.y
            blind = carried_covariance(blind, dx, dy) + stop.blind
            steps = carried_covariance(steps, dx, dy) + stop.error
        dx = end.T_odom_base.x - start.T_odom_base.x
        dy = end.T_odom_base.y - start.T_odom_base.y
        scatter = carried_covariance(_SCATTER, dx, dy) + _SCATTER
        # A heading that drifts evenly shifts the end by half of what it turned.
        drift = carried_covariance(_DRIFT * (end.driven - start.driven), 0.5 * dx, 0.5 * dy)
        more = _information_beyond(blind + scatter + drift, steps) / _COUNTED
        return Span(
            start.node,
            start.T_odom_base.inverse() @ end.T_odom_base,
            turned_covariance(more, end.T_odom_base.theta),
        )

    def _forget(self) -> None:
        """Let go of stops that no span can begin at any more."""
        farthest = self._first(self._lengths[-1]) if self._lengths else None
        if farthest:
            del self._stops[:farthest]


def _blind_part(error: Floats) -> Floats:
    """Return the covariance (3, 3) of a step less what is usual for one whose robot sees walls."""
    scale = np.outer((1.0, 1.0, _LEVER), (1.0, 1.0, _LEVER))
    strengths, directions = np.linalg.eigh(error * scale)
    kept = np.maximum(strengths - _SEEN**2, 0.0)
    blind: Floats = (directions * kept) @ directions.T / scale
    return blind


def _information_beyond(covariance: Floats, known: Floats) -> Floats:
    """Return the information (3, 3) by which a covariance knows more than another, if it does."""
    scale = np.outer((1.0, 1.0, _LEVER), (1.0, 1.0, _LEVER))
    gained = np.linalg.inv(covariance) - np.linalg.inv(known)
    strengths, directions = np.linalg.eigh(gained / scale)
    beyond: Floats = (directions * np.maximum(strengths, 0.0)) @ directions.T * scale
    return beyond
