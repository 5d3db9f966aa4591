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
    NUMBERS,
    SAMPLES,
    colour,
    map_svg,
    motion,
    place_of,
    sheet_of,
)
from expedition.results.report_style import SCRIPT, style_sheet
from expedition.results.report_time import time_svg
from expedition.results.task_bars import TaskBar, task_bars
from expedition.results.words import DASH, area, duration, factor, length, percent, size, text

# How an end looks and what it means.
ENDINGS = {
    "explored": ("good", "nothing was left to explore"),
    "coverage": ("good", "the wanted coverage was reached"),
    "operator": ("warn", "an operator ended it"),
    "time_limit": ("warn", "the time was up"),
    "failed": ("bad", "it failed"),
}
MOST_ROWS = 300  # of a table; the whole list is in summary.json


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
        _robots_card(record, summary, bars),
        f'<div class="two">{_remaining_card(summary)}{_bytes_card(summary)}</div>',
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
    count = len(record.robots)
    team = "No robot" if count == 0 else "One robot" if count == 1 else f"{count} robots"
    share, whole = summary["coverage"], summary["reachable_m2"]
    if share is not None:
        of = f" of {area(whole)}" if whole is not None else ""
        did = f"mapped {percent(share)}{of}"
    else:
        did = f"mapped {area(summary['mapped_m2'])}"
    took = duration(_end(record), record.time_unit)
    reason = escape(record.reason.rstrip(".")) or meaning
    return (
        f'<header><div class="brand">Expedition</div><h1>{title}</h1>'
        f'<div class="chips"><span class="chip ended {look}">{text(record.ended)}</span>{chips}'
        f'</div><p class="lead">{team} {did} in {took}. The mission ended because {reason}.</p>'
        "</header>"
    )


def _problems(summary: dict[str, Any]) -> str:
    """Return a notice of what could not be computed, if anything."""
    if not summary["problems"]:
        return ""
    items = "".join(f"<li>{escape(str(problem))}</li>" for problem in summary["problems"])
    return f'<section class="card notice"><h2>Please note</h2><ul>{items}</ul></section>'


def _tiles(record: RunRecord, summary: dict[str, Any]) -> str:
    """Return the key figures."""
    unit = record.time_unit
    share = summary["coverage"]
    robots = summary["robots"]
    errors = [r["trajectory_rmse_m"] for r in robots if r["trajectory_rmse_m"] is not None]
    ways = [r["path_m"] for r in robots]
    tolerance = f"within {length(summary['map']['tolerance_m'])}"
    recall = f"{percent(summary['map']['recall_occupied'])} of walls found, {tolerance}"
    each = " · ".join(f"{way:.0f}" for way in ways[:5]) + (" …" if len(ways) > 5 else "")
    traffic = sum(entry["bytes"] for entry in summary["bytes"].values())
    frames = sum(entry["count"] for entry in summary["bytes"].values())
    digest = summary["digest"] or ""
    wide = 0.0 if share is None else 100.0 * min(max(share, 0.0), 1.0)
    tiles = (
        _tile(
            "coverage",
            percent(share),
            f"of {area(summary['reachable_m2'])} reachable",
            f'<div class="meter"><i style="width:{wide:.1f}%"></i></div>',
        ),
        _tile(
            "90 % covered after",
            duration(summary["t90_s"], unit),
            f"50 %: {duration(summary['t50_s'], unit)}<br>95 %: {duration(summary['t95_s'], unit)}",
        ),
        _tile("trajectory error", length(max(errors, default=None)), "worst robot, RMSE"),
        _tile("walls in the right place", percent(summary["map"]["precision_occupied"]), recall),
        _tile("driven", length(sum(ways)), f"{each} m" if ways else "no robots"),
        _tile("seen twice", percent(summary["overlap"]), "overlap of single coverages"),
        _tile("radio", size(traffic) if frames else DASH, f"{frames:,} frames"),
        _tile(
            "speed",
            factor(summary["real_time_factor"]),
            f"real time; {duration(record.wall_time_s)} on the clock",
        ),
        _tile("left unexplored", str(len(summary["remaining"])), "places, each with its reason"),
        _tile(
            "digest",
            f'<code title="{escape(digest)}">{escape(digest[:10]) or DASH}</code>',
            "same digest, same run",
        ),
    )
    return f'<section class="tiles">{"".join(tiles)}</section>'


def _tile(name: str, figure: str, note: str, extra: str = "") -> str:
    inside = f"<span>{name}</span><strong>{figure}</strong>{extra}<em>{note}</em>"
    return f'<div class="tile">{inside}</div>'


def _map_card(record: RunRecord, bars: list[TaskBar], end: float) -> str:
    """Return the map with its legend and, when something moved, the time slider."""
    sheet = sheet_of(record)
    moved = any(len(robot.track_map) for robot in record.robots)
    player = (
        '<div class="player"><button id="play">▶ Play</button>'
        f'<input id="t" type="range" min="0" max="{SAMPLES}" step="any" value="{SAMPLES}" '
        'aria-label="time"><output id="clock"></output></div>'
        if moved
        else ""
    )
    nothing = "" if record.grid is not None else '<p class="quiet">There was no map yet.</p>'
    drawing = map_svg(record, sheet, bars)
    legend = _legend(record, bars, truth='class="truth"' in drawing)
    return (
        f'<section class="card"><h2>Map</h2>{nothing}{drawing}{player}'
        f'<div class="legend">{legend}</div>'
        f'<script type="application/json" id="motion">{motion(record, sheet, end)}</script>'
        "</section>"
    )


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
    if any(bar.failed and bar.goal for bar in bars):
        keys.append('<span class="key"><b class="failed">&times;</b> goal of a failed task</span>')
    if truth:
        keys.append(
            '<label class="key"><input type="checkbox" id="show-truth"> '
            '<span style="color:#e0315c">true walls</span></label>'
        )
    return "".join(keys)


