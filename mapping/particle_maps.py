"""The maps of all particles: walls in shared tiles, each particle's own."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.geometry import Floats
from mapping.grid import GridGeometry
from mapping.match_map import MapSettings
from mapping.newton_ascent import invert
from mapping.shared_tiles import SIDE, Ids, SharedTiles, Shorts
from mapping.surface_map import LAYERS
from mapping.tile_matching import match_tiles
from mapping.wall_tiles import FIELDS, add_end_points

# Maps grow by so many tiles at once, so that growing is rare.
CHUNK = 8

# A map that holds nothing: lattice, table and pool.
_NOBODY: tuple[tuple[float, float, float], Ids, Shorts] = (
    (0.0, 0.0, 1.0),
    np.zeros((LAYERS, 0, 0), dtype=np.int32),
    np.zeros((0, SIDE * SIDE, FIELDS), dtype=np.int16),
)


@dataclass(frozen=True, slots=True)
class WallSettings:
    """How the walls of particles are kept, over and above `SurfaceSettings`.

    Attributes:
        cell: edge of a cell [m]. With the mean of its end points a cell tells where a wall is far
            more finely than its size; coarse cells take less memory.
        reach: walls up to this far from an end point are looked for [cells].
        fit_radius: the line through a wall cell is fitted to the cells up to this far [cells].
    """

    cell: float = 0.1
    reach: int = 3
    fit_radius: int = 1


class ParticleMaps:
    """Walls as each particle has them.

    Attributes:
        settings: everything that shapes a map.
        walls: how walls are kept.
        tiles: the cells, shared between the particles.
        lattice: where the tiles are, one cell of this geometry per tile, map frame.
        scans: number of scans inserted.
        others: what others saw, a single map in the same frame, which all particles share; or None.
    """

    __slots__ = ("_widenings", "lattice", "others", "scans", "settings", "tiles", "walls")

    def __init__(self, count: int, settings: MapSettings, walls: WallSettings) -> None:
        self.settings = settings
        self.walls = walls
        self.tiles = SharedTiles(count, LAYERS, FIELDS)
        self.lattice = GridGeometry(walls.cell * SIDE, 0.0, 0.0, 1, 1)
        self.scans = 0
        self.others: ParticleMaps | None = None
        self._widenings = np.array(settings.matching.widenings)

    def match(
        self,
        particle: int,
        points_base: Floats,
        start: Floats,
        prior: Floats,
        covariance: Floats,
        widenings: Floats | None = None,
    ) -> tuple[Floats, Floats, float, int]:
        """Return where a scan fits the map of one particle, and that of the others, best.

        Args:
            particle: whose map.
            points_base: (N, 4), see `scan_points`.
            start: (3,) pose to start from, map frame.
            prior: (3,) mean of the motion model, map frame.
            covariance: (3, 3) of the motion model.
            widenings: see `MatchSettings`, whose own are taken by default.

        Returns:
            The pose (3,), its covariance (3, 3), the log of prior times likelihood there, and how
            many end points lie at walls of the particle's own map.
        """
        matching, surface = self.settings.matching, self.settings.surface
        perception = matching.perception
        information, posterior = np.empty((3, 3)), np.empty((3, 3))
        invert(covariance, information)
        pose = start.copy()
        value, explained = match_tiles(
            points_base,
            pose,
            self._corner,
            self._depth,
            self.tiles.tables[particle],
            self.tiles.pool,
            (self.walls.reach, self.walls.fit_radius, surface.doubt, float(self.scans),
             surface.line_below, surface.blob_above),
            (perception.sigma, perception.outlier, perception.beam_weight),
            self._widenings if widenings is None else widenings,
            (matching.iterations, matching.tolerance, matching.lever),
            (prior[0], prior[1], prior[2]),
            information,
            posterior,
            self._theirs(),
        )  # fmt: skip
        return pose, posterior, value, explained

    def insert(self, scans: Iterable[tuple[Floats, Floats]]) -> None:
        """Insert the scans of one update into the map of every particle.

        Args:
            scans: each (N, 4), see `scan_points`, with where each particle has the robot,
                (particles, 3), map frame.
        """
        tiles = self.tiles
        for points_base, poses in scans:
            self.scans += 1
            self._grow(points_base, poses)
            tiles.reserve(len(points_base) * len(poses))
            add_end_points(
                points_base,
                poses,
                self._corner,
                self._depth,
                self.scans,
                tiles.tables,
                tiles.pool,
                tiles.references,
                tiles.free,
            )

    def inherit(self, parents: npt.NDArray[np.int64]) -> None:
        """Give particle i the map that particle `parents[i]` has now, for each i."""
        self.tiles.inherit(parents)

    def _theirs(self) -> tuple[tuple[float, float, float], Ids, Shorts]:
        """Return lattice, table and pool of what others saw."""
        others = self.others
        return (others._corner, others.tiles.tables[0], others.tiles.pool) if others else _NOBODY

    @property
    def _corner(self) -> tuple[float, float, float]:
        """Corner (x, y) of the lattice and edge of a cell [m], map frame."""
        return self.lattice.origin_x, self.lattice.origin_y, self.walls.cell

    @property
    def _depth(self) -> float:
        """How far behind its surface an end point's cell lies [m]."""
        return self.settings.integration.depth * self.walls.cell

    def _grow(self, points_base: Floats, poses: Floats) -> None:
        """Cover the end points (N, 4) of a scan at all poses (particles, 3), map frame."""
        if len(points_base) == 0:
            return
        reach = math.sqrt(np.square(points_base[:, :2]).sum(axis=1).max()) + self._depth
        x_min, y_min = poses[:, :2].min(axis=0) - reach
        x_max, y_max = poses[:, :2].max(axis=0) + reach
        self.lattice, padding = self.lattice.grown(x_min, y_min, x_max, y_max, CHUNK)
        self.tiles.grow(padding)
