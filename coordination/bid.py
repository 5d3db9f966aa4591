"""Bids of robots, and how much the regions they would see overlap.

A bid is what a robot expects of every frontier place it could go to: the information it would gain
there, the way it would have to drive, and a rectangle around the region it would see.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.grid import Cells


@dataclass(frozen=True, slots=True, eq=False)
class RobotBid:
    """What one robot expects of the places it could go to.

    Attributes:
        robot: who bids.
        number: counts the robot's bids.
        map_number: the map it was made on.
        T_map_base: where the robot stood.
        places: (n, 2) [m], map frame.
        gains: (n,) expected information [m2].
        costs: (n,) path length [m].
        rectangles: (n, 4) x_min, y_min, x_max, y_max [m] of the information gain regions.
        unreachable: (k, 2) [m] frontier places this body cannot get to.
        losses: (n,) [m2], how much less the robot expects of the rest of its route when it goes
            there first.
        cost_weight: factor on this robot's path costs; more than 1 for a slow robot.
    """

    robot: str
    number: int
    map_number: int
    T_map_base: Pose2
    places: Floats
    gains: Floats
    costs: Floats
    rectangles: Floats
    unreachable: Floats
    losses: Floats
    cost_weight: float = 1.0

    def __len__(self) -> int:
        return len(self.places)

    def only(self, rows: npt.NDArray[np.bool_]) -> RobotBid:
        """Return the bid with just the places in `rows` (n,)."""
        return RobotBid(
            self.robot,
            self.number,
            self.map_number,
            self.T_map_base,
            self.places[rows],
            self.gains[rows],
            self.costs[rows],
            self.rectangles[rows],
            self.unreachable,
            self.losses[rows],
            self.cost_weight,
        )

    def without(self, points: npt.ArrayLike, radius: float) -> RobotBid:
        """Return the bid less all places within `radius` [m] of any of `points` (m, 2) [m]."""
        near_any = near(self.places, points, radius)
        return self.only(~near_any) if near_any.any() else self


def near(places: Floats, points: npt.ArrayLike, radius: float) -> npt.NDArray[np.bool_]:
    """Return for each of `places` (n, 2) whether one of `points` (m, 2) is within `radius` [m]."""
    others = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    dx = places[:, 0, np.newaxis] - others[:, 0]
    dy = places[:, 1, np.newaxis] - others[:, 1]
    close: npt.NDArray[np.bool_] = dx * dx + dy * dy <= radius * radius
    result: npt.NDArray[np.bool_] = np.logical_or.reduce(close, axis=1)
    return result


def inside(places: Floats, rectangle: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Return for each of `places` (n, 2) whether it lies in or on `rectangle` (4,) [m]."""
    x0, y0, x1, y1 = np.asarray(rectangle, dtype=np.float64).reshape(4)
    x, y = places[:, 0], places[:, 1]
    result: npt.NDArray[np.bool_] = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
    return result


@compiled
def _covered_area(
    x0: float, y0: float, x1: float, y1: float, taken: Floats, cut: Floats, edges: Floats
) -> float:
    """Return the area of a rectangle [m2] under the union of `taken`, or -1 if none touches it.

    The taken rectangles, cut to this one, divide it into upright strips; in each strip the union is
    a set of intervals. `taken` (m, 4) is in order of y_min; `cut` (m, 4) and `edges` (2 m,) are
    room to work in.
    """
    count = 0
    for i in range(len(taken)):
        left, right = max(x0, taken[i, 0]), min(x1, taken[i, 2])
        low, high = max(y0, taken[i, 1]), min(y1, taken[i, 3])
        if left <= right and low <= high:
            cut[count, 0], cut[count, 1], cut[count, 2], cut[count, 3] = left, low, right, high
            edges[2 * count], edges[2 * count + 1] = left, right
            count += 1
    if count == 0:
        return -1.0
    lines = np.sort(edges[: 2 * count])
    covered = 0.0
    for k in range(2 * count - 1):
        top, length = y0, 0.0
        for i in range(count):  # by y_min, so one pass from the bottom up is enough
            if cut[i, 0] <= lines[k] and cut[i, 2] >= lines[k + 1] and cut[i, 3] > top:
                length += cut[i, 3] - max(cut[i, 1], top)
                top = cut[i, 3]
        covered += (lines[k + 1] - lines[k]) * length
    return covered


@compiled
def overlap_fractions(rectangles: Floats, taken: Floats) -> Floats:
    """Return how much of each rectangle lies under the union of the taken ones, in [0, 1].

    d_j = Area(IGR_j and (union of IGR_i)) / Area(IGR_j), exactly.

    Args:
        rectangles: (n, 4) x_min, y_min, x_max, y_max [m].
        taken: (m, 4) likewise.

    Returns:
        (n,). A rectangle without area counts as covered if it touches a taken one.

    Source: Simmons et al. 2000, section "Assigning Tasks".
    """
    fractions = np.zeros(len(rectangles))
    ordered = taken[np.argsort(taken[:, 1], kind="mergesort")]
    cut = np.empty((len(taken), 4))
    edges = np.empty(2 * len(taken))
    for j in range(len(rectangles)):
        x0, y0, x1, y1 = rectangles[j, 0], rectangles[j, 1], rectangles[j, 2], rectangles[j, 3]
        covered = _covered_area(x0, y0, x1, y1, ordered, cut, edges)
        if covered >= 0.0:
            area = (x1 - x0) * (y1 - y0)
            fractions[j] = min(covered / area, 1.0) if area > 0.0 else 1.0
    return fractions


def overlap_fraction(rectangle: npt.ArrayLike, taken: npt.ArrayLike) -> float:
    """Return how much of one rectangle (4,) lies under the union of `taken` (m, 4), in [0, 1]."""
    one = np.asarray(rectangle, dtype=np.float64).reshape(1, 4)
    others = np.asarray(taken, dtype=np.float64).reshape(-1, 4)
    return float(overlap_fractions(one, others)[0])


def true_overlap(cells: Cells, taken: Cells) -> float:
    """Return the share of `cells` also in `taken`: what the overlap of rectangles approximates.

    Args:
        cells: (n, 2) as (iy, ix), the information gain region of a place.
        taken: (m, 2) as (iy, ix), all cells of the regions already taken; may repeat.

    Source: Simmons et al. 2000, "the true overlap (obtained by counting the actual number of
    overlapping cells)".
    """
    if len(cells) == 0 or len(taken) == 0:
        return 0.0
    width = int(max(cells[:, 1].max(), taken[:, 1].max())) + 1
    shift = int(min(cells[:, 1].min(), taken[:, 1].min()))
    keys = cells[:, 0] * (width - shift) + (cells[:, 1] - shift)
    taken_keys = taken[:, 0] * (width - shift) + (taken[:, 1] - shift)
    return float(np.isin(keys, taken_keys).mean())
