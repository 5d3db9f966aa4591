"""The judge listens to the server like any observer and measures its map against the truth.

It alone knows both: the team's map, as the server publishes it, and where everything really is. It
tells nobody, except that it can end a mission at a wanted coverage.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from mapping.geometry import Floats, Pose2, fit_rigid
from mapping.grid import UNKNOWN, GridGeometry, classify, geometry_around
from protocol.map_cells import LARGEST_CELLS, dequantise, unpack_cells
from protocol.messages import MapDelta, MapSnapshot, Message, TeamPoses
from sim_world.truth import CoverageJudge

_FRESH = 0.5  # [s]
_KEPT_PAIRS = 1000  # pose pairs kept for the fit; older ones are thinned out


@dataclass(slots=True)
class Judge:
    """Follows the team's map and poses.

    Args:
        coverage: measures a map against the truth.
        p_obstacle: threshold above which a cell counts as occupied.
        p_clear: threshold below which a cell counts as free.
    """

    coverage: CoverageJudge
    p_obstacle: float
    p_clear: float
    geometry: GridGeometry | None = None
    number: int = 0
    timeline: list[tuple[float, float]] = field(default_factory=list)
    T_world_map: Pose2 = field(default_factory=lambda: Pose2(0.0, 0.0, 0.0))
    _pairs: Floats = field(default_factory=lambda: np.empty((2 * _KEPT_PAIRS, 4)))
    _paired: int = 0
    _changed: bool = False
    _class_of_byte: npt.NDArray[np.uint8] = field(init=False)
    _classes: npt.NDArray[np.uint8] = field(default_factory=lambda: np.zeros((0, 0), np.uint8))

    def __post_init__(self) -> None:
        """Look up once what class each cell's byte stands for."""
        steps = np.arange(256, dtype=np.uint8).view(np.int8)
        self._class_of_byte = classify(dequantise(steps), self.p_obstacle, self.p_clear)

    def hear(self, message: Message, truth: dict[str, Pose2], now: float) -> bool:
        """Take a message that the server publishes; return false when a map delta was missed.

        Args:
            message: a map snapshot or delta, team poses, or something of no interest.
            truth: the robots' true poses, world frame, by name.
            now: mission time [s].

        Raises:
            ValueError: the bytes do not hold the cells announced, or the map would grow beyond
                all reason.
        """
        if isinstance(message, MapSnapshot):
            self._snapshot(message)
        elif isinstance(message, MapDelta):
            if message.number > self.number + 1 or (self.geometry is None and message.number > 1):
                return False
            self._delta(message)
        elif isinstance(message, TeamPoses):
            self._poses(message, truth, now)
        return True

    def measure(self, now: float) -> float:
        """Enter the coverage at `now` [s] in the timeline and return it."""
        covered = self.timeline[-1][1] if self.timeline else 0.0
        if self._changed and self.geometry is not None:
            classes = self.classes()
            self.T_world_map = self._fit()
            covered = self.coverage.coverage(classes, self.geometry, self.T_world_map)
            self._changed = False
        self.timeline.append((now, covered))
        return covered

    def classes(self) -> npt.NDArray[np.uint8]:
        """Return the class of each cell of the map as heard so far, (rows, cols)."""
        return self._classes

    def _snapshot(self, message: MapSnapshot) -> None:
        self.geometry = GridGeometry(
            message.resolution_m, message.origin_x_m, message.origin_y_m, message.rows, message.cols
        )
        self._classes = self._classes_of(message)
        self.number, self._changed = message.number, True

    def _delta(self, message: MapDelta) -> None:
        if message.number <= self.number:
            return
        resolution = message.resolution_m
        x, y = message.lattice_x * resolution, message.lattice_y * resolution
        half = 0.5 * resolution
        far_x, far_y = x + message.cols * resolution - half, y + message.rows * resolution - half
        classes = self._classes_of(message)
        if self.geometry is None:
            self.geometry = geometry_around(x + half, y + half, far_x, far_y, resolution)
            self._classes = np.full(self.geometry.shape, UNKNOWN, np.uint8)
        larger, padding = self.geometry.grown(x + half, y + half, far_x, far_y)
        if larger.rows * larger.cols > LARGEST_CELLS:
            raise ValueError(f"a map of {larger.rows} x {larger.cols} cells is not believed")
        self.geometry = larger
        if not padding.none:
            self._classes = padding.pad(self._classes, UNKNOWN)
        iy, ix = self.geometry.cell_at(x + half, y + half)
        self._classes[iy : iy + message.rows, ix : ix + message.cols] = classes
        self.number, self._changed = message.number, True

    def _classes_of(self, message: MapSnapshot | MapDelta) -> npt.NDArray[np.uint8]:
        """Return the classes (rows, cols) of the cells that a message brings."""
        cells = unpack_cells(message.cells, message.rows, message.cols)
        return self._class_of_byte[cells.view(np.uint8)]

    def _poses(self, message: TeamPoses, truth: dict[str, Pose2], now: float) -> None:
        """Keep where robots believe to be beside where they are; old news say where they were."""
        for name, (stamp, x, y, _theta) in zip(
            message.robots, message.poses_map.tolist(), strict=False
        ):
            if name in truth and now - stamp <= _FRESH:
                self._pairs[self._paired] = truth[name].x, truth[name].y, x, y
                self._paired += 1
        if self._paired > _KEPT_PAIRS:
            thinned = self._pairs[: self._paired : 2].copy()
            self._paired = len(thinned)
            self._pairs[: self._paired] = thinned

    def _fit(self) -> Pose2:
        """Return the rigid transform that best lays the team's map onto the world."""
        pairs = self._pairs[: self._paired]
        spread = float(np.ptp(pairs[:, :2], axis=0).max()) if len(pairs) else 0.0
        if len(pairs) < 3 or spread < 1.0 or not math.isfinite(spread):
            return self.T_world_map
        return fit_rigid(pairs[:, :2], pairs[:, 2:])
