"""The judge: how much of the truth a map shows, how right it is, how right trajectories are.

Pure functions on grids and arrays, from the truth's side only: nothing here is shared with an
estimator. Every comparison uses one rigid transform `T_world_map` for the whole team.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation, distance_transform_edt, label

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2, fit_rigid, wrap_angle
from mapping.grid import CLEAR, OBSTACLE, GridGeometry

Mask = npt.NDArray[np.bool_]
Classes = npt.NDArray[np.uint8]

# Tolerance of the map scores [m]: one cell of the 0.15 m grids of Simmons et al. 2000.
TOLERANCE = 0.15
# Below this spread [m] of all matched positions their shape says nothing about the rotation.
_SPREAD_MIN = 0.3


@dataclass(frozen=True, slots=True)
class OccupancyScores:
    """How right a map is.

    Attributes:
        precision_occupied: share of its OBSTACLE cells near something solid; 1 without any.
        recall_occupied: share of the solid cells along reachable space that it shows; 1 if none.
        free_error: share of its CLEAR cells that lie deep in something solid; 0 without any.
    """

    precision_occupied: float
    recall_occupied: float
    free_error: float


def body_places(solid: Mask, geometry: GridGeometry, body_radius: float) -> Mask:
    """Return the cells (rows, cols) at whose centre a disc of `body_radius` [m] fits.

    The disc must not overlap a solid cell; all outside the grid is solid. The distance to a solid
    cell is taken to its nearest face, half a cell nearer than its centre.
    """
    distances = distance_transform_edt(np.pad(~solid, 1, constant_values=False))[1:-1, 1:-1]
    fits: Mask = (distances - 0.5) * geometry.resolution >= body_radius - 1e-9
    return fits & ~solid


def reachable_places(places: Mask, geometry: GridGeometry, starts: npt.ArrayLike) -> Mask:
    """Return the part of `places` connected (over edges) to a start.

    Args:
        places: (rows, cols) bool from `body_places`.
        geometry: where the cells are.
        starts: (N, 2) [m] or more columns, of which the first two count. A start whose own cell is
            no place counts for the nearest one within three cells.
    """
    parts, _ = label(places)
    points = np.asarray(starts, dtype=np.float64)
    wanted = []
    for iy, ix in geometry.cells_at(points.reshape(-1, points.shape[-1])[:, :2]).tolist():
        low_y, low_x = max(iy - 3, 0), max(ix - 3, 0)
        window = parts[low_y : max(iy + 4, 0), low_x : max(ix + 4, 0)]
        rows, cols = np.nonzero(window)
        if len(rows):
            off = (rows + low_y - iy) ** 2 + (cols + low_x - ix) ** 2
            nearest = int(off.argmin())
            wanted.append(int(window[rows[nearest], cols[nearest]]))
    reached: Mask = np.isin(parts, wanted)
    return reached & places


def reachable_area(
    solid: Mask, geometry: GridGeometry, starts: npt.ArrayLike, body_radius: float
) -> Mask:
    """Return the reachable free cells (rows, cols): what a team should map.

    Free, and within one body radius of a place where the body's centre can get to from a start.

    Args:
        solid: (rows, cols) truth.
        geometry: where its cells are.
        starts: (N, 2) [m] or more columns.
        body_radius: [m].
    """
    places = reachable_places(body_places(solid, geometry, body_radius), geometry, starts)
    if not places.any():
        return places
    near: Mask = distance_transform_edt(~places) * geometry.resolution <= body_radius + 1e-9
    return near & ~solid


def coverage(
    reachable: Mask,
    truth_geometry: GridGeometry,
    map_classes: Classes,
    map_geometry: GridGeometry,
    T_world_map: Pose2,
) -> float:
    """Return the share of reachable truth cells whose centre falls in a CLEAR cell of the map.

    Args:
        reachable: (rows, cols) from `reachable_area`.
        truth_geometry: where those cells are, world frame.
        map_classes: (rows, cols) uint8 of UNKNOWN, CLEAR, OBSTACLE.
        map_geometry: where the map's cells are, map frame.
        T_world_map: the team's one transform.
    """
    centres = truth_geometry.centres_of(np.argwhere(reachable))
    return _share_clear(centres, map_classes, map_geometry, T_world_map)


def _share_clear(
    centres_world: Floats, classes: Classes, geometry: GridGeometry, T_world_map: Pose2
) -> float:
    """Return the share of points (N, 2) in CLEAR cells; 0 without points."""
    if len(centres_world) == 0:
        return 0.0
    T_map_world = T_world_map.inverse()
    count = _count_clear(
        centres_world,
        classes,
        math.cos(T_map_world.theta) / geometry.resolution,
        math.sin(T_map_world.theta) / geometry.resolution,
        (T_map_world.x - geometry.origin_x) / geometry.resolution,
        (T_map_world.y - geometry.origin_y) / geometry.resolution,
    )
    return count / len(centres_world)


@compiled
def _count_clear(
    points: Floats, classes: Classes, c: float, s: float, offset_x: float, offset_y: float
) -> int:
    """Count the points that fall in CLEAR cells; the transform is in cells of the map."""
    rows, cols = classes.shape
    count = 0
    for k in range(points.shape[0]):
        ix = math.floor(offset_x + c * points[k, 0] - s * points[k, 1])
        iy = math.floor(offset_y + s * points[k, 0] + c * points[k, 1])
        if 0 <= ix < cols and 0 <= iy < rows and classes[int(iy), int(ix)] == CLEAR:
            count += 1
    return count


def occupancy_scores(
    solid: Mask,
    reachable: Mask,
    truth_geometry: GridGeometry,
    map_classes: Classes,
    map_geometry: GridGeometry,
    T_world_map: Pose2,
    tolerance: float = TOLERANCE,
) -> OccupancyScores:
    """Return how right a map's cells are, to within `tolerance` [m], centre to centre.

    Args:
        solid: (rows, cols) truth.
        reachable: (rows, cols) from `reachable_area`.
        truth_geometry: where the truth's cells are, world frame.
        map_classes: (rows, cols) uint8 of UNKNOWN, CLEAR, OBSTACLE.
        map_geometry: where the map's cells are, map frame.
        T_world_map: the team's one transform.
        tolerance: [m].
    """
    judge = CoverageJudge(solid, truth_geometry, reachable)
    return judge.scores(map_classes, map_geometry, T_world_map, tolerance)


class CoverageJudge:
    """The truth of one world, prepared once so that maps are judged in milliseconds."""

    def __init__(self, solid: Mask, geometry: GridGeometry, reachable: Mask) -> None:
        self.solid = solid
        self.geometry = geometry
        self.reachable = reachable
        self._centres = geometry.centres_of(np.argwhere(reachable))
        rim = solid & binary_dilation(reachable, structure=np.ones((3, 3), dtype=np.bool_))
        self._rim_centres = geometry.centres_of(np.argwhere(rim))
        self._to_solid = _distances_to(solid, geometry)
        self._to_free = _distances_to(~solid, geometry)

    @classmethod
    def for_starts(
        cls, solid: Mask, geometry: GridGeometry, starts: npt.ArrayLike, body_radius: float
    ) -> CoverageJudge:
        """Return the judge for a team that starts at `starts` (N, 2 or more) [m]."""
        return cls(solid, geometry, reachable_area(solid, geometry, starts, body_radius))

    @property
    def area(self) -> float:
        """The reachable area [m2]."""
        return len(self._centres) * self.geometry.resolution**2

    def coverage(
        self, map_classes: Classes, map_geometry: GridGeometry, T_world_map: Pose2
    ) -> float:
        """Return the same as the function `coverage`."""
        return _share_clear(self._centres, map_classes, map_geometry, T_world_map)

    def scores(
        self,
        map_classes: Classes,
        map_geometry: GridGeometry,
        T_world_map: Pose2,
        tolerance: float = TOLERANCE,
    ) -> OccupancyScores:
        """Return the same as the function `occupancy_scores`."""
        obstacles = map_classes == OBSTACLE
        obstacles_world = T_world_map.apply(map_geometry.centres_of(np.argwhere(obstacles)))
        clear_world = T_world_map.apply(map_geometry.centres_of(np.argwhere(map_classes == CLEAR)))
        rim_map = T_world_map.inverse().apply(self._rim_centres)
        to_solid = _sample(self._to_solid, self.geometry, obstacles_world)
        to_free = _sample(self._to_free, self.geometry, clear_world)
        to_obstacle = _sample(_distances_to(obstacles, map_geometry), map_geometry, rim_map)
        reach = tolerance + 1e-9
        return OccupancyScores(
            precision_occupied=_share(to_solid <= reach, 1.0),
            recall_occupied=_share(to_obstacle <= reach, 1.0),
            free_error=_share(to_free > reach, 0.0),
        )


def _distances_to(mask: Mask, geometry: GridGeometry) -> Floats:
    """Return each cell's distance [m] to the nearest cell of `mask`, infinite without any."""
    if not mask.any():
        return np.full(mask.shape, math.inf)
    distances: Floats = distance_transform_edt(~mask) * geometry.resolution
    return distances