def _time_card(record: RunRecord, summary: dict[str, Any], bars: list[TaskBar], end: float) -> str:
    """Return coverage and tasks over time."""
    kinds = sorted({bar.kind for bar in bars}, key=lambda kind: (*TASKS, kind).index(kind))
    keys = [
        f'<span class="key"><i class="dot" style="background:var(--{kind}, var(--soft));'
        f'border-radius:3px"></i>{escape(kind)}</span>'
        for kind in kinds
    ]
    if any(bar.outcome == "terminated" for bar in bars):
        keys.append('<span class="key">pale: taken back</span>')
    if any(bar.failed for bar in bars):
        keys.append('<span class="key"><b class="failed">&times;</b> failed</span>')
    if record.faults:
        keys.append('<span class="key"><b class="failed">▾</b> fault</span>')
    return (
        '<section class="card"><h2>How it went</h2>'
        f'{time_svg(record, summary, bars, end)}<div class="legend">{"".join(keys)}</div></section>'
    )


def _table(head: Iterable[tuple[str, bool]], rows: Iterable[Iterable[str]]) -> str:
    """Return a table; the head says of each column its name and whether it holds numbers."""
    columns = list(head)
    names = "".join(f"<th{_numeric(number)}>{name}</th>" for name, number in columns)
    lines = "".join(
        "<tr>"
        + "".join(
            f"<td{_numeric(number)}>{cell}</td>"
            for cell, (_, number) in zip(cells, columns, strict=True)
        )
        + "</tr>"
        for cells in rows
    )
    return f'<div class="scroll"><table><tr>{names}</tr>{lines}</table></div>'


def _numeric(number: bool) -> str:
    return ' class="num"' if number else ""


def _robots_card(record: RunRecord, summary: dict[str, Any], bars: list[TaskBar]) -> str:
    """Return the table of robots."""
    if not summary["robots"]:
        nobody = '<p class="quiet">No robot took part.</p>'
        return f'<section class="card"><h2>Robots</h2>{nobody}</section>'
    rows = []
    for index, robot in enumerate(summary["robots"]):
        own = [bar for bar in bars if bar.robot == robot["id"]]
        failed = sum(bar.failed for bar in own)
        failures = f' <span class="failed">{failed} failed</span>' if failed else ""
        digest = robot["map_digest"]
        rows.append(
            (
                f'<i class="dot" style="background:{colour(index)}"></i>{escape(robot["id"])}',
                text(robot["ended"]),
                length(robot["path_m"]),
                f"{robot['scans']:,}",
                length(robot["trajectory_rmse_m"]),
                f"{len(own)}{failures}",
                size(robot["bytes_sent"]),
                size(robot["bytes_received"]),
                DASH if digest is None else f"<code>{escape(str(digest)[:10])}</code>",
            )
        )
    head = (
        ("robot", False),
        ("ended", False),
        ("driven", True),
        ("scans", True),
        ("error (RMSE)", True),
        ("tasks", True),
        ("sent", True),
        ("received", True),
        ("own map", True),
    )
    return f'<section class="card"><h2>Robots</h2>{_table(head, rows)}</section>'


def _remaining_card(summary: dict[str, Any]) -> str:
    """Return the table of what was left, and why."""
    remaining = summary["remaining"]
    if not remaining:
        return (
            '<section class="card"><h2>Left unexplored</h2>'
            '<p class="quiet">Nothing: every frontier was explored or explained.</p></section>'
        )
    rows = []
    for number, left in enumerate(remaining[:MOST_ROWS], start=1):
        place = place_of(left)
        where = DASH if place is None else f"{place[0]:.1f}, {place[1]:.1f}"
        rows.append((str(number), where, area(left.get("area_m2")), text(left.get("reason"))))
    numbers = ", numbers as on the map" if len(remaining) <= NUMBERS else ""
    head = (("#", True), ("x, y [m]", True), ("area", True), ("why", False))
    return (
        f'<section class="card"><h2>Left unexplored <small>{len(remaining)} places{numbers}'
        f"</small></h2>{_table(head, rows)}</section>"
    )


def _bytes_card(summary: dict[str, Any]) -> str:
    """Return what went over the radio, by message type and by link."""
    if not summary["bytes"]:
        return (
            '<section class="card"><h2>Radio traffic</h2>'
            '<p class="quiet">Nothing was counted.</p></section>'
        )
    links = ""
    if summary["bytes_links"]:
        links = (
            '<details class="sub"><summary>by link</summary>'
            f"{_traffic('link', summary['bytes_links'])}</details>"
        )
    return (
        '<section class="card"><h2>Radio traffic</h2>'
        f"{_traffic('message', summary['bytes'])}{links}</section>"
    )


def _traffic(name: str, ledger: dict[str, dict[str, int]]) -> str:
    """Return a table of counts and bytes, the largest first."""
    most = max(entry["bytes"] for entry in ledger.values()) or 1
    rows = [
        (
            escape(key),
            f"{entry['count']:,}",
            size(entry["bytes"]),
            f'<i class="bar" style="width:{100.0 * entry["bytes"] / most:.1f}%"></i>',
        )
        for key, entry in sorted(ledger.items(), key=lambda item: (-item[1]["bytes"], item[0]))
    ]
    head = ((name, False), ("frames", True), ("bytes", True), ("", False))
    table = _table(head, rows[:MOST_ROWS])
    return table.replace("<td><i", '<td class="barcell"><i')


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
