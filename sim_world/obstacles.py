"""Random obstacles that leave the floor connected."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt, label

from mapping.cell_box import CellBox
from mapping.geometry import Floats
from mapping.grid import GridGeometry
from sim_world.errors import WorldError
from sim_world.floor_plan import RandomObstacles, disc, turned_box
from sim_world.scene import TRUTH_RESOLUTION, WallScene, draw_solid
from sim_world.walls import build_walls

Mask = npt.NDArray[np.bool_]
Owners = npt.NDArray[np.int32]

# The floor stays connected for the default body too, not only for the wider `passage_m`, so that no
# pocket is left that a robot would fit into but not get to [m].
_BODY_RADIUS = 0.25
# So many throws in a row may fail before the density counts as out of reach.
_PATIENCE = 600


def place_obstacles(
    spec: RandomObstacles,
    solids: Sequence[Floats],
    bare_segments: Floats,
    starts: Floats,
    rng: np.random.Generator,
) -> list[Floats]:
    """Return obstacles, each the corners (K, 2) [m] of a convex polygon.

    One after the other is thrown onto the floor. A throw counts when the obstacle overlaps what is
    there or leaves a passage, keeps away from the starts, and cuts no part of the floor off.

    Args:
        spec: how many, how large, where.
        solids: what is there already, (K, 2) each.
        bare_segments: walls without thickness that are there already, (B, 4).
        starts: (N, 2) [m].
        rng: source of the throws.

    Raises:
        WorldError: the density cannot be reached.
    """
    floor = _Floor(spec, solids, bare_segments, starts)
    obstacles: list[Floats] = []
    failures = 0
    while floor.covered < spec.density:
        corners = _throw(spec, floor.region, rng)
        if floor.take(corners):
            obstacles.append(corners)
            failures = 0
        else:
            failures += 1
        if failures > _PATIENCE:
            raise WorldError(
                f"obstacles.density {spec.density:g} is out of reach while the floor stays "
                f"connected (got {floor.covered:.2f}); lower it, or lower size_m or passage_m"
            )
    return obstacles


def _throw(
    spec: RandomObstacles,
    region: tuple[float, float, float, float],
    rng: np.random.Generator,
) -> Floats:
    """Return one random obstacle; five draws each, whatever its shape."""
    x1, y1, x2, y2 = region
    share_x, share_y, share_length, share_width, share_turn = (float(v) for v in rng.random(5))
    least, most = spec.size_m
    x, y = x1 + share_x * (x2 - x1), y1 + share_y * (y2 - y1)
    length, width = least + share_length * (most - least), least + share_width * (most - least)
    if spec.shape == "disc":
        return disc(x, y, 0.5 * length)
    degrees = 180.0 * share_turn if spec.shape == "turned_box" else 0.0
    return turned_box(x, y, length, width, degrees)


class _Floor:
    """The floor while obstacles are thrown, on the cells of the truth.

    Distances are between cell centres, by the rule of `truth.body_places`.
    """

    def __init__(
        self,
        spec: RandomObstacles,
        solids: Sequence[Floats],
        bare_segments: Floats,
        starts: Floats,
    ) -> None:
        scene = WallScene(build_walls(solids, bare_segments))
        solid, self.geometry = scene.free_truth(TRUTH_RESOLUTION)
        self.region = spec.region or scene.extent
        self._spec = spec
        self._owners = _owners(solid, self.geometry, solids, bare_segments)
        inside = np.zeros(solid.shape, dtype=np.bool_)
        inside[self.geometry.box_around(*self.region).slices] = True
        self._free_at_first: Mask = inside & ~solid
        near_start = np.zeros(solid.shape, dtype=np.bool_)
        for iy, ix in self.geometry.cells_at(starts).tolist():
            near_start[iy, ix] = True
        if len(starts):
            near_start = _distances(near_start) < spec.clear_around_starts_m
        self._kept_clear = near_start
        distances = _distances(solid)
        self._reaches = [r + 0.5 * TRUTH_RESOLUTION for r in (_BODY_RADIUS, 0.5 * spec.passage_m)]
        self._blocked = [distances < reach for reach in self._reaches]
        self._parts = [label(~blocked)[0] for blocked in self._blocked]
        self.covered = 0.0

    def take(self, corners: Floats) -> bool:
        """Place a convex polygon (K, 2) if it may lie there; return whether it may."""
        x1, y1, x2, y2 = self.region
        if not ((corners >= (x1, y1)) & (corners <= (x2, y2))).all():
            return False
        box = _box_around(corners, self.geometry, self._spec.passage_m)
        if box.empty:
            return False
        own = _inside(corners, self.geometry, box)
        if not own.any() or (own & self._kept_clear[box.slices]).any():
            return False
        distances = _distances(own)
        if self._leaves_a_gap(own, distances, box):
            return False
        return self._keeps_connected(own, distances, box)

    def _leaves_a_gap(self, own: Mask, distances: Floats, box: CellBox) -> bool:
        """Whether something is nearer than a passage without being overlapped."""
        owners = self._owners[box.slices]
        close = np.unique(owners[distances < self._spec.passage_m])
        overlapped = np.unique(owners[own])
        return bool(np.setdiff1d(close, overlapped).any())

    def _keeps_connected(self, own: Mask, distances: Floats, box: CellBox) -> bool:
        """Whether no part of the floor would be cut in two; if so the polygon is placed."""
        changed = []
        for reach, blocked, parts in zip(self._reaches, self._blocked, self._parts, strict=True):
            after = blocked.copy()
            after[box.slices] |= distances < reach
            parts_after, count = label(~after)
            # Each part after lies in one part before; two in the same one means a cut.
            before = np.zeros(count + 1, dtype=np.int64)
            before[parts_after.ravel()] = parts.ravel()
            if count == 0 or len(np.unique(before[1:])) < count:
                return False
            changed.append((after, parts_after))
        self._blocked = [after for after, _ in changed]
        self._parts = [parts_after for _, parts_after in changed]
        self._owners[box.slices][own] = int(self._owners.max()) + 1
        free = self._free_at_first & (self._owners == 0)
        self.covered = 1.0 - np.count_nonzero(free) / np.count_nonzero(self._free_at_first)
        return True


def _owners(
    solid: Mask, geometry: GridGeometry, solids: Sequence[Floats], bare_segments: Floats
) -> Owners:
    """Return which solid each cell belongs to, from 2; 1 for the bare walls, 0 for none."""
    owners = solid.astype(np.int32) * (len(bare_segments) > 0)
    for k, corners in enumerate(solids):
        box = _box_around(corners, geometry, 0.0)
        owners[box.slices][_inside(corners, geometry, box)] = k + 2
    return owners


def _box_around(corners: Floats, geometry: GridGeometry, reach: float) -> CellBox:
    """Return the cells within `reach` [m] of a polygon's bounding box."""
    (x1, y1), (x2, y2) = corners.min(axis=0) - reach, corners.max(axis=0) + reach
    return geometry.box_around(float(x1), float(y1), float(x2), float(y2))


def _inside(corners: Floats, geometry: GridGeometry, box: CellBox) -> Mask:
    """Return which cells of `box` a convex polygon (K, 2) makes solid."""
    mask = np.zeros((max(box.iy1 - box.iy0, 0), max(box.ix1 - box.ix0, 0)), dtype=np.bool_)
    part = GridGeometry(
        geometry.resolution,
        geometry.origin_x + box.ix0 * geometry.resolution,
        geometry.origin_y + box.iy0 * geometry.resolution,
        *mask.shape,
    )
    draw_solid(mask, part, corners)
    return mask


def _distances(mask: Mask) -> Floats:
    """Return each cell's distance [m] to the nearest one of a mask that has some."""
    distances: Floats = distance_transform_edt(~mask) * TRUTH_RESOLUTION
    return distances
