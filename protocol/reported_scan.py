"""The scan that a report tells of."""

from __future__ import annotations

from mapping.scan import LaserScan
from protocol.messages import ScanReport


def scan_of(report: ScanReport) -> LaserScan:
    """Return the scan that a report tells of."""
    return LaserScan(
        report.ranges,
        report.bearing_start_rad,
        report.bearing_step_rad,
        report.range_max_m,
        report.stamp_s,
        report.T_base_laser,
    )
