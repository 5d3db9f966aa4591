"""Accuracy of local SLAM on long simulated tours: trajectory error, map quality, time per scan.

    python benchmarks/slam_bench.py hospital --maps ../shared/data/maps --seeds 1 2 3 4 5

A throw-away simulator drives a robot along shortest paths between random places of a real floor
plan; nothing of it is shared with the estimators, nor with the simulator of the project.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

sys.path.insert(0, str(Path(__file__).parent.parent))

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2, fit_rigid, wrap_angle
from mapping.incremental_slam import IncrementalSlam, SlamSettings
from mapping.scan import LaserScan

Solid = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Floor:
    """Solid cells of the true floor, row 0 at y = 0, and their edge [m]."""

    solid: Solid
    resolution: float


@dataclass(frozen=True)
class Lidar:
    beams: int = 180
    field_of_view: float = math.pi
    range_max: float = 8.0
    noise: float = 0.03

    @property
    def bearing_start(self) -> float:
        return -0.5 * self.field_of_view

    @property
    def bearing_step(self) -> float:
        return self.field_of_view / (self.beams - 1)


@dataclass(frozen=True)
class Tour:
    """True poses (N, 3), odometry increments (N, 3) leading to each, ranges (N, beams)."""

    truth: Floats
    increments: Floats
    ranges: npt.NDArray[np.float32]
    lidar: Lidar


def load_floor(path: Path) -> Floor:
    meta = yaml.safe_load(path.read_text())
    image = np.array(Image.open(path.parent / meta["image"]).convert("L"))[::-1]
    return Floor(np.ascontiguousarray(image < 250), float(meta["resolution"]))


def empty_hall(size: float = 20.0, resolution: float = 0.05) -> Floor:
    cells = round(size / resolution) + 4
    solid = np.zeros((cells, cells), dtype=bool)
    solid[:2] = solid[-2:] = solid[:, :2] = solid[:, -2:] = True
    return Floor(solid, resolution)


@compiled
def cast(solid: Solid, x: float, y: float, angle: float, range_max: float) -> float:
    """Distance in cells to the first solid cell; exact grid traversal."""
    dx, dy = math.cos(angle), math.sin(angle)
    ix, iy = int(x), int(y)
    ax = 1.0 / abs(dx) if dx != 0.0 else 1e30
    ay = 1.0 / abs(dy) if dy != 0.0 else 1e30
    tx = ((ix + 1 - x) if dx > 0 else (x - ix)) * ax
    ty = ((iy + 1 - y) if dy > 0 else (y - iy)) * ay
    t = 0.0
    while t < range_max:
        if tx < ty:
            t = tx
            tx += ax
            ix += 1 if dx > 0 else -1
        else:
            t = ty
            ty += ay
            iy += 1 if dy > 0 else -1
        if not (0 <= iy < solid.shape[0] and 0 <= ix < solid.shape[1]):
            return range_max
        if solid[iy, ix]:
            return min(t, range_max)
    return range_max


@compiled
def cast_scan(
    solid: Solid, x: float, y: float, angles: Floats, range_max: float, out: Floats
) -> None:
    for i in range(len(angles)):
        out[i] = cast(solid, x, y, angles[i], range_max)


def plan_waypoints(floor: Floor, length: float, rng: np.random.Generator, start: Floats) -> Floats:
    """Waypoints [m] of a tour over random reachable places, at least `length` metres."""
    step = max(1, round(0.15 / floor.resolution))
    clearance = ndimage.distance_transform_edt(~floor.solid) * floor.resolution
    rows, cols = clearance.shape
    iy, ix = np.mgrid[step // 2 : rows : step, step // 2 : cols : step]
    free = clearance[iy, ix] > 0.3
    ids = np.full(free.shape, -1)
    ids[free] = np.arange(free.sum())
    points = np.column_stack((ix[free] + 0.5, iy[free] + 0.5)) * floor.resolution
    penalty = 1.0 + 0.6 / np.maximum(clearance[iy, ix], 0.3) ** 2
    sources, targets, costs = [], [], []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = ids[: ids.shape[0] - dy, max(0, -dx) : ids.shape[1] - max(0, dx)]
        b = ids[dy:, max(0, dx) : ids.shape[1] + min(0, dx)]
        both = (a >= 0) & (b >= 0)
        sources.append(a[both])
        targets.append(b[both])
        p = penalty[dy:, max(0, dx) : ids.shape[1] + min(0, dx)][both]
        costs.append(np.hypot(dx, dy) * p)
    graph = coo_matrix(
        (np.concatenate(costs), (np.concatenate(sources), np.concatenate(targets))),
        shape=(len(points), len(points)),
    ).tocsr()
    here = int(np.argmin(np.hypot(*(points - start).T)))
    reachable = np.isfinite(dijkstra(graph, directed=False, indices=here))
    way, total = [points[here]], 0.0
    first = here
    while total < length or here != first:
        _, before = dijkstra(graph, directed=False, indices=here, return_predecessors=True)
        goal = first if total >= length else int(rng.choice(np.flatnonzero(reachable)))
        chain = [goal]
        while chain[-1] != here:
            chain.append(int(before[chain[-1]]))
        leg = points[chain[::-1]]
        total += float(np.hypot(*np.diff(leg, axis=0).T).sum())
        way.extend(leg[1:])
        if goal == first and total >= length:
            break
        here = goal
    return ndimage.gaussian_filter1d(np.array(way), 1.0, axis=0, mode="nearest")


def hall_waypoints(rng: np.random.Generator, size: float = 20.0, crossings: int = 8) -> Floats:
    """Waypoints [m] once along the walls of a hall, then across its blind middle many times."""
    near, far = 2.6, size - 2.4
    corners = [(5.0, near), (far, near), (far, far), (near, far), (near, near), (9.0, near)]
    for _ in range(crossings):
        side = rng.integers(4)
        along = rng.uniform(near, far)
        corners.append([(along, near), (along, far), (near, along), (far, along)][side])
        corners.append((rng.uniform(8.0, 12.0), rng.uniform(8.0, 12.0)))
    pieces = [
        np.linspace(a, b, max(2, round(math.dist(a, b) / 0.15)), endpoint=False)
        for a, b in itertools.pairwise(corners)
    ]
    return ndimage.gaussian_filter1d(np.vstack(pieces), 2.0, axis=0, mode="nearest")


def drive(waypoints: Floats, speed: float = 0.5, turn: float = 1.0, dt: float = 0.1) -> Floats:
    """Follow waypoints with a carrot; return poses every `dt` seconds (N, 3)."""
    x, y = waypoints[0]
    heading = math.atan2(*(waypoints[1] - waypoints[0])[::-1])
    poses, target = [(x, y, heading)], 1
    while target < len(waypoints):
        while target < len(waypoints) and math.hypot(*(waypoints[target] - (x, y))) < 0.25:
            target += 1
        if target == len(waypoints):
            break
        off = wrap_angle(math.atan2(waypoints[target][1] - y, waypoints[target][0] - x) - heading)
        rate = max(-turn, min(turn, 2.5 * off))
        v = speed * max(0.0, 1.0 - abs(off) / 0.8)
        x += v * dt * math.cos(heading + 0.5 * rate * dt)
        y += v * dt * math.sin(heading + 0.5 * rate * dt)
        heading = wrap_angle(heading + rate * dt)
        poses.append((x, y, heading))
    return np.array(poses)


def simulate(
    floor: Floor, length: float, seed: int, start: tuple[float, float] | None, lidar: Lidar
) -> Tour:
    rng = np.random.default_rng(seed)
    if start is None:
        poses = drive(hall_waypoints(rng))
    else:
        poses = drive(plan_waypoints(floor, length, rng, np.array(start)))
    kept, increments, ranges = [poses[0]], [np.zeros(3)], []
    total = Pose2(0.0, 0.0, 0.0)
    for k in range(1, len(poses)):
        move = Pose2(*poses[k - 1]).inverse() @ Pose2(*poses[k])
        d = math.hypot(move.x, move.y)
        along = math.copysign(d, move.x) + 0.05 * math.sqrt(d) * rng.standard_normal()
        bend = math.radians(2.0) * math.sqrt(d) * rng.standard_normal()
        spin = 0.05 * math.sqrt(abs(move.theta)) * rng.standard_normal()
        turned = move.theta + bend + spin
        total = total @ Pose2(
            along * math.cos(0.5 * turned), along * math.sin(0.5 * turned), turned
        )
        if k % 2 == 0:
            kept.append(poses[k])
            increments.append(total.as_array())
            total = Pose2(0.0, 0.0, 0.0)
    out = np.empty(lidar.beams)
    bearings = lidar.bearing_start + lidar.bearing_step * np.arange(lidar.beams)
    limit = lidar.range_max / floor.resolution
    for x, y, theta in kept:
        cast_scan(
            floor.solid, x / floor.resolution, y / floor.resolution, theta + bearings, limit, out
        )
        r = out * floor.resolution
        hit = r < lidar.range_max - 1e-6
        r[hit] = np.maximum(0.02, r[hit] + lidar.noise * rng.standard_normal(hit.sum()))
        ranges.append(np.minimum(r, lidar.range_max).astype(np.float32))
    return Tour(np.array(kept), np.array(increments), np.array(ranges), lidar)


@dataclass
class Outcome:
    rmse: float
    worst: float
    heading: float
    milliseconds: float
    unmatched: int
    scans: int
    path: float
    estimates: Floats
    slam: IncrementalSlam
    T_world_odom: Pose2
    errors: Floats
    covariances: Floats


def run(tour: Tour, settings: SlamSettings) -> Outcome:
    slam = IncrementalSlam(settings)
    estimates, unmatched, covariances = [], 0, []
    begin = time.process_time()
    for k in range(len(tour.truth)):
        scan = LaserScan(
            tour.ranges[k], tour.lidar.bearing_start, tour.lidar.bearing_step,
            tour.lidar.range_max, 0.2 * k,
        )  # fmt: skip
        estimate = slam.step(Pose2(*tour.increments[k]), scan)
        estimates.append(estimate.T_odom_base.as_array())
        covariances.append(estimate.covariance)
        unmatched += not estimate.matched
    spent = time.process_time() - begin
    poses = np.array(estimates)
    T_world_odom = fit_rigid(tour.truth[:, :2], poses[:, :2])
    errors = T_world_odom.apply(poses[:, :2]) - tour.truth[:, :2]
    turned = poses[:, 2] + T_world_odom.theta - tour.truth[:, 2]
    turned = np.arctan2(np.sin(turned), np.cos(turned))
    size = np.hypot(*errors.T)
    return Outcome(
        rmse=float(np.sqrt((size**2).mean())),
        worst=float(size.max()),
        heading=float(np.degrees(np.sqrt((turned**2).mean()))),
        milliseconds=1e3 * spent / len(poses),
        unmatched=unmatched,
        scans=len(poses),
        path=float(np.hypot(*np.diff(tour.truth[:, :2], axis=0).T).sum()),
        estimates=poses,
        slam=slam,
        T_world_odom=T_world_odom,
        errors=errors,
        covariances=np.array(covariances),
    )


@dataclass(frozen=True)
class MapQuality:
    """Shares: seen free cells shown clear / obstacle; walls' cells per metre of wall face."""

    clear: float
    walled: float
    thickness: float
    off_wall: float


