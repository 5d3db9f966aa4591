"""The maps of all particles: walls in shared tiles, each particle's own."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.geometry import Floats
from mapping.grid import GridGeometry, Padding
from mapping.match_map import MapSettings
from mapping.newton_ascent import invert
from mapping.shared_tiles import SIDE, SharedTiles
from mapping.surface_map import LAYERS
from mapping.tile_matching import match_tiles
from mapping.wall_tiles import FIELDS, add_end_points

# Maps grow by so many tiles at once, so that growing is rare.
CHUNK = 8


class ParticleMaps:
    """Walls as each particle has them.

    Attributes:
        settings: everything that shapes a map.
        tiles: the cells, shared between the particles.
        lattice: where the tiles are, one cell of this geometry per tile, map frame.
        scans: number of scans inserted.
    """

    __slots__ = ("_widenings", "lattice", "scans", "settings", "tiles")

    def __init__(self, count: int, settings: MapSettings) -> None:
        self.settings = settings
        self.tiles = SharedTiles(count, LAYERS, FIELDS)
        self.lattice = GridGeometry(settings.resolution * SIDE, 0.0, 0.0, 1, 1)
        self.scans = 0
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
        """Return where a scan fits the map of one particle best.

        Args:
            particle: whose map.
            points_base: (N, 4), see `scan_points`.
            start: (3,) pose to start from, map frame.
            prior: (3,) mean of the motion model, map frame.
            covariance: (3, 3) of the motion model.
            widenings: see `MatchSettings`, whose own are taken by default.

        Returns:
            The pose (3,), its covariance (3, 3), the log of prior times likelihood there, and how
            many end points lie at walls.
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
            (surface.reach, surface.fit_radius, surface.doubt, float(self.scans),
             surface.line_below, surface.blob_above),
            (perception.sigma, perception.outlier, perception.beam_weight),
            self._widenings if widenings is None else widenings,
            (matching.iterations, matching.tolerance, matching.lever),
            (prior[0], prior[1], prior[2]),
            information,
            posterior,
        )  # fmt: skip
        return pose, posterior, value, explained

    def insert(self, points_base: Floats, poses: Floats) -> None:
        """Insert a scan into the map of every particle.

        Args:
            points_base: (N, 4), see `scan_points`.
            poses: (particles, 3), where each particle has the robot, map frame.
        """
        if len(points_base) == 0:
            return
        self.scans += 1
        reach = float(np.sqrt(np.square(points_base[:, :2]).sum(axis=1).max())) + self._depth
        low, high = poses.min(axis=0), poses.max(axis=0)
        self._grow(low[0] - reach, low[1] - reach, high[0] + reach, high[1] + reach)
        tiles = self.tiles
        for particle, pose in enumerate(poses):
            tiles.reserve(len(points_base))
            add_end_points(
                points_base,
                (pose[0], pose[1], pose[2]),
                self._corner,
                self._depth,
                float(self.scans),
                tiles.tables[particle],
                tiles.pool,
                tiles.references,
                tiles.free,
            )

    def inherit(self, parents: npt.NDArray[np.int64]) -> None:
        """Give particle i the map that particle `parents[i]` has now, for each i."""
        self.tiles.inherit(parents)

    @property
    def _corner(self) -> tuple[float, float, float]:
        """Corner (x, y) of the lattice and edge of a cell [m], map frame."""
        return self.lattice.origin_x, self.lattice.origin_y, self.settings.resolution

    @property
    def _depth(self) -> float:
        """How far behind its surface an end point's cell lies [m]."""
        return self.settings.integration.depth * self.settings.resolution

    def _grow(self, x_min: float, y_min: float, x_max: float, y_max: float) -> Padding:
        """Cover a rectangle [m], map frame; return by how many tiles the maps grew."""
        self.lattice, padding = self.lattice.grown(x_min, y_min, x_max, y_max, CHUNK)
        self.tiles.grow(padding)
        return padding
