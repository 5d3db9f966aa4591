"""The drawing of a world: what a world file may hold, and the solids it stands for.

A drawing is read top down: an outer wall around `size_m`, rooms and walls inside it, doors cut out
of them, then furniture. All coordinates are metres from the lower left corner, x right, y up.
"""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapping.geometry import Floats, rotation
from sim_world.errors import WorldError
from sim_world.victims import Victim

Number = Annotated[float, Field(allow_inf_nan=False)]
Length = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Point = tuple[Number, Number]
Rectangle = tuple[Number, Number, Number, Number]
Segment = tuple[Number, Number, Number, Number]

# A door belongs to every wall whose middle line passes this near to it [m].
_DOOR_REACH = 0.05
# Corners of the polygon that stands for a round pillar.
_ROUND = 16


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class RandomObstacles(_Part):
    """Obstacles drawn from the run's seed.

    Attributes:
        density: share of the region's floor that obstacles cover.
        size_m: least and greatest edge (or diameter).
        shape: what they are.
        region: x1, y1, x2, y2 [m]; the whole world when not given.
        passage_m: between obstacles, all floor that was connected for a disc of this diameter
            stays so.
        clear_around_starts_m: no obstacle comes nearer to a start.
    """

    density: Annotated[float, Field(gt=0.0, le=0.6)]
    size_m: tuple[Length, Length] = (0.5, 1.5)
    shape: Literal["box", "turned_box", "disc"] = "box"
    region: Rectangle | None = None
    passage_m: Length = 0.8
    clear_around_starts_m: Length = 1.0


class FloorPlan(_Part):
    """A world file.

    Attributes:
        name: as in `expedition run --world NAME`.
        description: one line for `expedition list`.
        size_m: width and height; a wall runs around it.
        wall_thickness_m: of every wall; 0 makes walls without thickness.
        rooms: x1, y1, x2, y2 [m] of rectangles whose four sides are walls; neighbours share walls.
        walls: x1, y1, x2, y2 [m] of single walls.
        polylines: lists of points [m], joined by walls.
        doors: x, y, width [m]; each opens every wall it lies on.
        boxes: x1, y1, x2, y2 [m] of solid rectangles.
        turned_boxes: x, y of the centre, length, width [m], turned by degrees.
        pillars: x, y, radius [m].
        obstacles: random ones.
        starts: x, y [m], heading [deg]; where robots start, first to last.
        victims: id, x, y [m] of people who lie there; they are not solid.
    """

    name: str
    description: str
    size_m: tuple[Length, Length]
    wall_thickness_m: Annotated[float, Field(ge=0.0, le=2.0)] = 0.15
    rooms: tuple[Rectangle, ...] = ()
    walls: tuple[Segment, ...] = ()
    polylines: tuple[tuple[Point, ...], ...] = ()
    doors: tuple[tuple[Number, Number, Length], ...] = ()
    boxes: tuple[Rectangle, ...] = ()
    turned_boxes: tuple[tuple[Number, Number, Length, Length, Number], ...] = ()
    pillars: tuple[tuple[Number, Number, Length], ...] = ()
    obstacles: tuple[RandomObstacles, ...] = ()
    starts: tuple[tuple[Number, Number, Number], ...] = ()
    victims: tuple[Victim, ...] = ()


def solids_of(plan: FloorPlan) -> tuple[list[Floats], Floats]:
    """Return the convex solids [(K, 2) m] of a drawing and its walls without thickness (B, 4).

    Random obstacles are not among them.

    Raises:
        WorldError: a door lies on no wall.
    """
    pieces = _with_doors(plan, merged(_middle_lines(plan)))
    thickness = plan.wall_thickness_m
    solids = [_rectangle(*_ordered(box)) for box in plan.boxes]
    solids += [turned_box(*box) for box in plan.turned_boxes]
    solids += [disc(*pillar) for pillar in plan.pillars]
    if thickness == 0.0:
        return solids, np.array(pieces, dtype=np.float64).reshape(-1, 4)
    return [_thick(piece, thickness) for piece in pieces] + solids, np.empty((0, 4))


def _middle_lines(plan: FloorPlan) -> list[Segment]:
    """Return the middle lines of all walls, before doors."""
    lines = _sides((0.0, 0.0, *plan.size_m))
    for room in plan.rooms:
        lines += _sides(_ordered(room))
    lines += plan.walls
    for points in plan.polylines:
        lines += [(*a, *b) for a, b in itertools.pairwise(points)]
    return lines


def _ordered(box: Rectangle) -> Rectangle:
    """Return the rectangle with its lower left corner first."""
    x1, y1, x2, y2 = box
    return min(x1, x2), min(y1, y2), max(x1, x2), max(y1, y2)


