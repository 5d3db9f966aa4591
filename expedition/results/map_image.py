"""The final map as images: for map_server, for people, and as layers of the report."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from expedition.results.colours import (
    FREE_GREY,
    OCCUPIED_GREY,
    UNKNOWN_GREY,
    VICTIM,
    rgb,
    robot_colour,
)
from expedition.results.record import RunRecord
from expedition.results.tracks import as_track, thinned
from expedition.results.victims import VictimMark, victim_marks
from mapping.cell_box import CellBox
from mapping.geometry import Floats
from mapping.grid import CLEAR, OBSTACLE, GridGeometry, classify, geometry_around

MARGIN = 0.6  # [m] of unknown shown around everything that is known
LONGEST_SIDE = 1600  # [pixels] wanted of map.png: sharp on a screen, small as a file
MOST_CELLS = 6000  # a picture's side; a stray pose must not ask for gigabytes
SHARPNESS = 2  # lines are drawn this many times larger, then scaled down: smooth edges

Classes = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Picture:
    """The part of a map worth showing.

    Attributes:
        geometry: where the cells are, map frame.
        classes: (rows, cols) uint8 UNKNOWN, CLEAR or OBSTACLE, as in `mapping.grid`.
    """

    geometry: GridGeometry
    classes: Classes

    @property
    def width(self) -> float:
        """Extent along x [m]."""
        return self.geometry.cols * self.geometry.resolution

    @property
    def height(self) -> float:
        """Extent along y [m]."""
        return self.geometry.rows * self.geometry.resolution


def map_classes(record: RunRecord) -> Classes | None:
    """Return the classes of the final map's cells, or None where there is no map."""
    grid = record.grid
    if grid is None or grid.log_odds.size == 0:
        return None
    return classify(grid.log_odds, record.p_obstacle, record.p_clear)


def picture_of(record: RunRecord) -> Picture:
    """Return what to show of a run: known cells, estimated trajectories, victims."""
    classes = map_classes(record)
    tracks = np.vstack(
        [as_track(r.track_map)[:, 1:3] for r in record.robots]
        + [np.array([(mark.x, mark.y) for mark in victim_marks(record)]).reshape(-1, 2)]
    )
    if classes is None or record.grid is None:
        return _without_map(tracks)
    geometry = record.grid.geometry
    box = _shown_box(geometry, classes, tracks)
    shown = np.zeros((box.iy1 - box.iy0, box.ix1 - box.ix0), dtype=np.uint8)
    inside = CellBox(
        max(box.iy0, 0), max(box.ix0, 0), min(box.iy1, geometry.rows), min(box.ix1, geometry.cols)
    )
    if not inside.empty:
        shown[inside.shifted(-box.iy0, -box.ix0).slices] = classes[inside.slices]
    return Picture(geometry.cropped(box), shown)


def _shown_box(geometry: GridGeometry, classes: Classes, tracks: Floats) -> CellBox:
    """Return the box around known cells and trajectories with a margin; may leave the grid."""
    known = np.argwhere(classes)
    cells = np.vstack((known, geometry.cells_at(tracks)))
    if len(cells) == 0:
        return geometry.box
    margin = math.ceil(MARGIN / geometry.resolution)
    low, high = cells.min(axis=0) - margin, cells.max(axis=0) + 1 + margin
    if (high - low).max() > MOST_CELLS:
        return geometry.box
    return CellBox(int(low[0]), int(low[1]), int(high[0]), int(high[1]))


def _without_map(tracks: Floats) -> Picture:
    """Return an empty picture around the trajectories, or around the origin without any."""
    points = tracks if len(tracks) else np.zeros((1, 2))
    low, high = points.min(axis=0) - 2.0, points.max(axis=0) + 2.0
    side = max(float((high - low).max()), 1.0)
    (x0, y0), (x1, y1) = low.tolist(), high.tolist()
    geometry = geometry_around(x0, y0, x1, y1, max(0.05, side / MOST_CELLS))
    return Picture(geometry, np.zeros(geometry.shape, dtype=np.uint8))


