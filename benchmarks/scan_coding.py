"""How few bytes scans take: `python -m benchmarks.scan_coding [--data DIR] [--max-time S]`.

Two robots explore each shipped world, and an office floor where the data are found; along their
true ways a laser with 30 mm of noise measures anew, with 361 and with 181 beams over 180 degrees.
Then come real logs. For each: bytes of a scan as it is coded, bits a beam (of all), bytes that the
noise alone would take if the walls were known, the largest error, times to encode and decode, and
for comparison bytes of 4-byte floats and of zstd on 2-byte differences of the same cells. A log's
noise is what its scans show.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

import numpy as np
import zstandard

from benchmarks.floors import data_folder
from benchmarks.mission import ROOT, RUN
from expedition.recordings.read import read_recording
from mapping.beam_coding import nearest_noise, ranging, shown_noise
from mapping.geometry import Pose2
from mapping.range_cells import cells_for
from mapping.scan import LaserScan
from mapping.scan_coding import ScanCodingSettings, decode_scan, encode_scan
from sim_world.lidar import LaserSpec, measure
from sim_world.world_file import load_world, shipped_worlds

SIGMA = 0.03
REACH = 8.0
LOGS = ("intel", "mit_csail")
MOST_SCANS = 400

_Item = TypeVar("_Item")


def places(world: str, max_time: float, seed: int) -> list[tuple[float, Pose2]]:
    """Return stamps [s] and true poses of two robots that explore a world."""
    options = ["--world", world, "--robots", "2", "--seed", str(seed), "--in-process"]
    found = []
    with tempfile.TemporaryDirectory() as out:
        subprocess.run(
            [*RUN, *options, "--max-time", str(max_time), "--json", "--out", out],
            cwd=ROOT,
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for file in sorted(Path(out, "truth").glob("*.tum")):
            for row in np.loadtxt(file, ndmin=2).tolist():
                pose = Pose2(row[1], row[2], 2.0 * math.atan2(row[6], row[7]))
                found.append((row[0], pose))
    return found


def measured(
    world: str, seed: int, beams: int, where: list[tuple[float, Pose2]]
) -> list[LaserScan]:
    """Return what a laser with so many beams over 180 degrees reads at some places."""
    spec = LaserSpec(beams, -0.5 * math.pi, math.pi / (beams - 1), REACH, SIGMA)
    scene, rng = load_world(world, seed).scene, np.random.default_rng(seed)
    return [
        LaserScan(
            measure(pose, scene, [], spec, rng),
            spec.bearing_start,
            spec.bearing_step,
            REACH,
            stamp,
        )
        for stamp, pose in where
    ]


def thinned(items: list[_Item]) -> list[_Item]:
    """Return at most `MOST_SCANS` of some items, evenly chosen."""
    return items[:: max(1, -(-len(items) // MOST_SCANS))]


def cases(
    data: Path | None, max_time: float, seed: int
) -> Iterator[tuple[str, float, list[LaserScan]]]:
    """Yield names, the noise of the laser [m] (0: unknown), and scans."""
    worlds = {name: name for name in shipped_worlds()}
    if data is not None:
        worlds["office_furnished"] = str(data / "maps" / "office_furnished.yaml")
    for name, world in worlds.items():
        where = thinned(places(world, max_time, seed))
        for beams in (361, 181):
            yield name, SIGMA, measured(world, seed, beams, where)
    for name in LOGS if data is not None else ():
        scans = [r.scan for r in read_recording(data / "logs" / f"{name}.clf.gz").readings]
        yield f"{name} (log)", 0.0, thinned(scans)


def entropy(sigma: float) -> float:
    """Return the bits of a normal distribution of `sigma` cells, rounded to cells anyhow placed."""
    total = 0.0
    for offset in np.arange(16) / 16.0:
        edges = (np.arange(-200, 201) + offset) / sigma
        shares = np.diff([0.5 * (1.0 + math.erf(x / math.sqrt(2.0))) for x in edges])
        shares = shares[shares > 0.0]
        total -= float((shares * np.log2(shares)).sum()) / 16.0
    return total


def report(name: str, noise: float, scans: list[LaserScan], settings: ScanCodingSettings) -> float:
    """Print the row of some scans; return their mean bytes."""
    coded = [encode_scan(scan, settings) for scan in scans]
    started = time.process_time()
    coded = [encode_scan(scan, settings) for scan in scans]
    encoded = time.process_time()
    back = [decode_scan(data) for data in coded]
    decoded = time.process_time()
    errors, floors, packed = [0.0], [], []
    for scan, other in zip(scans, back, strict=True):
        hits = scan.hits
        if not np.array_equal(hits, other.hits):
            raise AssertionError("a beam comes back as another kind of beam")
        errors.extend(np.abs(other.ranges.astype(float) - scan.ranges.astype(float))[hits].tolist())
        grid = cells_for(scan, settings.error_bound_m)
        cells = grid.cells_of(scan)
        rung = nearest_noise(noise, grid.width) if noise else shown_noise(cells)
        sigma = noise / grid.width or math.sqrt(ranging(1.0, 1, rung).variance)
        floors.append(int(hits.sum()) * entropy(sigma) / 8.0)
        differences = np.diff(cells.astype(np.int16), prepend=np.int16(0))
        packed.append(len(zstandard.compress(differences.tobytes(), 19)))
    beams, size = len(scans[0].ranges), float(np.mean([len(data) for data in coded]))
    encode_us, decode_us = (
        1e6 * seconds / len(scans) for seconds in (encoded - started, decoded - encoded)
    )
    print(
        f"{name:<27} {beams:>5} {len(scans):>5} {size:>7.1f} {8.0 * size / beams:>6.2f} "
        f"{np.mean(floors):>6.1f} {1000.0 * max(errors):>8.4f} {encode_us:>7.0f} {decode_us:>7.0f} "
        f"{4 * beams:>5} {np.mean(packed):>6.1f}",
        flush=True,
    )
    return size


def main() -> None:
    """Code all scans and print."""
    parser = argparse.ArgumentParser(description="How few bytes scans take.")
    parser.add_argument("--data", type=Path, default=data_folder(), help="folder of maps and logs")
    parser.add_argument("--max-time", type=float, default=200.0, help="mission time [s]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bound", type=float, default=0.01, help="error bound [m]")
    chosen = parser.parse_args()
    print(
        f"{'world or log':<27} {'beams':>5} {'scans':>5} {'bytes':>7} {'bits':>6} {'floor':>6} "
        f"{'error mm':>8} {'enc us':>7} {'dec us':>7} {'raw':>5} {'zstd':>6}"
    )
    sizes: dict[int, list[float]] = {}
    for name, noise, scans in cases(chosen.data, chosen.max_time, chosen.seed):
        settings = ScanCodingSettings(chosen.bound, noise)
        size = report(name, noise, scans, settings)
        if noise:
            sizes.setdefault(len(scans[0].ranges), []).append(size)
    for beams, means in sizes.items():
        print(f"mean of the worlds, {beams} beams: {np.mean(means):.1f} bytes")


if __name__ == "__main__":
    main()