def judge_map(floor: Floor, tour: Tour, outcome: Outcome, threshold: float = 0.4) -> MapQuality:
    """Compare with the truth, cell by cell of the truth that some true beam crossed."""
    from mapping.grid import GridGeometry, OccupancyGrid
    from mapping.scan_integration import IntegrationSettings, integrate_scan

    rows, cols = floor.solid.shape
    geometry = GridGeometry(floor.resolution, 0.0, 0.0, rows, cols)
    seen = OccupancyGrid.unknown(geometry)
    for k in range(0, len(tour.truth), 2):
        scan = LaserScan(
            tour.ranges[k], tour.lidar.bearing_start, tour.lidar.bearing_step,
            tour.lidar.range_max, 0.0,
        )  # fmt: skip
        integrate_scan(seen, scan, Pose2(*tour.truth[k]), IntegrationSettings(clear_margin=0.0))
    looked = ndimage.binary_dilation(seen.log_odds < -0.5) & ~floor.solid
    cells = np.argwhere(looked)
    grid = outcome.slam.occupancy()
    points = outcome.T_world_odom.inverse().apply(geometry.centres_of(cells))
    where = grid.geometry.cells_at(points)
    inside = grid.geometry.contains(where)
    values = np.zeros(len(cells), dtype=np.float32)
    values[inside] = grid.log_odds[where[inside, 0], where[inside, 1]]
    occupied = np.argwhere(grid.log_odds > threshold)
    centres = outcome.T_world_odom.apply(grid.geometry.centres_of(occupied))
    true_cells = geometry.cells_at(centres)
    ok = geometry.contains(true_cells)
    distance = ndimage.distance_transform_edt(~floor.solid) * floor.resolution
    off = distance[true_cells[ok, 0], true_cells[ok, 1]]
    # Length of wall face seen: solid cells with a looked-at free neighbour.
    face = floor.solid & ndimage.binary_dilation(looked)
    return MapQuality(
        clear=float((values < -threshold).mean()),
        walled=float((values > threshold).mean()),
        thickness=len(occupied) * grid.geometry.resolution / (face.sum() * floor.resolution),
        off_wall=float((off > 0.1).mean()),
    )


