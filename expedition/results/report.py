"""`report.html`: a run on one page that needs nothing but itself."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import Any

import numpy as np

from expedition.results.colours import TASKS, robot_dash
from expedition.results.exports import config_toml
from expedition.results.record import RunRecord
from expedition.results.report_map import (
    SAMPLES,
    TRUTH,
    colour,
    map_svg,
    motion,
    sheet_of,
    victim_cross,
)
from expedition.results.report_style import SCRIPT, style_sheet
from expedition.results.report_tables import bytes_card, remaining_card, robots_card
from expedition.results.report_time import task_colour, time_svg
from expedition.results.task_bars import TaskBar, task_bars
from expedition.results.tracks import as_track
from expedition.results.victims import victim_marks
from expedition.results.words import DASH, area, duration, factor, length, percent, size, text

# How an end looks and what it means.
ENDINGS = {
    "explored": ("good", "nothing was left to explore"),
    "coverage": ("good", "the wanted coverage was reached"),
    "operator": ("warn", "an operator ended it"),
    "time_limit": ("warn", "the time was up"),
    "failed": ("bad", "it failed"),
}


def report_html(record: RunRecord, summary: dict[str, Any]) -> str:
    """Return the page for a run.

    Args:
        record: what the run left behind.
        summary: from `summarise(record)`.
    """
    end = max(_end(record), 1e-3)
    bars = task_bars(record.tasks, end)
    title = escape(f"{record.team or 'run'} in {record.world or 'an unnamed world'}")
    body = (
        _header(record, summary, title),
        _problems(summary),
        _tiles(record, summary),
        _map_card(record, bars, end),
        _time_card(record, summary, bars, end),
        robots_card(summary, bars),
        f'<div class="two">{remaining_card(summary)}{bytes_card(summary)}</div>',
        _config_card(record),
    )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{title} · Expedition</title><style>{style_sheet()}</style></head>"
        f"<body><main>{''.join(body)}{_footer(record)}</main>"
        f"<script>{SCRIPT}</script></body></html>\n"
    )


def _end(record: RunRecord) -> float:
    """Return the last instant of the run, in the unit of its time line."""
    timeline = np.asarray(record.coverage_timeline).reshape(-1, 2)
    last = float(timeline[-1, 0]) if len(timeline) and np.isfinite(timeline[-1, 0]) else 0.0
    return last if record.time_unit == "steps" else max(last, record.sim_time_s)


def _header(record: RunRecord, summary: dict[str, Any], title: str) -> str:
    """Return what was run, how it ended, and the one sentence to remember."""
    look, meaning = ENDINGS.get(record.ended, ("bad", "it ended in an unknown way"))
    chips = "".join(
        f'<span class="chip">{name} <b>{text(value)}</b></span>'
        for name, value in (
            ("strategy", record.strategy),
            ("estimator", record.estimator),
            ("seed", record.seed),
            ("version", record.version),
        )
    )
    reason = escape(record.reason.rstrip(".")) or meaning
    lead = f"{_achievement(record, summary)} Why it ended: {reason}."
    return (
        f'<header><div class="brand">Expedition</div><h1>{title}</h1>'
        f'<div class="chips"><span class="chip ended {look}">{text(record.ended)}</span>{chips}'
        f'</div><p class="lead">{lead}</p></header>'
    )


def _achievement(record: RunRecord, summary: dict[str, Any]) -> str:
    """Return one sentence on what the team did."""
    count = len(record.robots)
    if count == 0:
        return "No robot took part."
    share, whole = summary["coverage"], summary["reachable_m2"]
    of = f" of {area(whole)}" if whole is not None else " of the reachable area"
    what = area(summary["mapped_m2"]) if share is None else f"{percent(share)}{of}"
    team = "One robot" if count == 1 else f"{count} robots"
    took = _end(record) if record.time_unit == "steps" else record.sim_time_s
    return f"{team} mapped {what} in {duration(took, record.time_unit)}."


def _problems(summary: dict[str, Any]) -> str:
    """Return a notice of what could not be computed, if anything."""
    if not summary["problems"]:
        return ""
    items = "".join(f"<li>{escape(str(problem))}</li>" for problem in summary["problems"])
    return f'<section class="card notice"><h2>Please note</h2><ul>{items}</ul></section>'


def _tiles(record: RunRecord, summary: dict[str, Any]) -> str:
    """Return the key figures."""
    unit = record.time_unit
    errors = _known(summary["robots"], "trajectory_rmse_m")
    ways = _known(summary["robots"], "path_m")
    each = " · ".join(f"{way:.0f}" for way in ways[:5]) + (" …" if len(ways) > 5 else "")
    traffic = sum(entry["bytes"] for entry in summary["bytes"].values())
    frames = sum(entry["count"] for entry in summary["bytes"].values())
    digest = escape(summary["digest"] or "")
    half, most = (duration(summary[key], unit) for key in ("t50_s", "t95_s"))
    levels = f"50 %: {half}<br>95 %: {most}"
    tiles = (
        _coverage_tile(summary),
        _tile("90 % covered after", duration(summary["t90_s"], unit), levels),
        _tile("trajectory error", length(max(errors, default=None)), "worst robot, RMSE"),
        _walls_tile(summary["map"]),
        _tile("driven", length(sum(ways)) if ways else DASH, f"{each} m" if ways else "no robots"),
        _tile("seen twice", percent(summary["overlap"]), "overlap of single coverages"),
        _tile("radio", size(traffic) if frames else DASH, f"{frames:,} frames"),
        _tile(
            "speed",
            factor(summary["real_time_factor"]),
            f"real time; {duration(record.wall_time_s)} on the clock",
        ),
        *_victim_tiles(summary),
        _tile("left unexplored", str(len(summary["remaining"])), "places, each with its reason"),
        _tile(
            "digest",
            f'<code title="{digest}">{digest[:10] or DASH}</code>',
            "same digest, same run",
        ),
    )
    return f'<section class="tiles">{"".join(tiles)}</section>'


def _victim_tiles(summary: dict[str, Any]) -> list[str]:
    """Return how many victims were found, where somebody searched."""
    if "victims" not in summary:
        return []
    found, missed = summary["victims"], summary["victims_missed"]
    right = [victim for victim in found if victim["error_m"] is not None]
    if missed is None:
        return [_tile("victims found", str(len(found)), "no truth to compare with")]
    wrong = len(found) - len(right)
    note = "everybody" if not missed else f"{len(missed)} missed"
    note += f", {wrong} where nobody lies" if wrong else ""
    return [_tile("victims found", f"{len(right)} of {len(right) + len(missed)}", note)]


def _known(rows: Iterable[dict[str, Any]], key: str) -> list[float]:
    return [row[key] for row in rows if row[key] is not None]


def _coverage_tile(summary: dict[str, Any]) -> str:
    """Return how much of the world was covered, with a meter."""
    share, whole = summary["coverage"], summary["reachable_m2"]
    note = "the reachable area is not known" if whole is None else f"of {area(whole)} reachable"
    wide = 0.0 if share is None else 100.0 * min(max(share, 0.0), 1.0)
    meter = f'<div class="meter"><i style="width:{wide:.1f}%"></i></div>'
    return _tile("coverage", percent(share), note, meter)


def _walls_tile(scores: dict[str, Any]) -> str:
    """Return how right the map's walls are."""
    if scores["precision_occupied"] is None:
        return _tile("walls in the right place", DASH, "no truth to compare with")
    found = percent(scores["recall_occupied"])
    note = f"{found} of walls found, within {length(scores['tolerance_m'])}"
    return _tile("walls in the right place", percent(scores["precision_occupied"]), note)


