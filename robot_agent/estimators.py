"""The local estimators a robot can run, by name."""

from __future__ import annotations

ESTIMATORS: dict[str, str] = {
    "scan_matching": "mapping.incremental_slam:IncrementalSlam",
}
