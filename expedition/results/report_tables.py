"""The report's tables: robots, what was left unexplored, and what went over the radio."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import Any

from expedition.results.record import place_of
from expedition.results.report_map import NUMBERS, colour
from expedition.results.task_bars import TaskBar
from expedition.results.words import DASH, area, length, size, text

MOST_ROWS = 300  # of a table; the whole list is in summary.json


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


def robots_card(summary: dict[str, Any], bars: list[TaskBar]) -> str:
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


def remaining_card(summary: dict[str, Any]) -> str:
    """Return the table of what was left, and why."""
    remaining = summary["remaining"]
    if not remaining:
        return (
            '<section class="card"><h2>Left unexplored</h2>'
            '<p class="quiet">No place was reported as left.</p></section>'
        )
    rows = []
    for number, left in enumerate(remaining[:MOST_ROWS], start=1):
        place = place_of(left)
        where = DASH if place is None else f"{place[0]:.1f}, {place[1]:.1f}"
        long = length(left.get("length_m"))
        gain = area(left.get("gain_m2"))
        rows.append((str(number), where, long, gain, text(left.get("reason"))))
    numbers = ", numbers as on the map" if len(remaining) <= NUMBERS else ""
    head = (("#", True), ("x, y [m]", True), ("long", True), ("to gain", True), ("why", False))
    return (
        f'<section class="card"><h2>Left unexplored <small>{len(remaining)} places{numbers}'
        f"</small></h2>{_table(head, rows)}</section>"
    )


def bytes_card(summary: dict[str, Any]) -> str:
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
        f"{_losses(summary['links'])}{_traffic('message', summary['bytes'])}{links}</section>"
    )


def _losses(links: dict[str, dict[str, Any]]) -> str:
    """Return a line on what did not arrive, or nothing where all did."""
    sent, lost, queued = (
        sum(link[book]["count"] for link in links.values()) for book in ("sent", "lost", "queued")
    )
    if not lost and not queued:
        return ""
    late = f", {queued:,} were still on their way at the end" if queued else ""
    return f'<p class="quiet">{lost:,} of {sent:,} frames were lost{late}.</p>'


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
