"""How much a scan shows that the team's map does not have yet."""

from __future__ import annotations

import numpy as np

from mapping.geometry import Pose2
from mapping.grid import UNKNOWN
from mapping.scan import LaserScan
from robot_agent.planning_map import PlanningMap

_BEAMS = 45  # looked at, evenly spread over the sweep
_STEP = 0.25  # [m] from one look along a beam to the next


def unseen_area(planning_map: PlanningMap, scan: LaserScan, T_map_base: Pose2) -> float:
    """Return about how much area [m2] a scan sees that is unknown in a map.

    Args:
        planning_map: the robot's copy of the team's map.
        scan: the scan; beams to be ignored show nothing.
        T_map_base: where it was taken, map frame.
    """
    stride = max(1, len(scan.ranges) // _BEAMS)
    ranges = np.minimum(scan.ranges[::stride].astype(np.float64), scan.range_max)
    bearings = scan.bearings[::stride]
    steps = np.arange(_STEP, scan.range_max, _STEP)
    seen = steps[np.newaxis, :] < ranges[:, np.newaxis] - _STEP
    beam, step = np.nonzero(seen)
    reach = steps[step]
    points = np.column_stack((reach * np.cos(bearings[beam]), reach * np.sin(bearings[beam])))
    geometry = planning_map.geometry
    cells = geometry.cells_at((T_map_base @ scan.T_base_laser).apply(points))
    inside = geometry.contains(cells)
    unknown = ~inside
    unknown[inside] = planning_map.classes[cells[inside, 0], cells[inside, 1]] == UNKNOWN
    # A look stands for the piece of its sector between it and the next ones.
    return float((reach[unknown] * _STEP * abs(scan.bearing_step) * stride).sum())
