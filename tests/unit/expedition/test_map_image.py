import io

import numpy as np
import pytest
from PIL import Image

from expedition.results import map_image
from expedition.results.map_image import (
    known_area,
    layer_png,
    map_classes,
    map_png,
    outline,
    pgm_bytes,
    picture_of,
    round_length,
)
from expedition.results.record import RobotRecord, RunRecord
from mapping.grid import CLEAR, OBSTACLE, GridGeometry, OccupancyGrid
from tests.unit.expedition.records import full_record, nasty_records


def opened(png: bytes) -> Image.Image:
    return Image.open(io.BytesIO(png))


def small() -> RunRecord:
    log_odds = np.zeros((3, 4), dtype=np.float32)
    log_odds[0, 0], log_odds[2, 3] = -2.0, 2.0
    return RunRecord(grid=OccupancyGrid(GridGeometry(0.5, 10.0, 20.0, 3, 4), log_odds))


def test_pgm_has_its_first_row_on_top() -> None:
    content = pgm_bytes(map_classes(small()))
    assert content == b"P5\n4 3\n255\n" + bytes(
        [205, 205, 205, 0, 205, 205, 205, 205, 254, 205, 205, 205]
    )
    assert pgm_bytes(None) == b"P5\n1 1\n255\n\xcd"


def test_the_picture_shows_known_cells_with_a_margin() -> None:
    picture = picture_of(small())
    assert picture.geometry.shape == (7, 8)
    assert (picture.geometry.origin_x, picture.geometry.origin_y) == (9.0, 19.0)
    assert picture.classes[2, 2] == CLEAR
    assert picture.classes[4, 5] == OBSTACLE
    assert int((picture.classes > 0).sum()) == 2
    assert (picture.width, picture.height) == (4.0, 3.5)


def test_the_picture_reaches_as_far_as_robots_went() -> None:
    record = small()
    record.robots = [RobotRecord("a", track_map=np.array([[0.0, 15.0, 20.0, 0.0]]))]
    geometry = picture_of(record).geometry
    assert geometry.origin_x + geometry.cols * geometry.resolution > 15.5
    record.robots[0].track_map[0, 1] = 1.0e5
    assert picture_of(record).geometry == record.grid.geometry  # type: ignore[union-attr]


def test_a_track_beside_the_map() -> None:
    record = small()
    assert record.grid is not None
    record.grid.log_odds[:] = 0.0
    record.robots = [RobotRecord("a", track_map=np.array([[0.0, 15.0, 30.0, 0.0]]))]
    assert not picture_of(record).classes.any()


@pytest.mark.parametrize("name", nasty_records())
def test_every_map_can_be_drawn(name: str) -> None:
    record = nasty_records()[name]
    assert opened(map_png(record)).size > (0, 0)


def test_map_png_shows_cells_and_robots() -> None:
    image = opened(map_png(full_record())).convert("RGB")
    colours = {colour for _, colour in image.getcolors(1_000_000) or []}
    assert {(255, 255, 255), (20, 20, 20), (214, 214, 214)} <= colours
    assert any(b > 150 and r < 60 for r, _, b in colours)  # the first robot's blue
    assert map_png(full_record()) == map_png(full_record())


def test_a_huge_map_is_scaled_down(monkeypatch: pytest.MonkeyPatch) -> None:
    record = RunRecord(grid=OccupancyGrid.unknown(GridGeometry(0.05, 0.0, 0.0, 3300, 40)))
    assert opened(map_png(record)).size == (20, 1650)


def test_names_stay_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    record = full_record()
    record.robots[0].id = "a very long name for a robot"
    plain = map_image.picture_of(record)
    assert opened(map_png(record)).size[0] >= plain.geometry.cols


def test_layers_are_transparent_where_nothing_is_known() -> None:
    classes = np.array([[0, 1], [2, 0]], dtype=np.uint8)
    image = opened(layer_png(classes, "#ffffff", "#102030")).convert("RGBA")
    assert image.getpixel((0, 0)) == (16, 32, 48, 255)
    assert image.getpixel((1, 1)) == (255, 255, 255, 255)
    assert image.getpixel((1, 0))[3] == 0  # type: ignore[index]
    assert opened(layer_png(np.zeros((0, 0), dtype=np.uint8), "#ffffff", "#000000")).size == (1, 1)


def test_outline_leaves_out_the_inside() -> None:
    solid = np.zeros((7, 7), dtype=bool)
    solid[1:6, 1:6] = True
    lines = outline(solid)
    assert int((lines == OBSTACLE).sum()) == 16
    assert not lines[2:5, 2:5].any()


@pytest.mark.parametrize(
    ("most", "length"), [(0.0, 1.0), (1.0, 1.0), (9.9, 5.0), (10, 10), (4.99, 2), (0.3, 0.2)]
)
def test_round_length(most: float, length: float) -> None:
    assert round_length(most) == pytest.approx(length)


def test_known_area() -> None:
    record = small()
    assert record.grid is not None
    assert known_area(map_classes(record), record.grid.geometry) == 0.25
    assert known_area(None, None) == 0.0
