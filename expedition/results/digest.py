r"""The fingerprint of a run: equal for two runs only if they made the same map and trajectories.

Byte layout, little-endian, hashed with SHA-256:

    "expedition run 1\n"
    "map" resolution origin_x origin_y (float64) rows cols (int64) cells (int8, C order)
    per robot, in order of ids: "track" length of the id (int64), the id in UTF-8,
        number of poses (int64), stamp x y theta of each (float64)

Without a map the "map" entry is left out. Cells are log-odds as they travel
on the wire (`protocol.map_cells.quantise`).
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Sequence

import numpy as np

from expedition.results.record import RobotRecord
from mapping.grid import OccupancyGrid
from protocol.map_cells import quantise


def run_digest(grid: OccupancyGrid | None, robots: Sequence[RobotRecord]) -> str:
    """Return the SHA-256 over the final map and all estimated trajectories, in hexadecimal."""
    digest = hashlib.sha256(b"expedition run 1\n")
    if grid is not None:
        g = grid.geometry
        digest.update(b"map")
        digest.update(struct.pack("<dddqq", g.resolution, g.origin_x, g.origin_y, g.rows, g.cols))
        digest.update(quantise(grid.log_odds).tobytes())
    for robot in sorted(robots, key=lambda robot: robot.id):
        name = robot.id.encode()
        track = np.asarray(robot.track_map, dtype="<f8").reshape(-1, 4) + 0.0  # -0.0 becomes 0.0
        digest.update(b"track" + struct.pack("<q", len(name)) + name)
        digest.update(struct.pack("<q", len(track)) + track.tobytes())
    return digest.hexdigest()