def greys(classes: Classes) -> Classes:
    """Return map_server's grey levels, top row first as images have it."""
    table = np.array([UNKNOWN_GREY, FREE_GREY, OCCUPIED_GREY], dtype=np.uint8)
    flipped: Classes = table[classes][::-1]
    return flipped


def pgm_bytes(classes: Classes | None) -> bytes:
    """Return the map as a binary PGM; without a map, one unknown cell."""
    image = np.full((1, 1), UNKNOWN_GREY, np.uint8) if classes is None else greys(classes)
    rows, cols = image.shape
    return f"P5\n{cols} {rows}\n255\n".encode() + np.ascontiguousarray(image).tobytes()


def layer_png(classes: Classes, free: str, occupied: str) -> bytes:
    """Return a PNG of free and occupied cells in two colours, unknown cells transparent."""
    indices = np.ascontiguousarray(classes[::-1])
    image = Image.fromarray(indices, mode="P") if indices.size else Image.new("P", (1, 1))
    image.putpalette([0, 0, 0, *rgb(free), *rgb(occupied)])
    buffer = io.BytesIO()
    image.save(buffer, "PNG", transparency=0)
    return buffer.getvalue()


def outline(solid: npt.NDArray[np.bool_]) -> Classes:
    """Return solid cells that touch a cell which is not, as OBSTACLE, all others UNKNOWN."""
    inner = solid.copy()
    inner[1:] &= solid[:-1]
    inner[:-1] &= solid[1:]
    inner[:, 1:] &= solid[:, :-1]
    inner[:, :-1] &= solid[:, 1:]
    return np.where(solid & ~inner, OBSTACLE, 0).astype(np.uint8)


def map_png(record: RunRecord) -> bytes:
    """Return the map for people: cells, trajectories with start and end, names, scale bar."""
    picture = picture_of(record)
    rows, cols = picture.geometry.shape
    scale = max(1, round(LONGEST_SIDE / max(rows, cols, 1))) if max(rows, cols) < 3200 else 0.5
    size = (max(1, round(cols * scale)), max(1, round(rows * scale)))
    base = Image.fromarray(_shades(picture.classes)).convert("RGB")
    base = base.resize(size, Image.Resampling.NEAREST if scale >= 1 else Image.Resampling.BOX)
    pixels_per_metre = scale / picture.geometry.resolution
    drawing = _Drawing(picture, size, pixels_per_metre)
    for index, robot in enumerate(record.robots_in_order()):
        drawing.track(as_track(robot.track_map), rgb(robot_colour(index)), robot.id)
    drawing.victims(victim_marks(record))
    drawing.scale_bar()
    base = Image.alpha_composite(base.convert("RGBA"), drawing.smooth()).convert("RGB")
    buffer = io.BytesIO()
    base.save(buffer, "PNG")
    return buffer.getvalue()


def _shades(classes: Classes) -> Classes:
    """Return grey levels for people, top row first: unknown a soft grey that ink stands out on."""
    table = np.array([214, 255, 20], dtype=np.uint8)
    flipped: Classes = table[classes][::-1]
    return np.ascontiguousarray(flipped)


