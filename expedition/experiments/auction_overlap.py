"""How good and how cheap rectangles are as a stand-in for information gain regions.

Simmons et al. 2000, section "Assigning Tasks", discount a bid by how much the rectangle around its
information gain region overlaps those of tasks already assigned. They report that this "was within
15% of the true overlap (obtained by counting the actual number of overlapping cells), while being
hundreds of times more efficient".

Maps are made by sweeping lasers from random places of shipped worlds, a little more at a time. On
each partial map, two frontier places play the tasks assigned, and all others bid. "Within 15%"
can be read of every pair of regions or of their mean: the table gives both, and the share.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from coordination.bid import overlap_fractions, true_overlap
from expedition.experiments.experiment import (
    Claim,
    ExperimentOptions,
    ExperimentResult,
    Row,
    run_all,
)
from expedition.experiments.plots import new_figure, plot_points, save_figure
from mapping.frontiers import find_frontiers
from mapping.geometry import Floats, Pose2
from mapping.grid import Cells, GridGeometry, OccupancyGrid, classify, geometry_around
from mapping.information_gain import gain_region, information_gains
from mapping.scan import LaserScan
from mapping.scan_integration import integrate_scan
from sim_world.truth import body_places, reachable_places
from sim_world.world_file import World, load_world, start_poses

NAME = "auction-overlap"
WORLDS = ("office_single_corridor", "office_parallel_corridors", "obstacle_free", "random_15")
BIG_WORLDS = (*WORLDS, "random_30", "hospital")
RESOLUTION = 0.15  # [m] "our grid has 15 cm resolution"
SPACING = 2  # [cells] "at least 30 cm (approximate radius of the robots)"
SENSOR_RANGE = 5.0  # [m] nominal range of the information gain regions
LASER_RANGE = 8.0  # [m]
BODY_RADIUS = 0.25  # [m]
VIEWS = (1, 2, 4, 8)  # sweeps taken when a map is looked at
BEAMS = 360
REVISITS = 2  # sweeps at each place: one alone leaves cells between the thresholds
WITHIN = 0.15
CHEAPER = 100.0  # the least that "hundreds of times" can mean
REPEATS = 5  # of a timing; the fastest counts, the others were disturbed


Regions = list[npt.NDArray[np.int64]]


@dataclass(frozen=True)
class Comparison:
    """Rectangles against regions on one partial map.

    Attributes:
        truth: (n,) true overlap of each bidding place's region with the assigned ones, 0 to 1;
            places with no overlap of either kind are left out.
        rectangles: (n,) the overlap of their rectangles.
        region_cells: cells of a region, mean.
        seconds_cells: time for one true overlap, lists of cells compared [s].
        seconds_mask: time for one true overlap, counted in a grid of marks [s].
        seconds_rectangles: time for one overlap of rectangles [s].
    """

    truth: Floats
    rectangles: Floats
    region_cells: float
    seconds_cells: float
    seconds_mask: float
    seconds_rectangles: float


SECONDS = ("seconds_cells", "seconds_mask", "seconds_rectangles")


def run(options: ExperimentOptions) -> ExperimentResult:
    """Rectangles against true overlaps of information gain regions: error and speed."""
    seeds = options.seeds or (2 if options.quick else 10)
    worlds = WORLDS if options.quick else BIG_WORLDS
    jobs = [(world, seed) for world in worlds for seed in range(seeds)]
    found = run_all(partial(_compare_job), jobs, options.workers)
    by_world: dict[str, list[Comparison]] = {world: [] for world in worlds}
    for (world, _), comparisons in zip(jobs, found, strict=True):
        by_world[world].extend(comparisons)
    rows = [row_of(world, comparisons) for world, comparisons in by_world.items()]
    everything = [comparison for part in by_world.values() for comparison in part]
    rows.append(row_of("all", everything))
    figure, axes = new_figure("Overlap of information gain regions", "true", "of rectangles")
    plot_points(axes, {world: _pairs(part) for world, part in by_world.items()})
    axes.plot([0.0, 1.0], [0.0, 1.0], color="#6b7480", linewidth=1.0)
    save_figure(figure, options.out / f"{NAME}.png")
    return ExperimentResult(NAME, rows, claims_of(rows[-1]))


def _compare_job(job: tuple[str, int]) -> list[Comparison]:
    """Return the comparisons on the maps of one world and seed."""
    world, seed = job
    return compare_world(load_world(world, seed), np.random.default_rng(seed))


def compare_world(world: World, rng: np.random.Generator) -> list[Comparison]:
    """Return one comparison per partial map of a world on which there is something to bid for."""
    grid, places = _blank(world)
    comparisons = []
    taken = 0
    for views in VIEWS:
        while taken < views:
            _look(world, grid, places[int(rng.integers(len(places)))], float(taken))
            taken += 1
        comparison = compare(classify(grid.log_odds, 0.65, 0.35), grid.geometry, rng)
        if comparison is not None:
            comparisons.append(comparison)
    return comparisons


def _blank(world: World) -> tuple[OccupancyGrid, Floats]:
    """Return an unknown map of a world and the places (N, 2) [m] a robot can get to."""
    x0, y0, x1, y1 = world.scene.extent
    solid, geometry = world.scene.free_truth(0.05)
    starts = [start.as_array() for start in start_poses(world, 1, BODY_RADIUS)]
    reached = reachable_places(
        body_places(solid, geometry, BODY_RADIUS), geometry, np.array(starts)
    )
    margin = 1.0
    lattice = geometry_around(x0 - margin, y0 - margin, x1 + margin, y1 + margin, RESOLUTION)
    return OccupancyGrid.unknown(lattice), geometry.centres_of(np.argwhere(reached))


def _look(world: World, grid: OccupancyGrid, place: Floats, stamp: float) -> None:
    """Sweep a noiseless laser all around from a place (2,) [m] into the map, in place."""
    T_world_laser = Pose2(float(place[0]), float(place[1]), 0.0)
    step = 2.0 * math.pi / BEAMS
    bearings = -math.pi + step * np.arange(BEAMS, dtype=np.float64)
    ranges = world.scene.cast(T_world_laser, bearings, LASER_RANGE)
    scan = LaserScan(ranges.astype(np.float32), -math.pi, step, LASER_RANGE, stamp)
    for _ in range(REVISITS):
        integrate_scan(grid, scan, T_world_laser)


def compare(
    classes: npt.NDArray[np.uint8], geometry: GridGeometry, rng: np.random.Generator
) -> Comparison | None:
    """Return how well rectangles tell the overlaps on one map, or None with too little to bid for.

    Two frontier places, drawn from those with the largest regions, are the tasks assigned; every
    other place whose rectangle or region overlaps theirs is compared.
    """
    range_cells = SENSOR_RANGE / geometry.resolution
    cells = find_frontiers(classes, SPACING, 2).cells
    gains, boxes = information_gains(classes, None, cells, range_cells)
    worthwhile = gains * geometry.resolution**2 >= 0.5
    cells, gains, boxes = cells[worthwhile], gains[worthwhile], boxes[worthwhile]
    if len(cells) < 4:
        return None
    large = np.argsort(-gains, kind="stable")[: max(4, len(cells) // 2)]
    assigned = rng.choice(large, size=2, replace=False)
    others = np.setdiff1d(np.arange(len(cells)), assigned)
    regions = [gain_region(classes, (int(iy), int(ix)), range_cells) for iy, ix in cells]
    rectangles = rectangles_of(boxes, geometry)
    seconds_cells, truth = _timed(lambda: _by_cells(regions, assigned, others, geometry))
    seconds_mask, _ = _timed(lambda: _by_mask(regions, assigned, others, geometry))
    seconds_rectangles, approximate = _timed(
        lambda: overlap_fractions(rectangles[others], rectangles[assigned])
    )
    meets = (truth > 0.0) | (approximate > 0.0)
    count = len(others)
    return Comparison(
        truth[meets],
        approximate[meets],
        float(np.mean([len(regions[i]) for i in others])),
        seconds_cells / count,
        seconds_mask / count,
        seconds_rectangles / count,
    )


def rectangles_of(boxes: Cells, geometry: GridGeometry) -> Floats:
    """Return boxes of cells (n, 4) as (iy0, ix0, iy1, ix1) as rectangles (n, 4) [m]."""
    origin = np.array([geometry.origin_x, geometry.origin_y] * 2)
    rectangles: Floats = origin + boxes[:, [1, 0, 3, 2]] * geometry.resolution
    return rectangles


def _by_cells(regions: Regions, assigned: Cells, others: Cells, geometry: GridGeometry) -> Floats:
    """Return the true overlap of the `others` with the `assigned`: lists of cells compared."""
    cells = [np.column_stack(np.divmod(region, geometry.cols)) for region in regions]
    taken = np.vstack([cells[i] for i in assigned])
    return np.array([true_overlap(cells[i], taken) for i in others])


def _by_mask(regions: Regions, assigned: Cells, others: Cells, geometry: GridGeometry) -> Floats:
    """Return the same, counted in a grid of marks: the fastest way to do it in numpy."""
    marks = np.zeros(geometry.rows * geometry.cols, dtype=np.bool_)
    for i in assigned:
        marks[regions[i]] = True
    return np.array([np.count_nonzero(marks[regions[i]]) / len(regions[i]) for i in others])


def _timed(work: Callable[[], Floats]) -> tuple[float, Floats]:
    """Return the least time [s] that `work` took, and what it returned."""
    result, least = work(), math.inf
    for _ in range(REPEATS):
        start = time.perf_counter()
        result = work()
        least = min(least, time.perf_counter() - start)
    return least, result


def row_of(world: str, comparisons: Sequence[Comparison]) -> Row:
    """Return one row of the table: errors as shares of the region, times per overlap."""
    truth = np.concatenate([np.empty(0), *(c.truth for c in comparisons)])
    error = np.concatenate([np.empty(0), *(c.rectangles for c in comparisons)]) - truth
    seconds = [_median(getattr(c, name) for c in comparisons) for name in SECONDS]
    by_cells, by_mask, by_rectangles = (None if s is None else 1.0e6 * s for s in seconds)
    return {
        "world": world,
        "maps": len(comparisons),
        "overlaps": len(truth),
        "region_cells": _median(c.region_cells for c in comparisons),
        "error_mean": float(np.abs(error).mean()) if len(error) else None,
        "error_median": float(np.median(np.abs(error))) if len(error) else None,
        "bias": float(error.mean()) if len(error) else None,
        "within_15": float((np.abs(error) <= WITHIN).mean()) if len(error) else None,
        "cells_us": by_cells,
        "mask_us": by_mask,
        "rectangles_us": by_rectangles,
        "cheaper_than_cells": _ratio(by_cells, by_rectangles),
        "cheaper_than_mask": _ratio(by_mask, by_rectangles),
    }


def _median(values: Iterable[float]) -> float | None:
    known = list(values)
    return statistics.median(known) if known else None


def _ratio(a: float | None, b: float | None) -> float | None:
    return a / b if a is not None and b else None


def claims_of(row: Row) -> list[Claim]:
    """Return what the row over all worlds says about the paper's two claims, and how it errs."""
    error, times = row["error_mean"], row["cheaper_than_cells"]
    if error is None or times is None:
        return []
    return [
        Claim(
            "the rectangles' overlap is within 15 % of the true one, on average",
            error <= WITHIN,
            f"mean error {100.0 * error:.1f} % of the region; {100.0 * row['within_15']:.0f} % of "
            f"{row['overlaps']} overlaps within 15 %",
        ),
        Claim(
            "rectangles are at least a hundred times cheaper than comparing cells",
            times >= CHEAPER,
            f"{times:.0f} times; {row['cheaper_than_mask']:.0f} times against marks in a grid",
        ),
    ]


def _pairs(comparisons: Sequence[Comparison]) -> list[tuple[float, float]]:
    return [
        (float(t), float(r))
        for c in comparisons
        for t, r in zip(c.truth, c.rectangles, strict=True)
    ]
