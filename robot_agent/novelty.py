"""How much a scan shows that the team's map does not have yet."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
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
    T_map_laser, geometry = T_map_base @ scan.T_base_laser, planning_map.geometry
    seen = _unseen(
        np.minimum(scan.ranges[::stride].astype(np.float64), scan.range_max),
        scan.bearing_start,
        scan.bearing_step * stride,
        (T_map_laser.x - geometry.origin_x, T_map_laser.y - geometry.origin_y, T_map_laser.theta),
        planning_map.classes,
        geometry.resolution,
    )
    # A look stands for the piece of its sector between it and the next ones.
    return float(seen * _STEP * abs(scan.bearing_step) * stride)


@compiled
def _unseen(
    ranges: Floats,
    start: float,
    step: float,
    pose: tuple[float, float, float],
    classes: npt.NDArray[np.uint8],
    resolution: float,
) -> float:
    """Return the sum of the distances [m] of all looks at unknown cells; off the grid is unknown.

    `pose` is that of the laser, counted from the grid's corner.
    """
    rows, cols = classes.shape
    total = 0.0
    for beam in range(len(ranges)):
        bearing = pose[2] + start + beam * step
        dx, dy = math.cos(bearing), math.sin(bearing)
        reach = _STEP
        while reach < ranges[beam] - _STEP:
            ix = math.floor((pose[0] + reach * dx) / resolution)
            iy = math.floor((pose[1] + reach * dy) / resolution)
            if not (0 <= iy < rows and 0 <= ix < cols) or classes[iy, ix] == UNKNOWN:
                total += reach
            reach += _STEP
    return total
