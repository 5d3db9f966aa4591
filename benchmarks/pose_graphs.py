"""Whole pose graphs: how far down, how fast, and with wrong loop closures added.

    python -m benchmarks.pose_graphs [--wrong] [--seeds 3] [--repeats 10]

Real graphs are looked for where EXPEDITION_DATA says, or in `shared/data` beside the repository.
If `gtsam` happens to be installed it is measured in the same run; it is no dependency of ours.
Times are of the optimisation alone, the best of some repeats, on the files' first guesses.
"""

from __future__ import annotations

import argparse
import gzip
import importlib
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.floors import data_folder
from benchmarks.wrong_loops import relative_error, trajectory_error, with_wrong_loops
from expedition.graph_files.g2o import GraphFile, read_g2o
from mapping.batch_optimisation import held_nodes, optimise
from mapping.robust_optimisation import dead_reckoned, optimise_robustly, ways

KINDS = ("random near", "random far", "group near", "group far")
SHARES = (0.1, 0.5, 1.0)
_ROW = "{:8} {:22} {:>10} {:>6} {:>9}"
_WRONG = "{:8} {:11} {:>5} {:>5} {:>10} {:>8} {:>8} {:>7} {:>6} {:>8}"


def best_of(repeats: int, run: Callable[[], Any]) -> tuple[Any, float]:
    """Return what `run` returns, and its least time [s]."""
    result, least = run(), float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        result = run()
        least = min(least, time.perf_counter() - start)
    return result, least


def clean_rows(name: str, path: Path, graph: GraphFile, repeats: int) -> None:
    """Print what the plain optimiser and the robust one make of a graph as it is."""

    def plain() -> Any:
        held = held_nodes(len(graph.poses), graph.constraints, graph.fixed)
        return optimise(graph.poses, graph.constraints, held)

    def robust() -> Any:
        held = held_nodes(len(graph.poses), graph.constraints, graph.fixed)
        return optimise_robustly(graph.poses, graph.constraints, held)

    for label, run in (("plain", plain), ("robust", robust)):
        best, seconds = best_of(repeats, run)
        print(_ROW.format(name, label, f"{best.chi2:.4f}", best.iterations, f"{seconds:.4f}"))
    try:
        gtsam = importlib.import_module("gtsam")
    except ImportError:
        return
    gtsam_rows(gtsam, name, path, repeats)


def gtsam_rows(gtsam: Any, name: str, path: Path, repeats: int) -> None:
    """Print what GTSAM makes of it."""
    with tempfile.NamedTemporaryFile(suffix=".g2o") as plain:
        plain.write(gzip.decompress(path.read_bytes()))
        plain.flush()
        factors, first = gtsam.readG2o(plain.name, False)
    noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([1e-6, 1e-6, 1e-8]))
    factors.add(gtsam.PriorFactorPose2(0, first.atPose2(0), noise))
    for label, optimiser in (
        ("GTSAM Gauss-Newton", gtsam.GaussNewtonOptimizer),
        ("GTSAM Levenberg", gtsam.LevenbergMarquardtOptimizer),
    ):
        steps = optimiser(factors, first)
        steps.optimize()
        values, seconds = best_of(repeats, lambda o=optimiser: o(factors, first).optimize())
        chi2 = 2.0 * factors.error(values)
        print(_ROW.format(name, label, f"{chi2:.4f}", steps.iterations(), f"{seconds:.4f}"))


def wrong_rows(name: str, graph: GraphFile, seeds: int) -> None:
    """Print what is left of a graph's optimum when wrong loop closures are added."""
    held = held_nodes(len(graph.poses), graph.constraints, graph.fixed)
    clean = optimise(graph.poses, graph.constraints, held).poses
    way = dead_reckoned(graph.poses, graph.constraints.only(ways(graph.constraints)), held)
    for kind in KINDS:
        for share in SHARES:
            for seed in range(1, seeds + 1):
                both, wrong = with_wrong_loops(graph.constraints, way, share, kind, seed)
                start = time.perf_counter()
                best = optimise_robustly(graph.poses, both, held)
                seconds = time.perf_counter() - start
                print(
                    _WRONG.format(
                        name, kind, f"{share:.0%}", seed, f"{best.chi2:.4f}",
                        f"{trajectory_error(best.poses, clean):.4f}",
                        f"{relative_error(best.poses, clean):.5f}",
                        int((~wrong & ~best.kept).sum()), int((wrong & best.kept).sum()),
                        f"{seconds:.2f}",
                    ),
                    flush=True,
                )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="Whole pose graphs, clean and with wrong loops.")
    parser.add_argument("--wrong", action="store_true", help="add wrong loop closures, too")
    parser.add_argument("--seeds", type=int, default=1, help="sets of wrong closures per row")
    parser.add_argument("--repeats", type=int, default=10, help="of which the fastest counts")
    options = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("no pose graphs found: set EXPEDITION_DATA to the folder that has graphs/")
    paths = {name: folder / "graphs" / f"{name}.g2o.gz" for name in ("m3500", "intel")}
    print(_ROW.format("graph", "optimiser", "chi2", "steps", "seconds"))
    for name, path in paths.items():
        clean_rows(name, path, read_g2o(path), options.repeats)
    if options.wrong:
        print()
        print(_WRONG.format(
            "graph", "wrong loops", "share", "seed", "chi2", "rmse_m", "step_m", "missing",
            "kept", "seconds",
        ))  # fmt: skip
        for name, path in paths.items():
            wrong_rows(name, read_g2o(path), options.seeds)


if __name__ == "__main__":
    main()
