"""Where robots wait that have nothing to explore.

An idle robot does best where the way to whatever it will be given next is short: at the cell from
which the remaining frontiers, each weighted by what is to be gained there, are nearest on average.
Several idle robots share the frontiers among themselves, so that each place serves the frontiers
that the others leave far. Nobody waits in a doorway, in a narrow corridor, or in another's way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from coordination.bid import near
from coordination.task import Point
from mapping.bucket_wave import BLOCKED
from mapping.geometry import Floats
from mapping.grid import Cells, GridGeometry
from mapping.path_planning import cost_field

# Stands in for the way to a frontier that cannot be got to from a cell [m]: much, but finite, so
# that a cell from which one of ten frontiers cannot be reached is not as bad as a closed room.
FAR = 200.0


class WaitingSettings(BaseModel):
    """Settings of the search for waiting places.

    Attributes:
        cell_m: edge of the cells of the search; at most half as thick as a wall with the robot's
            radius on both sides, or walls would leak.
        clearance_m: how far from anything solid or unknown to wait, where there is room enough: a
            teammate must be able to pass.
        away_m: how far to stay from other robots and their announced paths.
        spread_m: how far idle robots stay from each other.
        frontiers_max: at most so many frontiers are considered, those with most to gain.
        merge_m: frontiers closer than this count as one.
        travel_weight: what a metre of way to the waiting place counts, against a metre of expected
            way from there. Small, but not 0: no robot crosses the floor for a metre's advantage.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cell_m: Annotated[float, Field(gt=0.0)] = 0.2
    clearance_m: Annotated[float, Field(ge=0.0)] = 0.85
    away_m: Annotated[float, Field(ge=0.0)] = 1.0
    spread_m: Annotated[float, Field(ge=0.0)] = 2.0
    frontiers_max: Annotated[int, Field(ge=1)] = 16
    merge_m: Annotated[float, Field(ge=0.0)] = 2.0
    travel_weight: Annotated[float, Field(ge=0.0)] = 0.15


@dataclass(frozen=True, slots=True)
class IdleRobot:
    """A robot without anything to explore: its name and place (x, y) [m], map frame."""

    robot: str
    position: Point


def waiting_places(
    weights: npt.NDArray[np.uint8],
    clearance: npt.NDArray[np.float32],
    geometry: GridGeometry,
    idle: Sequence[IdleRobot],
    frontiers: npt.ArrayLike,
    gains: npt.ArrayLike,
    occupied: npt.ArrayLike = (),
    settings: WaitingSettings | None = None,
) -> dict[str, Point]:
    """Return where each idle robot should wait, (x, y) [m], map frame.

    The places are found one after the other, each the best next to those found before (greedy
    k-median), and each goes to the idle robot with the shortest way to it.

    Args:
        weights: (rows, cols) uint8, see `mapping.path_planning.traversal_weights`.
        clearance: (rows, cols) float32 [m], distance to the nearest obstacle or unknown cell, may
            be cut off at `clearance_m` or more.
        geometry: where these cells are.
        idle: the robots, in an order that breaks ties.
        frontiers: (n, 2) [m], map frame, all that is left to explore.
        gains: (n,) expected information there [m2].
        occupied: (m, 2) [m], map frame: other robots, and points of their paths, at most `away_m`
            apart.
        settings: see `WaitingSettings`.

    Returns:
        A place for each robot that has one it can get to; none at all without frontiers.

    Source: Simmons et al. 2000, section "Conclusions" (idle robots).
    """
    settings = settings or WaitingSettings()
    targets, demand = _representatives(frontiers, gains, settings)
    if len(targets) == 0 or not idle:
        return {}
    coarse, room, where = _coarsened(weights, clearance, geometry, settings.cell_m)
    cells = np.argwhere(coarse != BLOCKED)
    if len(cells) == 0:
        return {}
    ways = np.minimum([_costs(coarse, where, target, cells) for target in targets], FAR)
    travel = np.array([_costs(coarse, where, robot.position, cells) for robot in idle])
    points = where.centres_of(cells)
    allowed = _allowed(points, room[cells[:, 0], cells[:, 1]], occupied, travel, settings)
    return _spread(idle, points, allowed, travel, ways, demand, settings)


