"""How the run went over time: coverage and, under the same axis, what every robot was at."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

from expedition.results.colours import TASKS
from expedition.results.map_image import round_length
from expedition.results.record import RunRecord
from expedition.results.report_map import colour
from expedition.results.task_bars import TaskBar
from expedition.results.words import duration, percent
from mapping.geometry import Floats

LEFT, RIGHT, WIDTH = 84.0, 1100.0, 1120.0  # [pixels] of the time axis within the drawing
TOP, PLOT = 26.0, 200.0  # [pixels] above and of the coverage plot
ROW = 26.0  # [pixels] of one robot's row
POINTS = 800  # more would not show


class TimeAxis:
    """Mission time along x.

    Args:
        end: the last instant shown, more than 0.
        unit: `s` or `steps`.
    """

    def __init__(self, end: float, unit: str) -> None:
        self.end = end
        self.unit = unit

    def x(self, t: float) -> float:
        """Return where an instant lies [pixels]."""
        return LEFT + (RIGHT - LEFT) * min(max(t / self.end, 0.0), 1.0)

    def ticks(self) -> list[tuple[float, str]]:
        """Return instants worth a line, with their labels."""
        rough = self.end / 8.0
        if self.unit == "steps" or rough < 12.0:
            step = round_length(rough) or 1.0
            return [(t, f"{t:g}") for t in np.arange(0.0, self.end * 1.0001, step).tolist()]
        rounds = (15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400)
        step = next((float(s) for s in rounds if s >= rough), 86400.0 * round(rough / 86400.0 + 1))
        times = np.arange(0.0, self.end * 1.0001, step).tolist()
        return [(t, f"{int(t) // 60}:{int(t) % 60:02d}") for t in times]

    @property
    def title(self) -> str:
        """Return what the labels mean."""
        if self.unit == "steps":
            return "steps"
        return "mission time [s]" if self.end / 8.0 < 12.0 else "mission time [min:s]"


def time_svg(record: RunRecord, summary: dict[str, Any], bars: list[TaskBar], end: float) -> str:
    """Return the drawing: coverage above, one row of tasks for each robot below."""
    axis = TimeAxis(end, record.time_unit)
    robots = [robot.id for robot in record.robots_in_order()]
    plot_end = TOP + PLOT
    rows_top = plot_end + 34.0
    bottom = rows_top + ROW * len(robots) + 4.0
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {bottom + 18.0:.0f}" role="img" '
        'aria-label="Coverage and tasks over time">'
        f"{_grid(axis, plot_end, rows_top, bottom, bool(robots))}"
        f"{_coverage(record, summary, axis)}"
        f"{_rows(record, robots, bars, axis, rows_top)}"
        f'<line class="cursor" data-x0="{LEFT}" data-x1="{RIGHT}" y1="{TOP}" y2="{bottom}" '
        'stroke="var(--accent)" stroke-width="1.5" style="display:none"/></svg>'
    )


def _grid(axis: TimeAxis, plot_end: float, rows_top: float, bottom: float, rows: bool) -> str:
    """Return grid lines and labels of both parts."""
    parts = []
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        y = plot_end - PLOT * share
        parts.append(
            f'<line class="grid" x1="{LEFT}" x2="{RIGHT}" y1="{y}" y2="{y}"/>'
            f'<text class="soft" x="{LEFT - 10}" y="{y + 4}" font-size="12" '
            f'text-anchor="end">{100 * share:.0f} %</text>'
        )
    for t, label in axis.ticks():
        x = axis.x(t)
        parts.append(
            f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{plot_end}"/>'
            f'<text class="soft" x="{x:.1f}" y="{plot_end + 18}" font-size="12" '
            f'text-anchor="middle">{label}</text>'
        )
        if rows:
            parts.append(
                f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{rows_top - 6}" y2="{bottom}"/>'
            )
    parts.append(
        f'<text class="soft" x="{LEFT}" y="14" font-size="12">coverage over {axis.title}</text>'
    )
    return "".join(parts)


def _coverage(record: RunRecord, summary: dict[str, Any], axis: TimeAxis) -> str:
    """Return the curve with a mark where it reached each level."""
    table = _thinned(np.asarray(record.coverage_timeline, dtype=np.float64).reshape(-1, 2))
    if len(table) == 0:
        return (
            f'<text class="soft" x="{0.5 * (LEFT + RIGHT)}" y="{TOP + 0.5 * PLOT}" '
            'font-size="14" text-anchor="middle">no coverage was measured</text>'
        )
    base = TOP + PLOT
    points = [(axis.x(t), base - PLOT * min(max(c, 0.0), 1.0)) for t, c in table.tolist()]
    way = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    parts = [
        f'<polygon points="{points[0][0]:.1f},{base} {way} {points[-1][0]:.1f},{base}" '
        'fill="var(--good)" opacity=".13"/>'
        f'<polyline points="{way}" fill="none" stroke="var(--good)" stroke-width="2.2" '
        'stroke-linejoin="round"/>'
    ]
    taken: list[float] = []
    for name, share in (("t50_s", 0.5), ("t90_s", 0.9), ("t95_s", 0.95), ("t99_s", 0.99)):
        t = summary.get(name)
        if t is None:
            continue
        x, y = axis.x(t), base - PLOT * share
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.6" fill="var(--card)" stroke="var(--good)" '
            f'stroke-width="2"><title>{percent(share, 0)} after {duration(t, axis.unit)}</title>'
            "</circle>"
        )
        if all(abs(x - other) > 40.0 for other in taken):
            taken.append(x)
            parts.append(
                f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y + 5:.1f}" y2="{base}" stroke="var(--good)"'
                ' stroke-dasharray="2 3" opacity=".6"/>'
                f'<text class="soft halo" style="stroke:var(--card)" x="{x + 5:.1f}" '
                f'y="{base - 7}" font-size="11.5">t{name[1:-2]}</text>'
            )
    return "".join(parts)


def _thinned(table: Floats) -> Floats:
    """Return at most about POINTS rows, with the first and the last."""
    table = table[np.isfinite(table).all(axis=1)]
    step = -(-len(table) // POINTS)
    return table if step <= 1 else np.vstack((table[::step], table[-1:]))


def _rows(
    record: RunRecord, robots: list[str], bars: list[TaskBar], axis: TimeAxis, top: float
) -> str:
    """Return one row per robot: its name, its tasks, what went wrong, its faults."""
    parts = []
    for index, robot in enumerate(robots):
        y = top + ROW * index
        parts.append(
            f'<text x="{LEFT - 10}" y="{y + 14}" font-size="12.5" text-anchor="end" '
            f'font-weight="600" style="fill:{colour(index)}">{escape(robot[:11])}</text>'
            f'<line class="grid" x1="{LEFT}" x2="{RIGHT}" y1="{y + 9.5}" y2="{y + 9.5}"/>'
        )
        parts.extend(_bar(bar, axis, y) for bar in bars if bar.robot == robot)
        for fault in _faults(record):
            t = fault.get("t_s")
            if fault.get("robot") == robot and isinstance(t, int | float):
                x = axis.x(t)
                parts.append(
                    f'<path d="M{x:.1f} {y + 1}l5-8h-10Z" fill="var(--bad)"><title>'
                    f"{escape(str(fault.get('kind', 'fault')))} at {duration(t, axis.unit)}"
                    "</title></path>"
                )
    return "".join(parts)


def _faults(record: RunRecord) -> list[dict[str, Any]]:
    """Return scripted faults, and robots that the server lost or found again."""
    robots = [e for e in record.tasks if e.get("event") in ("lost", "back")]
    return record.faults + [{**e, "kind": e["event"]} for e in robots]


def task_colour(kind: str) -> str:
    """Return the style sheet's name of the colour of a kind of task."""
    return f"var(--{kind})" if kind in TASKS else "var(--soft)"


def _bar(bar: TaskBar, axis: TimeAxis, y: float) -> str:
    """Return one task; a failed one has a red end with a cross."""
    x0, x1 = axis.x(bar.start), axis.x(bar.end)
    words = f"{bar.kind}, task {bar.task}: {bar.outcome or 'not ended'}"
    goal = f" at ({bar.goal[0]:.1f}, {bar.goal[1]:.1f}) m" if bar.goal else ""
    reason = f" ({bar.reason})" if bar.reason else ""
    when = f"{duration(bar.start, axis.unit)} to {duration(bar.end, axis.unit)}"
    cross = (
        f'<path d="M{x1 - 3.5:.1f} {y + 6}l7 7m0-7l-7 7" stroke="var(--bad)" stroke-width="2.2"/>'
        if bar.failed
        else ""
    )
    opacity = 0.55 if bar.outcome == "terminated" else 0.95
    return (
        f"<g><title>{escape(f'{words}{goal}{reason}, {when}')}</title>"
        f'<rect x="{x0:.1f}" y="{y + 1}" width="{max(x1 - x0 - 0.8, 0.8):.1f}" height="17" rx="2.5"'
        f' fill="{task_colour(bar.kind)}" opacity="{opacity}"/>{cross}</g>'
    )