def _sides(box: Rectangle) -> list[Segment]:
    """Return the four sides of a rectangle."""
    x1, y1, x2, y2 = box
    return [(x1, y1, x2, y1), (x2, y1, x2, y2), (x1, y2, x2, y2), (x1, y1, x1, y2)]


def merged(lines: list[Segment]) -> list[Segment]:
    """Return the segments with those joined that overlap along one horizontal or vertical line."""
    spans: dict[tuple[str, float], list[tuple[float, float]]] = {}
    result = []
    for x1, y1, x2, y2 in lines:
        if y1 == y2 and x1 != x2:
            spans.setdefault(("y", round(y1, 6)), []).append((min(x1, x2), max(x1, x2)))
        elif x1 == x2 and y1 != y2:
            spans.setdefault(("x", round(x1, 6)), []).append((min(y1, y2), max(y1, y2)))
        else:
            result.append((x1, y1, x2, y2))
    for (axis, at), intervals in spans.items():
        for low, high in _joined(intervals):
            result.append((low, at, high, at) if axis == "y" else (at, low, at, high))
    return result


def _joined(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the union of intervals, in order."""
    union: list[tuple[float, float]] = []
    for low, high in sorted(intervals):
        if union and low <= union[-1][1] + 1e-9:
            union[-1] = (union[-1][0], max(union[-1][1], high))
        else:
            union.append((low, high))
    return union


def _with_doors(plan: FloorPlan, lines: list[Segment]) -> list[Segment]:
    """Return the walls with all doors cut out."""
    for k, (x, y, width) in enumerate(plan.doors):
        # Walls end in square caps of half their thickness, which must not narrow the door.
        half = 0.5 * (width + plan.wall_thickness_m)
        pieces = [_without(line, x, y, half) for line in lines]
        if all(piece == [line] for piece, line in zip(pieces, lines, strict=True)):
            raise WorldError(
                f"doors[{k}] at ({x:g}, {y:g}) lies on no wall; move it onto the middle of a wall"
            )
        lines = [line for piece in pieces for line in piece]
    return lines


def _without(line: Segment, x: float, y: float, half: float) -> list[Segment]:
    """Return what is left of a wall after a door of half width `half` at (x, y)."""
    x1, y1, x2, y2 = line
    length = math.hypot(x2 - x1, y2 - y1)
    if length == 0.0:
        return [line]
    along_x, along_y = (x2 - x1) / length, (y2 - y1) / length
    at = (x - x1) * along_x + (y - y1) * along_y
    off = abs((x - x1) * along_y - (y - y1) * along_x)
    if off > _DOOR_REACH or at < 0.0 or at > length:
        return [line]
    left: list[Segment] = []
    if at - half > 0.0:
        left.append((x1, y1, x1 + (at - half) * along_x, y1 + (at - half) * along_y))
    if at + half < length:
        left.append((x1 + (at + half) * along_x, y1 + (at + half) * along_y, x2, y2))
    return left


def _thick(line: Segment, thickness: float) -> Floats:
    """Return the rectangle (4, 2) of a wall, half its thickness longer at both ends."""
    x1, y1, x2, y2 = line
    length = math.hypot(x2 - x1, y2 - y1)
    degrees = math.degrees(math.atan2(y2 - y1, x2 - x1))
    return turned_box(0.5 * (x1 + x2), 0.5 * (y1 + y2), length + thickness, thickness, degrees)


def _rectangle(x1: float, y1: float, x2: float, y2: float) -> Floats:
    return np.array([[x1, y1], [x2, y1], [x2, y2], [x1, y2]])


def turned_box(x: float, y: float, length: float, width: float, degrees: float) -> Floats:
    """Return the corners (4, 2) [m] of a rectangle around (x, y), turned counter-clockwise."""
    if degrees % 90.0 == 0.0:
        # Exactly upright, without the rounding of sines.
        if degrees % 180.0 != 0.0:
            length, width = width, length
        return _rectangle(x - 0.5 * length, y - 0.5 * width, x + 0.5 * length, y + 0.5 * width)
    corners = _rectangle(-0.5 * length, -0.5 * width, 0.5 * length, 0.5 * width)
    turned: Floats = corners @ rotation(math.radians(degrees)).T + np.array([x, y])
    return turned


def disc(x: float, y: float, radius: float) -> Floats:
    """Return the corners (16, 2) [m] of the polygon that stands for a disc."""
    angles = 2.0 * math.pi * np.arange(_ROUND) / _ROUND
    return np.column_stack((x + radius * np.cos(angles), y + radius * np.sin(angles)))