def _spread(
    idle: Sequence[IdleRobot],
    points: Floats,
    allowed: npt.NDArray[np.bool_],
    travel: Floats,
    ways: Floats,
    demand: Floats,
    settings: WaitingSettings,
) -> dict[str, Point]:
    """Return places by greedy k-median over the allowed of `points` (n, 2).

    `travel` (robots, n) and `ways` (frontiers, n) are ways [m], `demand` (frontiers,) sums to 1.
    """
    places: dict[str, Point] = {}
    served = np.full(len(demand), FAR)
    waiting = list(range(len(idle)))
    while waiting:
        expected = np.zeros(len(points))
        for way, best, share in zip(ways, served, demand, strict=True):
            expected += share * np.minimum(way, best)
        own = travel[waiting].min(axis=0)
        total = np.where(allowed & np.isfinite(own), expected, np.inf)
        total += settings.travel_weight * np.where(np.isfinite(own), own, 0.0)
        cell = int(np.argmin(total))
        if not np.isfinite(total[cell]):
            break
        robot = waiting.pop(int(np.argmin(travel[waiting, cell])))
        x, y = points[cell]
        places[idle[robot].robot] = (float(x), float(y))
        served = np.minimum(served, ways[:, cell])
        allowed = allowed & ~near(points, points[cell], settings.spread_m)
    return places


def _representatives(
    frontiers: npt.ArrayLike, gains: npt.ArrayLike, settings: WaitingSettings
) -> tuple[Floats, Floats]:
    """Return the frontiers that matter (k, 2) [m], and each one's share of the gain (k,)."""
    places = np.asarray(frontiers, dtype=np.float64).reshape(-1, 2)
    worth = np.maximum(np.asarray(gains, dtype=np.float64).reshape(-1), 0.0)
    kept: list[int] = []
    demand: list[float] = []
    for row in np.argsort(-worth, kind="stable"):
        away = np.hypot(*(places[kept] - places[row]).T)
        if kept and away.min() < settings.merge_m:
            demand[int(np.argmin(away))] += float(worth[row])
        elif len(kept) < settings.frontiers_max:
            kept.append(int(row))
            demand.append(float(worth[row]))
    shares = np.array(demand)
    return places[kept], shares / shares.sum() if shares.sum() > 0.0 else shares


def _coarsened(
    weights: npt.NDArray[np.uint8],
    clearance: npt.NDArray[np.float32],
    geometry: GridGeometry,
    cell: float,
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32], GridGeometry]:
    """Return weights and clearance of cells about `cell` [m] wide, and where these are.

    A coarse cell may be entered if any of its fine ones may, at their least weight, and has their
    least clearance.
    """
    step = max(1, round(cell / geometry.resolution))
    rows, cols = -(-geometry.rows // step), -(-geometry.cols // step)
    pad = ((0, rows * step - geometry.rows), (0, cols * step - geometry.cols))
    dear = np.where(weights == BLOCKED, np.uint8(255), weights)
    blocks = np.pad(dear, pad, constant_values=255).reshape(rows, step, cols, step)
    coarse = blocks.min(axis=(1, 3))
    room = np.pad(clearance, pad).reshape(rows, step, cols, step).min(axis=(1, 3))
    where = GridGeometry(
        geometry.resolution * step, geometry.origin_x, geometry.origin_y, rows, cols
    )
    return np.where(coarse == 255, np.uint8(BLOCKED), coarse), room, where


def _costs(
    weights: npt.NDArray[np.uint8], where: GridGeometry, point: npt.ArrayLike, cells: Cells
) -> Floats:
    """Return the ways [m] from a point to `cells` (n, 2); inf where none leads.

    A frontier, or a robot, may be too near to a wall for the body's centre: the way begins at any
    cell close by.
    """
    centre = where.cells_at(point)[0]
    around = np.argwhere(np.ones((5, 5), dtype=np.bool_)) - 2
    return cost_field(weights, centre + around, where.resolution).at(cells)


def _allowed(
    points: Floats,
    room: npt.NDArray[np.float32],
    occupied: npt.ArrayLike,
    travel: Floats,
    settings: WaitingSettings,
) -> npt.NDArray[np.bool_]:
    """Return which of `points` (n, 2) are fit for waiting.

    Where no place that can be got to is wide enough, as wide as there is must do.
    """
    free = ~near(points, occupied, settings.away_m)
    reached = free & np.isfinite(travel).any(axis=0)
    if not reached.any():
        return reached
    wanted = min(settings.clearance_m, float(room[reached].max()))
    result: npt.NDArray[np.bool_] = reached & (room >= wanted)
    return result