def _tile(name: str, figure: str, note: str, extra: str = "") -> str:
    inside = f"<span>{name}</span><strong>{figure}</strong>{extra}<em>{note}</em>"
    return f'<div class="tile">{inside}</div>'


def _map_card(record: RunRecord, bars: list[TaskBar], end: float) -> str:
    """Return the map with its legend and, when something moved, the time slider."""
    sheet = sheet_of(record)
    moved = any(len(as_track(robot.track_map)) for robot in record.robots)
    drawing = map_svg(record, sheet, bars) if moved or record.grid is not None else ""
    player = (
        '<div class="player"><button id="play">▶ Play</button>'
        f'<input id="t" type="range" min="0" max="{SAMPLES}" step="any" value="{SAMPLES}" '
        'aria-label="time"><output id="clock"></output></div>'
    )
    parts = (
        "" if record.grid is not None else '<p class="quiet">There was no map yet.</p>',
        drawing,
        player if moved else "",
        f'<div class="legend">{_legend(record, bars, TRUTH in drawing)}</div>',
        f'<script type="application/json" id="motion">{motion(record, sheet, end)}</script>',
    )
    return f'<section class="card"><h2>Map</h2>{"".join(parts)}</section>'


def _legend(record: RunRecord, bars: list[TaskBar], truth: bool) -> str:
    """Return the keys of the map: robots, and the marks that occur."""
    keys = []
    for index, robot in enumerate(record.robots_in_order()):
        keys.append(
            f'<span class="key"><svg viewBox="0 0 26 12"><path d="M0 6h26" stroke="{colour(index)}"'
            f' stroke-width="3" stroke-dasharray="{robot_dash(index)}"/></svg>'
            f"{escape(robot.id)}</span>"
        )
    if keys:
        keys.append('<span class="key">○ start&ensp;● end</span>')
    if record.remaining:
        keys.append('<span class="key"><b style="color:var(--warn)">◆</b> left unexplored</span>')
    keys += _victim_keys(record)
    if any(bar.failed and bar.goal for bar in bars):
        keys.append('<span class="key"><b class="failed">&times;</b> goal of a failed task</span>')
    if truth:
        keys.append(
            '<label class="key"><input type="checkbox" id="show-truth"> '
            '<span style="color:#e0315c">true walls</span></label>'
        )
    return "".join(keys)


