"""The map in the report: cells, the truth's walls, trajectories and what was left, as one SVG."""

from __future__ import annotations

import base64
import json
import math
from dataclasses import dataclass
from html import escape

import numpy as np

from expedition.results.colours import ROBOTS, robot_dash
from expedition.results.map_image import (
    Picture,
    layer_png,
    outline,
    picture_of,
    round_length,
)
from expedition.results.record import RobotRecord, RunRecord, place_of
from expedition.results.task_bars import TaskBar
from expedition.results.team_frame import transform_to_world
from expedition.results.tracks import as_track, at_stamps, thinned
from expedition.results.victims import victim_marks
from mapping.geometry import Floats

WIDTH, TALLEST = 1120.0, 800.0  # [pixels] of the drawing
SAMPLES = 400  # steps of the time slider: one each twentieth of a second when played
TRUTH = 'class="truth"'  # marks the layer of true walls
MARKS, NUMBERS = 400, 40  # more marks, or more numbers on them, would only hide the map


@dataclass(frozen=True)
class Sheet:
    """Where the map frame lies on the drawing.

    Attributes:
        picture: the part of the map that is shown.
        scale: pixels per metre.
        left: x [pixels] of the picture's left edge; it stands in the middle of the drawing.
    """

    picture: Picture
    scale: float
    left: float

    @property
    def height(self) -> float:
        """Height of the drawing [pixels]."""
        return self.picture.height * self.scale

    def at(self, points: Floats) -> Floats:
        """Return points (N, 2) [m] of the map frame on the drawing [pixels]."""
        g = self.picture.geometry
        return np.column_stack(
            (
                self.left + (points[:, 0] - g.origin_x) * self.scale,
                self.height - (points[:, 1] - g.origin_y) * self.scale,
            )
        )


def sheet_of(record: RunRecord) -> Sheet:
    """Return the sheet for a run's map: as wide as the page, unless that gets too tall."""
    picture = picture_of(record)
    scale = min(WIDTH / picture.width, TALLEST / picture.height)
    return Sheet(picture, scale, 0.5 * (WIDTH - picture.width * scale))


def map_svg(record: RunRecord, sheet: Sheet, bars: list[TaskBar]) -> str:
    """Return the drawing."""
    robots = list(enumerate(record.robots_in_order()))
    ways = "".join(_way(index, robot, sheet) for index, robot in robots)
    ends = "".join(_end(index, robot, sheet) for index, robot in robots)
    return (
        f'<svg id="map" class="map hide-truth" viewBox="0 0 {WIDTH:.0f} {sheet.height:.0f}" '
        'role="img" aria-label="Map with trajectories">'
        f"{_cells(sheet)}{_truth(record, sheet)}{ways}{_failures(bars, sheet)}"
        f"{_remaining(record, sheet)}{_victims(record, sheet)}{ends}{_scale_bar(sheet)}</svg>"
    )


def motion(record: RunRecord, sheet: Sheet, end: float) -> str:
    """Return where the robots are over time, for the time slider, as JSON.

    `ways` robot -> SAMPLES + 1 places [tenths of a pixel], evenly spaced in time up to its last.
    """
    times = np.linspace(0.0, end, SAMPLES + 1)
    ways = {}
    for index, robot in enumerate(record.robots_in_order()):
        places = sheet.at(at_stamps(as_track(robot.track_map), times)[:, 1:3])
        ways[str(index)] = np.rint(10.0 * places).astype(int).tolist()
    data = {"end": end, "unit": record.time_unit, "ways": ways}
    return json.dumps(data, separators=(",", ":"))


def colour(index: int) -> str:
    """Return the style sheet's name of a robot's colour."""
    return f"var(--r{index % len(ROBOTS)})"


def _image(png: bytes, geometry: str, css: str, cell: float) -> str:
    """Return an embedded picture; large cells stay sharp, small ones are smoothed."""
    look = "image-rendering:pixelated" if cell >= 1.5 else ""
    data = base64.b64encode(png).decode()
    return (
        f'<image class="{css}" {geometry} preserveAspectRatio="none" style="{look}" '
        f'href="data:image/png;base64,{data}"/>'
    )


def _cells(sheet: Sheet) -> str:
    """Return the map's cells, once for light pages and once for dark ones."""
    picture = sheet.picture
    cell = picture.geometry.resolution * sheet.scale
    place = (
        f'x="{sheet.left:.2f}" y="0" width="{picture.width * sheet.scale:.2f}" '
        f'height="{sheet.height:.2f}"'
    )
    light = layer_png(picture.classes, "#ffffff", "#1d2733")
    dark = layer_png(picture.classes, "#28313c", "#cfd8e3")
    return _image(light, place, "on-light", cell) + _image(dark, place, "on-dark", cell)


def _truth(record: RunRecord, sheet: Sheet) -> str:
    """Return the true walls laid onto the map by the team's one transform; hidden at first."""
    T_world_map = transform_to_world(record)
    if record.truth is None or T_world_map is None or record.truth.solid.size == 0:
        return ""
    g = record.truth.geometry
    T_map_world = T_world_map.inverse()
    corner = sheet.at(T_map_world.apply([[g.origin_x, g.origin_y + g.rows * g.resolution]]))[0]
    turn = -math.degrees(T_map_world.theta)  # y runs down on the drawing
    cell = g.resolution * sheet.scale
    png = layer_png(outline(record.truth.solid), "#ffffff", "#e0315c")
    image = _image(png, f'width="{g.cols * cell:.2f}" height="{g.rows * cell:.2f}"', "", cell)
    return (
        f'<g {TRUTH} opacity=".8" '
        f'transform="translate({corner[0]:.2f} {corner[1]:.2f}) rotate({turn:.4f})">{image}</g>'
    )


