"""How thick a map's walls are against the truth: a wall drawn twice shows as one that is too thick.

Two robots that disagree about where they are draw the same wall side by side. Scores that ask how
near each occupied cell is to something solid hardly see that, if they forgive as much as the walls
lie apart; and they blame a map that is whole but a little out of place. So here the map is cut
across the true walls. Where the truth has a single wall, all that the map shows as occupied along
the cut must fit into the thickness of that wall, wherever exactly it lies. (A thin wall of which
one face was seen only may hide a second drawing of it within its thickness; then this score is
mild. Walls seen from both sides, and furniture, have no such room.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation, gaussian_filter

from mapping.geometry import Floats, Pose2
from mapping.grid import OBSTACLE, GridGeometry

Mask = npt.NDArray[np.bool_]

REACH = 0.5  # [m] a cut goes to both sides of a surface
GUARD = 0.3  # [m] beyond a cut's ends that the truth must go on as it is there
BESIDE = (-0.3, -0.15, 0.15, 0.3)  # [m] how far aside a wall must be just as thick
STEP = 0.025  # [m] from one point of a cut to the next
SLACK = 0.125  # [m] of thickness forgiven: range noise, and cells that lie askew to the walls
_SMOOTH = 1.5  # [cells] over which a surface's direction is taken


@dataclass(frozen=True, slots=True)
class WallThickness:
    """How thick walls are in a map.

    Attributes:
        cuts: how many cuts across single true walls showed something occupied.
        doubled: share of those on which the wall is thicker than it can be; 0 without any.
        excess_m: mean of what walls are thicker than in truth [m]; 0 without any.
        excess_p95_m: what 95 % of them stay below [m].
    """

    cuts: int
    doubled: float
    excess_m: float
    excess_p95_m: float


def wall_thickness(
    solid: Mask,
    reachable: Mask,
    truth_geometry: GridGeometry,
    map_classes: npt.NDArray[np.uint8],
    map_geometry: GridGeometry,
    T_world_map: Pose2,
) -> WallThickness:
    """Return how thick a map's walls are, cut by cut across the true ones.

    Args:
        solid: (rows, cols) truth.
        reachable: (rows, cols) what robots can get to; only surfaces beside it count.
        truth_geometry: where the truth's cells are, world frame.
        map_classes: (rows, cols) uint8 of UNKNOWN, CLEAR, OBSTACLE.
        map_geometry: where the map's cells are, map frame.
        T_world_map: the team's one transform.
    """
    surfaces, normals = _surfaces(solid, reachable, truth_geometry)
    cuts, allowed = _single_walls(solid, truth_geometry, surfaces, normals)
    cuts_map = T_world_map.inverse().apply(cuts.reshape(-1, 2)).reshape(cuts.shape)
    obstacles: Mask = map_classes == OBSTACLE
    shown = _sample(obstacles, map_geometry, cuts_map, outside=False)
    seen = shown.any(axis=1)
    excess = _spans(shown[seen]) - allowed[seen] - map_geometry.resolution
    if len(excess) == 0:
        return WallThickness(0, 0.0, 0.0, 0.0)
    beyond = np.maximum(excess, 0.0)
    return WallThickness(
        len(excess),
        float((excess > SLACK - 1e-9).mean()),
        float(beyond.mean()),
        float(np.percentile(beyond, 95.0)),
    )


def _surfaces(solid: Mask, reachable: Mask, geometry: GridGeometry) -> tuple[Floats, Floats]:
    """Return solid cells (N, 2) [m] beside reachable ones, and where they face (N, 2), unit."""
    rim = solid & binary_dilation(reachable)
    soft = gaussian_filter(solid.astype(np.float64), _SMOOTH, mode="nearest")
    along_y, along_x = np.gradient(soft, axis=0), np.gradient(soft, axis=1)
    normals: Floats = -np.column_stack((along_x[rim], along_y[rim]))
    lengths = np.hypot(normals[:, 0], normals[:, 1])
    faces = lengths > 1e-3  # not a wall one cell thin, which faces both ways
    points = geometry.centres_of(np.argwhere(rim))[faces]
    unit: Floats = normals[faces] / lengths[faces, np.newaxis]
    return points, unit


def _single_walls(
    solid: Mask, geometry: GridGeometry, surfaces: Floats, normals: Floats
) -> tuple[Floats, Floats]:
    """Return the cuts (N, K, 2) [m] across straight single walls, and how thick these are (N,) [m].

    A wall is straight where cuts a little to both sides find it just as thick: corners and what
    stands near a wall are left out.
    """
    reach = REACH + GUARD
    steps = np.arange(-reach, reach + 0.5 * STEP, STEP)
    cuts = surfaces[:, np.newaxis] + steps[:, np.newaxis] * normals[:, np.newaxis]
    along = np.column_stack((-normals[:, 1], normals[:, 0]))[:, np.newaxis]
    thick = _thicknesses(_sample(solid, geometry, cuts, outside=True))
    straight = ~np.isnan(thick)
    for side in BESIDE:
        beside = _thicknesses(_sample(solid, geometry, cuts + side * along, outside=True))
        straight &= np.abs(beside - thick) < geometry.resolution + 1e-9  # false for NaN
    guard = round(GUARD / STEP)
    return cuts[straight, guard:-guard], thick[straight]


def _thicknesses(inside: Mask) -> Floats:
    """Return the thickness (N,) [m] of the single wall on each cut (N, K); NaN if it is not one.

    What is solid up to the cut's far end is no wall but something massive, of which a map can only
    show the face: thickness 0.
    """
    starts = inside[:, 0].astype(np.int64) + (inside[:, 1:] & ~inside[:, :-1]).sum(axis=1)
    thick: Floats = inside.sum(axis=1) * STEP
    thick[inside[:, 0]] = 0.0
    thick[(starts != 1) | inside[:, -1]] = np.nan
    return thick


def _spans(shown: Mask) -> Floats:
    """Return the distance (N,) [m] from the first to the last True of each row (N, K), both in."""
    first = shown.argmax(axis=1)
    last = shown.shape[1] - 1 - shown[:, ::-1].argmax(axis=1)
    spans: Floats = (last - first + 1) * STEP
    return spans


def _sample(mask: Mask, geometry: GridGeometry, points: Floats, outside: bool) -> Mask:
    """Return the values of a mask at points (N, K, 2) [m], as (N, K); `outside` beyond it."""
    cells = geometry.cells_at(points.reshape(-1, 2))
    held = geometry.contains(cells)
    values = np.full(len(cells), outside)
    values[held] = mask[cells[held, 0], cells[held, 1]]
    return values.reshape(points.shape[:-1])
