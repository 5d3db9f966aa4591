"""A pose graph of a file, optimised, and what came of it."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from expedition.graph_files.g2o import GraphFile
from mapping.batch_optimisation import held_nodes, optimise
from mapping.constraints import Constraints
from mapping.geometry import Floats
from mapping.robust_optimisation import optimise_robustly


@dataclass(frozen=True, slots=True)
class Summary:
    """What an optimisation came to.

    Attributes:
        chi2_before: sum of squared weighed errors at the file's poses, of the edges that count.
        chi2_after: the same at the optimum.
        iterations: linear systems solved.
        seconds: of the optimisation, by the wall clock, without reading the file.
        vertices: how many.
        edges: how many.
        rejected: how many of the edges do not count, as they contradict the rest.
    """

    chi2_before: float
    chi2_after: float
    iterations: int
    seconds: float
    vertices: int
    edges: int
    rejected: int


def optimise_graph(graph: GraphFile, robust: bool) -> tuple[Floats, Summary]:
    """Find the likeliest poses of a graph.

    Args:
        graph: as read.
        robust: leave out loop closures that contradict the rest.

    Returns:
        Poses (N, 3) in the order of the graph's ids, and what came of it.
    """
    constraints = graph.constraints
    _load_loops(robust)
    start = time.perf_counter()
    held = held_nodes(len(graph.poses), constraints, graph.fixed)
    kept = np.ones(len(constraints), dtype=bool)
    if robust:
        best = optimise_robustly(graph.poses, constraints, held)
        poses, chi2, iterations, kept = best.poses, best.chi2, best.iterations, best.kept
    else:
        plain = optimise(graph.poses, constraints, held)
        poses, chi2, iterations = plain.poses, plain.chi2, plain.iterations
    seconds = time.perf_counter() - start
    before = float(constraints.squared_errors(graph.poses)[kept].sum())
    summary = Summary(
        before, chi2, iterations, round(seconds, 6), len(graph.ids), len(constraints),
        int((~kept).sum()),
    )  # fmt: skip
    return poses, summary


def _load_loops(robust: bool) -> None:
    """Have the compiled loops loaded, by a walk round a square that closes wrongly, or rightly."""
    ends = np.array([*((k, k + 1) for k in range(4)), (0, 4)])
    measured = np.tile([1.0, 0.0, 0.5 * np.pi], (5, 1))
    measured[4] = (1e3, 0.0, 0.0) if robust else (0.0, 0.0, 0.0)
    square = Constraints(ends, measured, np.tile(np.eye(3), (5, 1, 1)))
    optimise_robustly(np.zeros((5, 3)), square, held_nodes(5, square, []))
