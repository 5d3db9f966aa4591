"""How large the map may grow: a robot whose pose is nonsense must not cost the team its server."""

from __future__ import annotations

from mapping.geometry import Pose2
from mapping.grid import GridGeometry
from mapping.scan import LaserScan
from mapping.scan_integration import scan_extent
from protocol.fields import LARGEST_EDGE


def holds(geometry: GridGeometry, most: int, scan: LaserScan, T_map_base: Pose2) -> bool:
    """Whether map and search stay within the limits if a scan is looked for at a pose.

    Args:
        geometry: the map so far.
        most: cells it may have.
        scan: the scan.
        T_map_base: the pose.
    """
    larger, _ = geometry.grown(*scan_extent(scan, T_map_base))
    # The search lays a square around the laser, as wide as its longest beams on both sides.
    longest = float(scan.ranges[scan.hits].max(initial=0.0)) / geometry.resolution
    square = (2.0 * longest) ** 2
    edge = max(larger.rows, larger.cols)
    return larger.rows * larger.cols <= most and square <= most and edge <= LARGEST_EDGE
