"""`expedition optimize`."""

from __future__ import annotations

import dataclasses
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from expedition.commands.options import JsonOption, print_json

if TYPE_CHECKING:
    from expedition.graph_files.optimise import Summary


def optimize(
    graph: Annotated[
        Path,
        typer.Argument(
            metavar="GRAPH.g2o", help="poses and what was measured of them (g2o, 2D; gz too)"
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.g2o", help="write the graph with its poses at the optimum"),
    ] = None,
    robust: Annotated[
        bool,
        typer.Option(
            "--robust/--no-robust",
            help="leave out loop closures that contradict the rest, or count all edges",
        ),
    ] = True,
    as_json: JsonOption = False,
) -> None:
    """Find the likeliest poses of a pose graph.

    Edges between consecutive vertices are a robot's way, and trusted. All
    others say that two places are one, which may be wrong: with --robust (the
    default) those that contradict the rest do not count. Where none does, all
    edges count. Vertices named by FIX stay where they are, else the first does.

    The sums of squared errors, before and after, are over the edges that
    count. The seconds are the optimisation's, without reading the file.
    """
    from expedition.graph_files.g2o import read_g2o, with_poses, write_text
    from expedition.graph_files.optimise import optimise_graph

    read = read_g2o(graph)
    poses, summary = optimise_graph(read, robust)
    if out is not None:
        write_text(out, with_poses(read, poses))
    if as_json:
        print_json(dataclasses.asdict(summary))
    else:
        print(textwrap.fill(f"{graph.name}: {_in_words(summary, out)}", width=88))


def _in_words(summary: Summary, out: Path | None) -> str:
    """Return what came of it as a paragraph."""
    judged = "all edges count"
    if summary.rejected == 1:
        judged = "1 edge contradicts the rest and does not count"
    elif summary.rejected:
        judged = f"{summary.rejected} edges contradict the rest and do not count"
    written = f"written to {out}" if out else "use --out FILE.g2o to keep the poses"
    return (
        f"{summary.vertices} poses, {summary.edges} edges; {judged}. The sum of squared errors "
        f"went from {summary.chi2_before:.6g} to {summary.chi2_after:.6g} in {summary.iterations} "
        f"step{'s' * (summary.iterations != 1)} and {summary.seconds:.3f} s; {written}."
    )