class _Drawing:
    """A transparent sheet over a map picture, drawn larger and scaled down at the end."""

    def __init__(self, picture: Picture, size: tuple[int, int], pixels_per_metre: float) -> None:
        self.size = size
        self.geometry = picture.geometry
        self.top = picture.geometry.origin_y + picture.height
        self.zoom = pixels_per_metre * SHARPNESS
        self.sheet = Image.new("RGBA", (size[0] * SHARPNESS, size[1] * SHARPNESS), (0, 0, 0, 0))
        self.draw = ImageDraw.Draw(self.sheet)
        self.line = max(2.0, min(size) / 330.0) * SHARPNESS
        self.font = ImageFont.load_default(size=max(11.0, min(size) / 55.0) * SHARPNESS)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the map frame lies on the sheet [pixels]."""
        return (x - self.geometry.origin_x) * self.zoom, (self.top - y) * self.zoom

    def track(self, track: Floats, colour: tuple[int, int, int], name: str) -> None:
        """Draw one trajectory: a ring where it starts, a disc and the name where it ends."""
        if len(track) == 0:
            return
        points = [self.at(x, y) for x, y in thinned(track, 0.02)[:, 1:3].tolist()]
        if len(points) > 1:
            self.draw.line(points, fill=(*colour, 225), width=round(self.line), joint="curve")
        r = 2.6 * self.line
        x, y = points[0]
        self.draw.ellipse((x - r, y - r, x + r, y + r), "white", colour, round(0.9 * self.line))
        x, y = points[-1]
        self.draw.ellipse((x - r, y - r, x + r, y + r), colour, "white", round(0.5 * self.line))
        wide = self.draw.textlength(name, font=self.font)
        if x + 1.5 * r + wide + 4.0 > self.sheet.width:
            self.text((x - 1.5 * r, y), name, "rm", colour)
        else:
            self.text((x + 1.5 * r, y), name, "lm", colour)

    def text(
        self, at: tuple[float, float], text: str, anchor: str, fill: tuple[int, int, int]
    ) -> None:
        """Write a word with a light rim, kept within the picture."""
        left, top, right, bottom = self.draw.textbbox(at, text, font=self.font, anchor=anchor)
        width, height = self.sheet.size
        x = at[0] + max(0.0, 4.0 - left) - max(0.0, right + 4.0 - width)
        y = at[1] + max(0.0, 4.0 - top) - max(0.0, bottom + 4.0 - height)
        rim = max(1, round(0.7 * self.line))
        self.draw.text(
            (x, y), text, fill, self.font, anchor, stroke_width=rim, stroke_fill=(255, 255, 255)
        )

    def victims(self, marks: list[VictimMark]) -> None:
        """Draw a thick cross where a victim was found, a hollow one where one was missed."""
        for mark in marks:
            self._cross(self.at(mark.x, mark.y), mark.found)
        y = self.sheet.height - 6.0 * self.line
        right = self.sheet.width - 4.0 * self.line
        for found, word in ((False, "victim missed"), (True, "victim found")):
            if any(mark.found == found for mark in marks):
                self.text((right, y), word, "rm", (40, 44, 52))
                right -= self.draw.textlength(word, font=self.font) + 6.5 * self.line
                self._cross((right, y), found)
                right -= 9.0 * self.line

    def _cross(self, at: tuple[float, float], found: bool) -> None:
        """Draw the mark of a victim: an upright cross with arms as wide as a third of it."""
        x, y = at
        ink, paper = rgb(VICTIM[0]), (255, 255, 255)
        rim = 0.7 * self.line
        for grow, fill in ((rim, paper if found else ink), (0.0, ink if found else paper)):
            long, wide = 3.6 * self.line + grow, 1.2 * self.line + grow
            self.draw.rectangle((x - long, y - wide, x + long, y + wide), fill)
            self.draw.rectangle((x - wide, y - long, x + wide, y + long), fill)

    def scale_bar(self) -> None:
        """Draw a bar of a round length in the lower left corner."""
        width, height = self.sheet.size
        length = round_length(0.2 * width / self.zoom)
        x0, y0 = 6.0 * self.line, height - 6.0 * self.line
        x1 = x0 + length * self.zoom
        ink = (40, 44, 52)
        self.draw.line([(x0, y0), (x1, y0)], fill=ink, width=round(self.line))
        for x in (x0, x1):
            tick = 1.6 * self.line
            self.draw.line([(x, y0 - tick), (x, y0 + tick)], fill=ink, width=round(self.line))
        self.text((0.5 * (x0 + x1), y0 - 1.8 * self.line), f"{length:g} m", "mb", ink)

    def smooth(self) -> Image.Image:
        """Return the sheet at the picture's own size."""
        return self.sheet.resize(self.size, Image.Resampling.BOX)


def round_length(most: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20, ... (any power of ten) that is at most `most`."""
    if not most > 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(most))
    return next((power * step for step in (5.0, 2.0) if power * step <= most), power)


def known_area(classes: Classes | None, geometry: GridGeometry | None) -> float:
    """Return the area [m2] that the map shows as free."""
    if classes is None or geometry is None:
        return 0.0
    return float((classes == CLEAR).sum()) * geometry.resolution**2
