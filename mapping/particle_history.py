"""Where each particle has been: a tree, as most particles have most of their way in common.

Source: Eliazar & Parr 2004, "DP-SLAM 2.0", the ancestry tree.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.geometry import Floats


class ParticleHistory:
    """The poses of all particles, update by update, and whose copies they are.

    Attributes:
        poses: by update (particles, 3) of x, y [m], theta [rad], map frame.
        parents: by update (particles,) int64, which particle of the update before each continues.
    """

    __slots__ = ("parents", "poses")

    def __init__(self) -> None:
        self.poses: list[Floats] = []
        self.parents: list[npt.NDArray[np.int64]] = []

    def __len__(self) -> int:
        """Return the number of updates."""
        return len(self.poses)

    def append(self, poses: Floats, parents: npt.NDArray[np.int64]) -> None:
        """Add an update; both are copied."""
        self.poses.append(poses.copy())
        self.parents.append(parents.copy())

    def path(self, particle: int, since: int = 0) -> Floats:
        """Return the poses that a particle of the last update has behind it, (updates, 3).

        Args:
            particle: whose way; its own pose is the last one.
            since: leave out the updates before this one.
        """
        path = np.empty((len(self) - since, 3))
        for update in range(len(self) - 1, since - 1, -1):
            path[update - since] = self.poses[update][particle]
            particle = int(self.parents[update][particle])
        return path