def _sample(distances: Floats, geometry: GridGeometry, points: Floats) -> Floats:
    """Return the distances at points (N, 2) [m]; outside the grid the way back to it is added."""
    cells = geometry.cells_at(points)
    inside = np.clip(cells, 0, np.array(geometry.shape) - 1)
    beyond = np.hypot(*(cells - inside).T) * geometry.resolution
    sampled: Floats = distances[inside[:, 0], inside[:, 1]] + beyond
    return sampled


def _share(right: Mask, without_any: float) -> float:
    """Return the share of True, or `without_any` of an empty array."""
    return float(np.count_nonzero(right) / len(right)) if len(right) else without_any


def fit_team(estimated: Mapping[str, Floats], truth: Mapping[str, Floats]) -> Pose2:
    """Return the one `T_world_map` that lays all estimated trajectories best onto the true ones.

    Robots that hardly moved say nothing about the rotation by where they were; then their
    headings decide.

    Args:
        estimated: robot -> (N, 4) as stamp [s], x, y [m], theta [rad], map frame.
        truth: robot -> (M, 4) likewise, world frame, stamps rising.
    """
    pairs = [_matched(estimated[k], truth[k]) for k in sorted(estimated) if k in truth]
    rows_map = np.vstack([np.empty((0, 3)), *(pair[0] for pair in pairs)])
    rows_world = np.vstack([np.empty((0, 3)), *(pair[1] for pair in pairs)])
    T_world_map = fit_rigid(rows_world[:, :2], rows_map[:, :2])
    if len(rows_map) == 0 or _spread(rows_world[:, :2]) >= _SPREAD_MIN:
        return T_world_map
    turns = rows_world[:, 2] - rows_map[:, 2]
    theta = wrap_angle(math.atan2(float(np.sin(turns).sum()), float(np.cos(turns).sum())))
    turned = Pose2(0.0, 0.0, theta).apply(rows_map[:, :2])
    offset = (rows_world[:, :2] - turned).mean(axis=0)
    return Pose2(float(offset[0]), float(offset[1]), theta)