def _victim_keys(record: RunRecord) -> list[str]:
    """Return the keys of victims' marks, of those that occur."""
    marks = victim_marks(record)
    return [
        f'<span class="key"><svg viewBox="-13 -8 26 16">{victim_cross(found)}</svg>'
        f"victim {word}</span>"
        for found, word in ((True, "found"), (False, "missed"))
        if any(mark.found == found for mark in marks)
    ]


def _time_card(record: RunRecord, summary: dict[str, Any], bars: list[TaskBar], end: float) -> str:
    """Return coverage and tasks over time."""
    kinds = sorted({bar.kind for bar in bars}, key=lambda kind: (*TASKS, kind).index(kind))
    keys = [
        f'<span class="key"><i class="dot" style="background:{task_colour(kind)};'
        f'border-radius:3px"></i>{escape(kind)}</span>'
        for kind in kinds
    ]
    if any(bar.outcome == "terminated" for bar in bars):
        keys.append('<span class="key">pale: taken back</span>')
    if any(bar.failed for bar in bars):
        keys.append('<span class="key"><b class="failed">&times;</b> failed</span>')
    if record.faults or any(event.get("event") == "lost" for event in record.tasks):
        keys.append('<span class="key"><b class="failed">▾</b> fault</span>')
    if not bars and len(record.coverage_timeline) == 0:
        drawing = '<p class="quiet">No coverage was measured and no task was given.</p>'
    else:
        drawing = time_svg(record, summary, bars, end)
    legend = f'<div class="legend">{"".join(keys)}</div>'
    return f'<section class="card"><h2>How it went</h2>{drawing}{legend}</section>'


def _config_card(record: RunRecord) -> str:
    """Return the whole configuration, folded."""
    return (
        '<section class="card"><details><summary>Configuration</summary>'
        f"<pre>{escape(config_toml(record))}</pre></details></section>"
    )


def _footer(record: RunRecord) -> str:
    return (
        "<footer>Coverage is the share of the truth's reachable free area that the team's map "
        "shows as free. All comparisons with the truth use one rigid transform for the whole team. "
        f"Expedition {text(record.version)}.</footer>"
    )
