"""Rows for `benchmarks/kernels.py`: rays, grid update, matching, and frames on the wire."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from benchmarks.floors import RESOLUTION, Case, office
from mapping.cell_box import CellBox
from mapping.changed_regions import changed_regions
from mapping.geometry import Pose2
from mapping.grid import OBSTACLE, GridGeometry, OccupancyGrid
from mapping.match_map import MatchMap
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings, integrate_scan
from protocol.codec import Header, decode, encode
from protocol.world_messages import BodyFrame
from sim_world.lidar import LaserSpec, measure
from sim_world.scene import GridScene

HERE = Pose2(24.0, 10.0, 0.3)  # in a corridor of the office, rooms on both sides


@cache
def scene() -> GridScene:
    """Return the office as a world."""
    classes = office()
    return GridScene(classes == OBSTACLE, GridGeometry(RESOLUTION, 0.0, 0.0, *classes.shape))


def sweep(T_world_laser: Pose2, seed: int = 1) -> LaserScan:
    """Return what a laser sees in the office."""
    spec = LaserSpec()
    ranges = measure(T_world_laser, scene(), np.zeros((0, 3)), spec, np.random.default_rng(seed))
    return LaserScan(ranges, spec.bearing_start, spec.bearing_step, spec.range_max, 0.0)


def rays() -> Case:
    """Sweeps of three lasers through a grid world."""
    poses = [HERE, Pose2(24.0, 25.0, 1.0), Pose2(24.0, 40.0, -2.0)]
    bearings = LaserSpec().bearings

    def run() -> None:
        for pose in poses:
            scene().cast(pose, bearings, 10.0)

    return Case("rays", "3 x 360 beams, 10 m, office", 3 * 360, "rays", run)


def grid_update(fill: bool) -> Case:
    """One scan fused into a grid, as robots do it or as the server does."""
    scan, grid = sweep(HERE), OccupancyGrid.unknown(scene().geometry)
    settings = IntegrationSettings(fill_between=fill)
    work = f"360 beams{', filled between' if fill else ''}"
    return Case(
        "grid update", work, 360, "beams", lambda: integrate_scan(grid, scan, HERE, settings)
    )


def matching() -> Case:
    """One scan matched in a map of twenty others; counts the evaluations of the likelihood."""
    walls = MatchMap()
    for k in range(20):
        pose = Pose2(HERE.x, HERE.y + 0.2 * k, HERE.theta)
        walls.insert(sweep(pose, k), pose)
    T_map_base = Pose2(HERE.x, HERE.y + 1.1, HERE.theta)
    scan = sweep(T_map_base, 99)
    guess = Pose2(T_map_base.x + 0.05, T_map_base.y - 0.05, T_map_base.theta + 0.02)
    prior = np.diag([0.01, 0.01, 0.001])
    evaluations = walls.match(scan, guess, prior).iterations
    return Case(
        "scan matching",
        f"360 beams, {evaluations} evaluations",
        evaluations,
        "evaluations",
        lambda: walls.match(scan, guess, prior),
    )


def regions() -> Case:
    """Where a map changed, of which two far corners did."""
    before = np.zeros((1000, 1000), dtype=np.int8)
    after = before.copy()
    after[100:200, 100:240] = after[700:800, 800:900] = 5
    box = CellBox(0, 0, 1000, 1000)
    return Case(
        "changed regions",
        "1000 x 1000, 2 regions",
        before.size,
        "cells",
        lambda: changed_regions(before, after, box),
    )


def frames() -> Case:
    """A body's frame to bytes and back."""
    frame = BodyFrame(stamp_s=1.0, T_wheel_base=HERE, bumped=False, ranges=sweep(HERE).ranges)
    header = Header("body_frame", "world", "robot1", 1, 1.0)
    return Case(
        "codec", "a sweep of 360 beams, there and back", 1, "frames",
        lambda: decode(encode(header, frame)),
    )  # fmt: skip


CASES: list[Callable[[], Case]] = [
    rays,
    lambda: grid_update(False),
    lambda: grid_update(True),
    matching,
    regions,
    frames,
]
