"""Plots of experiments: thin helpers over matplotlib, drawn without a screen."""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from expedition.results.colours import ROBOTS
from expedition.results.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = "osD^vP*X"
_STYLE: Any = {
    "font.size": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e6eb",
    "axes.axisbelow": True,
    "axes.edgecolor": "#6b7480",
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
}


def new_figure(title: str, x: str, y: str, width: float = 7.0) -> tuple[Figure, Axes]:
    """Return an empty plot with a title and names of its axes; `width` in inches."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure as NewFigure

    with matplotlib.rc_context(_STYLE):
        figure = NewFigure(figsize=(width, 0.62 * width), layout="constrained")
        axes = figure.add_subplot()
        axes.set_title(title)
        axes.set_xlabel(x)
        axes.set_ylabel(y)
    return figure, axes


def new_panels(rows: int, columns: int, width: float = 11.0) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure of empty plots, and these by row and column; `width` in inches."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure as NewFigure

    with matplotlib.rc_context(_STYLE):
        size = width, 0.62 * width / columns * max(rows, 1)
        figure = NewFigure(figsize=size, layout="constrained")
        places = [figure.add_subplot(rows, columns, k + 1) for k in range(rows * columns)]
    return figure, [places[row * columns : (row + 1) * columns] for row in range(rows)]


def plot_spreads(
    axes: Axes, lines: Mapping[str, Sequence[tuple[float, Mapping[str, float | None]]]]
) -> None:
    """Draw one line per name through medians, with bars from the least to the greatest value.

    Lines stand a little beside each other so that their bars stay apart.

    Args:
        axes: where to draw.
        lines: name -> points (x, {min, median, max}); a point whose median is None is left out.

    Source: the manner of Figures 8 to 10 in Simmons et al. 2000.
    """
    places = sorted({x for points in lines.values() for x, _ in points})
    gaps = [b - a for a, b in itertools.pairwise(places)]
    step = 0.05 * min(gaps, default=1.0)
    for i, (name, points) in enumerate(lines.items()):
        shift = (i - 0.5 * (len(lines) - 1)) * step
        known = [(x + shift, _bar(values)) for x, values in points if values["median"] is not None]
        xs = [x for x, _ in known]
        medians = [median for _, (_, median, _) in known]
        below = [median - low for _, (low, median, _) in known]
        above = [high - median for _, (_, median, high) in known]
        axes.errorbar(
            xs,
            medians,
            yerr=[below, above],
            label=name,
            color=ROBOTS[i % len(ROBOTS)],
            marker=MARKERS[i % len(MARKERS)],
            markersize=5.5,
            linewidth=1.6,
            capsize=3.5,
            elinewidth=1.1,
        )
    if all(float(x).is_integer() for x in places) and 0 < len(places) <= 20:
        axes.set_xticks(places)
    if lines:
        axes.legend(frameon=False)


def _bar(values: Mapping[str, float | None]) -> tuple[float, float, float]:
    """Return (min, median, max); an end that is not known is the median's."""
    median = values["median"]
    low, high = values.get("min"), values.get("max")
    middle = 0.0 if median is None else median
    return middle if low is None else low, middle, middle if high is None else high


def plot_points(axes: Axes, groups: Mapping[str, Iterable[tuple[float, float]]]) -> None:
    """Draw a cloud of small points per name."""
    for i, (name, points) in enumerate(groups.items()):
        pairs = list(points)
        axes.plot(
            [x for x, _ in pairs],
            [y for _, y in pairs],
            linestyle="",
            marker=MARKERS[i % len(MARKERS)],
            markersize=3.5,
            alpha=0.45,
            markeredgewidth=0.0,
            color=ROBOTS[i % len(ROBOTS)],
            label=name,
        )
    if groups:
        axes.legend(frameon=False)


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a plot as PNG or SVG, as the path's suffix says; return the path.

    Raises:
        OSError: the file cannot be written.
    """
    buffer = io.BytesIO()
    # Without date and version the same figures give the same bytes.
    metadata = {"Software": None} if path.suffix == ".png" else {"Date": None}
    figure.savefig(buffer, format=path.suffix[1:], dpi=150, metadata=metadata)
    write_atomically(path, buffer.getvalue())
    return path
