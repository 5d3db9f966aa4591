"""The walls that others saw, as one map that all particles of a filter share.

A particle's own map is its own opinion of where it drove. What others saw lies where they say: for
all particles alike. So there is one such map, and nothing of it is copied when particles are drawn
anew.

Source: Pfingsthorn et al. 2007, section 5: "As a logical next step, the fused pose graph map should
be used in the particle filter mapping algorithm in order to reuse other robot's observations."
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.estimator import OthersScan
from mapping.match_map import MapSettings
from mapping.particle_maps import ParticleMaps, WallSettings
from mapping.scan_points import scan_points


class OthersMap:
    """The scans of others, and the walls drawn from them.

    Args:
        settings: everything that shapes a map, as of the particles' own.
        walls: how walls are kept.

    Attributes:
        walls: the map, odom frame; None while there is no scan.
        drawn: how many scans were drawn, counting those drawn again.
    """

    def __init__(self, settings: MapSettings, walls: WallSettings) -> None:
        self.walls: ParticleMaps | None = None
        self.drawn = 0
        self._settings = settings, walls
        self._told: Sequence[OthersScan] = ()
        self._held: dict[tuple[tuple[str, int], int], OthersScan] = {}

    def tell(self, scans: Sequence[OthersScan]) -> None:
        """Note all scans there are, in place of all that was told before; drawn by `follow`."""
        self._told = scans

    def follow(self) -> None:
        """Draw what was told.

        Scans that are new are added. When one was moved or taken back all are drawn anew: an end
        point cannot be taken out of a cell again.
        """
        told = {(each.author, each.number): each for each in self._told}
        kept = all(_stays(each, told.get(key)) for key, each in self._held.items())
        new = [each for key, each in told.items() if not (kept and key in self._held)]
        if not kept:
            self.walls = None
        self._held = told
        if new and self.walls is None:
            self.walls = ParticleMaps(1, *self._settings)
        if self.walls is not None:
            poses = [np.array([each.T_odom_base.as_tuple()]) for each in new]
            points = [scan_points(each.scan) for each in new]
            self.walls.insert(zip(points, poses, strict=True))
            self.drawn += len(new)


def _stays(held: OthersScan, told: OthersScan | None) -> bool:
    """Whether it is the same scan still, at the same place."""
    return told is not None and told.scan is held.scan and told.T_odom_base == held.T_odom_base