def _spread(points: Floats) -> float:
    """Return the root mean square distance [m] of points (N, 2) from their mean."""
    return math.sqrt(float(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _matched(estimated: Floats, truth: Floats) -> tuple[Floats, Floats]:
    """Return the estimates (N, 3) within the truth's time, and the truth (N, 3) at their stamps."""
    estimates = np.asarray(estimated, dtype=np.float64).reshape(-1, 4)
    known = np.asarray(truth, dtype=np.float64).reshape(-1, 4)
    if len(known) == 0:
        return np.empty((0, 3)), np.empty((0, 3))
    stamps = estimates[:, 0]
    within = estimates[(stamps >= known[0, 0] - 1e-9) & (stamps <= known[-1, 0] + 1e-9)]
    thetas = np.unwrap(known[:, 3])
    columns = (known[:, 1], known[:, 2], thetas)
    return within[:, 1:], np.column_stack(
        [np.interp(within[:, 0], known[:, 0], column) for column in columns]
    )


def trajectory_rmse(
    estimated: Mapping[str, Floats], truth: Mapping[str, Floats], T_world_map: Pose2
) -> dict[str, float | None]:
    """Return each robot's root mean square position error [m], or None without a common stamp.

    Args:
        estimated: robot -> (N, 4) as stamp [s], x, y [m], theta [rad], map frame.
        truth: robot -> (M, 4) likewise, world frame, stamps rising.
        T_world_map: from `fit_team`.
    """
    errors: dict[str, float | None] = {}
    for robot in sorted(estimated):
        rows_map, rows_world = _matched(estimated[robot], truth.get(robot, np.empty((0, 4))))
        off = T_world_map.apply(rows_map[:, :2]) - rows_world[:, :2]
        errors[robot] = math.sqrt(float((off**2).sum(axis=1).mean())) if len(off) else None
    return errors


def overlap(single_coverages: Sequence[float], union_coverage: float) -> float:
    """Return how much was seen more than once: sum of single coverages over the union, minus 1.

    Zero when nothing was seen at all.
    """
    return sum(single_coverages) / union_coverage - 1.0 if union_coverage > 0.0 else 0.0
