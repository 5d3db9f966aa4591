"""Figures as people read them, in HTML."""

from __future__ import annotations

import math
from html import escape

DASH = "&ndash;"  # what stands where nothing is known


def text(value: object) -> str:
    """Return `value` safe to stand in HTML; a dash for nothing."""
    return DASH if value is None or value == "" else escape(str(value))


def percent(share: float | None, digits: int = 1) -> str:
    """Return a share as a percentage; never 100 % for a share that is not."""
    if share is None:
        return DASH
    shown = round(100.0 * share, digits)
    if shown >= 100.0 and share < 1.0:
        shown = 100.0 - 10.0**-digits
    return f"{shown:.{digits}f} %"


def duration(seconds: float | None, unit: str = "s") -> str:
    """Return a time as `42.0 s`, `8 min 05 s` or `1 h 02 min`; steps as a count."""
    if seconds is None or not math.isfinite(seconds):
        return DASH
    if unit == "steps":
        return f"{seconds:.0f} steps"
    if seconds < 99.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def length(metres: float | None) -> str:
    """Return a length as `4.1 cm`, `52.3 m` or `1.25 km`."""
    if metres is None:
        return DASH
    if metres < 0.995:
        return f"{100.0 * metres:.1f} cm"
    return f"{metres:.1f} m" if metres < 1000.0 else f"{metres / 1000.0:.2f} km"


def area(square_metres: float | None) -> str:
    """Return an area in square metres."""
    if square_metres is None:
        return DASH
    digits = 2 if square_metres < 1.0 else 1 if square_metres < 100.0 else 0
    return f"{square_metres:,.{digits}f} m²"


def size(count: float | None) -> str:
    """Return a number of bytes as `812 B`, `12.4 kB`, `3.21 MB`."""
    if count is None:
        return DASH
    for unit, step in (("GB", 1.0e9), ("MB", 1.0e6), ("kB", 1.0e3)):
        if count >= step:
            return f"{count / step:.3g} {unit}"
    return f"{count:.0f} B"


def factor(value: float | None) -> str:
    """Return a ratio as `41&times;`."""
    if value is None:
        return DASH
    return f"{value:.0f}&times;" if value >= 9.5 else f"{value:.2g}&times;"
