"""Turning a pydantic complaint into one line that names the key and the mend."""

from __future__ import annotations

from pydantic import ValidationError


def one_line(source: str, error: ValidationError) -> str:
    """Return one line on the first thing wrong in `source` (a file's name)."""
    first = error.errors()[0]
    key = ""
    for part in first["loc"]:
        key += f"[{part}]" if isinstance(part, int) else f".{part}" if key else str(part)
    kind = first["type"]
    if kind == "extra_forbidden":
        return f"{source}: unknown key '{key}'; remove it or correct its spelling"
    if kind == "missing":
        return f"{source}: '{key}' is missing; add it"
    more = error.error_count() - 1
    note = f" (and {more} more)" if more else ""
    shown = repr(first["input"])
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    return f"{source}: '{key}' is {shown}: {first['msg'].lower()}{note}"
