"""Tables of experiments: for people, for spreadsheets, for programs."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from expedition.experiments.experiment import ExperimentResult, Row
from expedition.results.files import as_json, plain, write_atomically


def columns_of(rows: Sequence[Row]) -> list[str]:
    """Return the names of all columns, in the order in which they first occur."""
    return list(dict.fromkeys(name for row in rows for name in row))


def cell(value: Any) -> str:
    """Return a value as it stands in a text table: four digits, `yes` or `no`, `-` for nothing."""
    value = plain(value)
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1.0e4 else f"{value:.0f}"
    return str(value)


def text_table(rows: Sequence[Row]) -> str:
    """Return an aligned text table with a head; columns of numbers are set right."""
    names = columns_of(rows)
    if not names:
        return "(no rows)\n"
    cells = [[cell(row.get(name)) for name in names] for row in rows]
    widths = [max(len(line[i]) for line in [names, *cells]) for i in range(len(names))]
    right = [all(_is_number(row.get(name)) for row in rows) for name in names]

    def line(words: Sequence[str]) -> str:
        padded = (
            word.rjust(width) if is_right else word.ljust(width)
            for word, width, is_right in zip(words, widths, right, strict=True)
        )
        return "  ".join(padded).rstrip() + "\n"

    return line(names) + line(["-" * width for width in widths]) + "".join(map(line, cells))


def _is_number(value: Any) -> bool:
    return value is None or (
        isinstance(value, int | float | np.number) and not isinstance(value, bool)
    )


def csv_table(rows: Sequence[Row]) -> str:
    """Return the table as comma-separated values, with a head; nothing is an empty field."""
    names = columns_of(rows)
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, names, lineterminator="\n", restval="")
    writer.writeheader()
    for row in rows:
        values = {name: plain(value) for name, value in row.items()}
        writer.writerow({name: "" if value is None else value for name, value in values.items()})
    return buffer.getvalue()


def result_value(result: ExperimentResult) -> dict[str, Any]:
    """Return `{name, rows, claims: [{claim, holds, figure}]}`, made of plain JSON values."""
    claims = [{"claim": c.claim, "holds": c.holds, "figure": c.figure} for c in result.claims]
    return {"name": result.name, "rows": plain(result.rows), "claims": plain(claims)}


def claims_text(result: ExperimentResult) -> str:
    """Return one line per claim: whether it holds, the claim, the figures."""
    return "".join(
        f"{'holds' if c.holds else 'FAILS'}  {c.claim}  [{c.figure}]\n" for c in result.claims
    )


def write_tables(result: ExperimentResult, out: Path) -> list[Path]:
    """Write `NAME.txt`, `NAME.csv` and `NAME.json` into `out`; return their paths.

    Raises:
        OSError: a file cannot be written.
    """
    contents: dict[str, Callable[[], str]] = {
        "txt": lambda: text_table(result.rows) + "\n" + claims_text(result),
        "csv": lambda: csv_table(result.rows),
        "json": lambda: as_json(result_value(result), indent=2) + "\n",
    }
    paths = []
    for suffix, content in contents.items():
        path = out / f"{result.name}.{suffix}"
        write_atomically(path, content())
        paths.append(path)
    return paths


def spread(values: Sequence[float | None]) -> dict[str, float | None]:
    """Return `min, median, max` over the values that are not None; all None without any."""
    known = [float(value) for value in values if value is not None]
    if not known:
        return {"min": None, "median": None, "max": None}
    return {"min": min(known), "median": float(np.median(known)), "max": max(known)}