def draw(outcome: Outcome, path: Path) -> None:
    odds = outcome.slam.occupancy().log_odds
    shade = np.clip(127 - 32 * odds, 0, 255).astype(np.uint8)
    image = np.stack([shade] * 3, axis=-1)
    cells = outcome.slam.occupancy().geometry.cells_at(outcome.estimates[:, :2])
    image[cells[:, 0], cells[:, 1]] = (255, 0, 0)
    Image.fromarray(image[::-1]).save(path)


WORLDS: dict[str, tuple[str, tuple[float, float]]] = {
    "hospital": ("hospital_62m.yaml", (2.0, 12.5)),
    "office": ("office_furnished.yaml", (2.18, 7.82)),
    "willow": ("willow.yaml", (9.18, 11.68)),
}


def tour_for(
    world: str, maps: Path, seed: int, length: float, cache: Path | None
) -> tuple[Floor, Tour]:
    if world == "hall":
        floor, start = empty_hall(), None
    else:
        floor, start = load_floor(maps / WORLDS[world][0]), WORLDS[world][1]
    kept = None if cache is None else cache / f"{world}-{seed}-{length:.0f}.npz"
    if kept is not None and kept.exists():
        data = np.load(kept)
        return floor, Tour(data["truth"], data["increments"], data["ranges"], Lidar())
    tour = simulate(floor, length, seed, start, Lidar())
    if kept is not None:
        np.savez(kept, truth=tour.truth, increments=tour.increments, ranges=tour.ranges)
    return floor, tour