def _way(index: int, robot: RobotRecord, sheet: Sheet) -> str:
    """Return a robot's trajectory with a ring at its start."""
    track = as_track(robot.track_map)
    if len(track) == 0:
        return ""
    points = sheet.at(thinned(track, 0.4 / sheet.scale)[:, 1:3])
    way = " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
    x, y = points[0].tolist()
    ink = colour(index)
    return (
        f"<g><title>{escape(robot.id)}</title>"
        f'<polyline data-way="{index}" points="{way}" fill="none" stroke="{ink}" '
        'stroke-width="2.4" stroke-linejoin="round" stroke-linecap="round" stroke-opacity=".9" '
        f'stroke-dasharray="{robot_dash(index)}"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="var(--halo)" stroke="{ink}" '
        'stroke-width="2.4"/></g>'
    )


def _end(index: int, robot: RobotRecord, sheet: Sheet) -> str:
    """Return a disc and the robot's name where its trajectory ends."""
    track = as_track(robot.track_map)
    if len(track) == 0:
        return ""
    x, y = sheet.at(track[-1:, 1:3])[0].tolist()
    ink, name = colour(index), escape(robot.id)
    # A long name is turned to the left where it would leave the drawing.
    side, anchor = (-11, "end") if x + 20.0 + 8.0 * len(robot.id) > WIDTH else (11, "start")
    return (
        f'<g data-end="{index}" transform="translate({x:.1f} {y:.1f})">'
        f'<circle r="6" fill="{ink}" stroke="var(--halo)" stroke-width="1.6"/>'
        f'<text class="halo" x="{side}" y="4.5" font-size="13" font-weight="650" '
        f'text-anchor="{anchor}" style="fill:{ink}">{name}</text></g>'
    )


def _failures(bars: list[TaskBar], sheet: Sheet) -> str:
    """Return a cross at the goal of every task that failed."""
    marks = []
    for bar in bars:
        if bar.failed and bar.goal is not None:
            (x, y), r = sheet.at(np.array([bar.goal]))[0].tolist(), 4.0
            marks.append(
                f'<path d="M{x - r:.1f} {y - r:.1f}l{2 * r} {2 * r}m0 {-2 * r}l{-2 * r} {2 * r}" '
                'stroke="var(--bad)" stroke-width="2" fill="none"><title>'
                f"{escape(f'task {bar.task} of {bar.robot} {bar.outcome}: {bar.reason}')}"
                "</title></path>"
            )
    return "".join(marks)


def _remaining(record: RunRecord, sheet: Sheet) -> str:
    """Return a numbered diamond at every place that was left, numbers as in the table."""
    marks = []
    numbered = len(record.remaining) <= NUMBERS
    for number, left in enumerate(record.remaining[:MARKS], start=1):
        place = place_of(left)
        if place is None:
            continue
        x, y = sheet.at(np.array([place]))[0].tolist()
        label = (
            '<text class="halo" y="-9" font-size="11" font-weight="600" text-anchor="middle" '
            f'style="fill:var(--warn)">{number}</text>'
        )
        marks.append(
            f'<g transform="translate({x:.1f} {y:.1f})"><title>'
            f"{number}: {escape(str(left.get('reason', '')))}</title>"
            '<path d="M0-6.5 6.5 0 0 6.5-6.5 0Z" fill="var(--warn)" stroke="var(--halo)" '
            f'stroke-width="1.4"/>{label if numbered else ""}</g>'
        )
    return "".join(marks)


def _victims(record: RunRecord, sheet: Sheet) -> str:
    """Return a thick cross where a victim was found, a hollow one where one was missed."""
    marks = []
    for mark in victim_marks(record)[:MARKS]:
        x, y = sheet.at(np.array([(mark.x, mark.y)]))[0].tolist()
        marks.append(
            f'<g class="victim" transform="translate({x:.1f} {y:.1f})">'
            f"<title>{escape(mark.text)}</title>{victim_cross(mark.found)}</g>"
        )
    return "".join(marks)


def victim_cross(found: bool) -> str:
    """Return the mark of a victim around (0, 0), 14 pixels wide: filled when found, else hollow."""
    look = (
        'fill="var(--victim)" stroke="var(--halo)" stroke-width="1.2"'
        if found
        else 'fill="var(--halo)" stroke="var(--victim)" stroke-width="1.8"'
    )
    return f'<path d="M-2.4-7h4.8v4.6h4.6v4.8h-4.6v4.6h-4.8v-4.6h-4.6v-4.8h4.6Z" {look}/>'


def _scale_bar(sheet: Sheet) -> str:
    """Return a bar of a round length in the lower left corner."""
    metres = round_length(0.16 * WIDTH / sheet.scale)
    x0, x1, y = 20.0, 20.0 + metres * sheet.scale, sheet.height - 18.0
    return (
        f'<path d="M{x0} {y - 4:.1f}v8M{x0} {y:.1f}H{x1:.1f}M{x1:.1f} {y - 4:.1f}v8" '
        'stroke="var(--ink)" stroke-width="1.6" fill="none"/>'
        f'<text class="halo" x="{0.5 * (x0 + x1):.1f}" y="{y - 8:.1f}" font-size="12" '
        f'text-anchor="middle">{metres:g} m</text>'
    )
