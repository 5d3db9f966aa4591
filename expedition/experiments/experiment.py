"""What every experiment is: a function from options to a table and the claims it bears out."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar, cast

from expedition.last_will import end_with_parent

Row = dict[str, Any]
_Job = TypeVar("_Job")
_Done = TypeVar("_Done")


@dataclass(frozen=True)
class ExperimentOptions:
    """How to run an experiment.

    Attributes:
        quick: a small version that takes seconds to a minute, to see that it works.
        workers: processes to use.
        seeds: runs per setting; None leaves it to the experiment.
        out: folder for tables and plots; made when missing.
        data: folder of real maps and logs, for experiments that want some.
    """

    quick: bool
    workers: int
    seeds: int | None
    out: Path
    data: Path | None = None


@dataclass(frozen=True)
class Claim:
    """A sentence of a paper, or of our own, and whether it held.

    Attributes:
        claim: what is claimed.
        holds: whether it did here.
        figure: the figures it was judged by.
    """

    claim: str
    holds: bool
    figure: str


@dataclass(frozen=True)
class ExperimentResult:
    """What an experiment gives.

    Attributes:
        name: of the experiment, as in the registry.
        rows: the table, one dict of plain values a row, all with the same keys.
        claims: what the table says about the claims.
    """

    name: str
    rows: list[Row]
    claims: list[Claim] = field(default_factory=list)


Experiment = Callable[[ExperimentOptions], ExperimentResult]


def load_experiment(entry: str) -> Experiment:
    """Return the experiment that `entry` names as "module:function".

    Raises:
        ValueError: the entry is not of that form.
        ImportError: there is no such module.
        AttributeError: the module has no such function.
    """
    module, colon, name = entry.partition(":")
    if not colon or not module or not name:
        raise ValueError(f"'{entry}' is no experiment; write it as module:function")
    return cast(Experiment, getattr(importlib.import_module(module), name))


def describe(entry: str) -> str:
    """Return the first line of an experiment's docstring."""
    return (load_experiment(entry).__doc__ or "").strip().partition("\n")[0]


def run_all(work: Callable[[_Job], _Done], jobs: Iterable[_Job], workers: int = 1) -> list[_Done]:
    """Return `work(job)` for every job, in the order of the jobs, on `workers` processes.

    With one worker everything runs here. `work` must be a module's function, jobs plain data.
    """
    todo = list(jobs)
    if workers <= 1 or len(todo) <= 1:
        return [work(job) for job in todo]
    # Fresh interpreters: a fork would copy threads and sockets that the caller may hold.
    count, context = min(workers, len(todo)), get_context("spawn")
    with ProcessPoolExecutor(count, context, initializer=end_with_parent) as pool:
        return list(pool.map(work, todo))
