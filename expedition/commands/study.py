"""`expedition list` and `expedition experiment`."""

from __future__ import annotations

import dataclasses
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from expedition.commands.options import JsonOption, print_json
from expedition.team import UsageError


def list_everything(as_json: JsonOption = False) -> None:
    """List teams, worlds, strategies, estimators and experiments, each with one line."""
    from expedition.catalogue import catalogue

    entries = catalogue()
    if as_json:
        print_json(entries)
        return
    for kind, names in entries.items():
        print(kind)
        for name, line in names.items():
            print(f"  {name:26} {line}")


def experiment(
    name: Annotated[str, typer.Argument(help="see `expedition list`, or module:function")],
    quick: Annotated[bool, typer.Option("--quick", help="a small version, to see it work")] = False,
    workers: Annotated[
        int, typer.Option(min=1, help="processes to use", show_default="one per core")
    ] = os.cpu_count() or 1,
    seeds: Annotated[int | None, typer.Option(min=1, help="runs per setting")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="folder for table and plot", show_default="runs/experiment-NAME"),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(help="folder of real maps and logs, where one wants them"),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Reproduce a table or figure of a paper, or a comparison of our own."""
    from expedition.experiments.experiment import ExperimentOptions, load_experiment
    from expedition.experiments.registry import EXPERIMENTS
    from expedition.experiments.tables import write_tables

    try:
        run = load_experiment(EXPERIMENTS.get(name, name))
    except (ValueError, ImportError, AttributeError):
        known = ", ".join(EXPERIMENTS)
        raise UsageError(
            f"no experiment {name!r}: use one of {known}, or module:function"
        ) from None
    folder = out or Path("runs") / f"experiment-{name.replace(':', '-')}"
    folder.mkdir(parents=True, exist_ok=True)
    result = run(ExperimentOptions(quick, workers, seeds, folder, data))
    write_tables(result, folder)
    if as_json:
        print_json(dataclasses.asdict(result))
    else:
        _show(result, folder)
    return 0


def _show(result: Any, folder: Path) -> None:
    """Print the claims and where the table is."""
    for claim in result.claims:
        print(f"{'holds' if claim.holds else 'DOES NOT HOLD'}: {claim.claim} ({claim.figure})")
    print(f"table and plot: {folder}", file=sys.stderr)