def main(make_settings: Callable[[], SlamSettings] = SlamSettings) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("world", choices=[*WORLDS, "hall"])
    parser.add_argument("--maps", type=Path, default=Path("../shared/data/maps"))
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--length", type=float, default=250.0)
    parser.add_argument("--cache", type=Path, default=None)
    parser.add_argument("--draw", type=Path, default=None)
    arguments = parser.parse_args()
    for seed in arguments.seeds:
        floor, tour = tour_for(
            arguments.world, arguments.maps, seed, arguments.length, arguments.cache
        )
        outcome = run(tour, make_settings())
        quality = judge_map(floor, tour, outcome)
        print(
            f"{arguments.world} seed {seed}: {outcome.path:.0f} m, {outcome.scans} scans, "
            f"rmse {outcome.rmse:.3f} m, worst {outcome.worst:.3f} m, "
            f"heading {outcome.heading:.2f} deg, {outcome.milliseconds:.3f} ms/scan, "
            f"unmatched {outcome.unmatched}; clear {quality.clear:.4f}, "
            f"free shown as wall {quality.walled:.4f}, thickness {quality.thickness:.2f} cells, "
            f"wall cells off by >0.1 m {quality.off_wall:.4f}",
            flush=True,
        )
        if arguments.draw is not None:
            draw(outcome, arguments.draw / f"{arguments.world}-{seed}.png")


if __name__ == "__main__":
    main()
