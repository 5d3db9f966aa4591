import json

import numpy as np
import pytest

from expedition.results.record import place_of
from expedition.results.report_map import SAMPLES, WIDTH, map_svg, motion, sheet_of
from expedition.results.task_bars import task_bars
from tests.unit.expedition.records import full_record, nasty_records


def test_the_map_frame_lies_upright_on_the_sheet() -> None:
    sheet = sheet_of(full_record())
    g = sheet.picture.geometry
    top = g.origin_y + g.rows * g.resolution
    right = g.origin_x + g.cols * g.resolution
    corners = sheet.at(np.array([[g.origin_x, top], [right, g.origin_y]]))
    assert corners[0].tolist() == pytest.approx([sheet.left, 0.0])
    assert corners[1].tolist() == pytest.approx([WIDTH - sheet.left, sheet.height])


def test_motion_ends_where_the_track_ends() -> None:
    record = full_record()
    sheet = sheet_of(record)
    data = json.loads(motion(record, sheet, 8.0))
    way = data["ways"]["0"]
    assert len(way) == SAMPLES + 1
    ada = record.robots_in_order()[0]
    end = 10.0 * sheet.at(ada.track_map[-1:, 1:3])[0]
    assert way[-1] == pytest.approx(end.tolist(), abs=1.0)


def test_marks_of_failed_tasks_and_of_what_was_left() -> None:
    record = full_record()
    svg = map_svg(record, sheet_of(record), task_bars(record.tasks, 8.0))
    assert svg.count("task 1 of ada failed") == 1
    assert svg.count("too narrow") == 1
    assert svg.count("data-way") == svg.count("data-end") == 2
    assert 'class="truth"' in svg
    no_truth = nasty_records()["no truth"]
    assert 'class="truth"' not in map_svg(no_truth, sheet_of(no_truth), [])


def test_places() -> None:
    assert place_of({"x_m": 1, "y_m": 2.5}) == (1.0, 2.5)
    assert place_of({"x_m": 1}) is None
    assert place_of({"x_m": float("nan"), "y_m": 0.0}) is None


def test_a_name_at_the_right_edge_is_turned() -> None:
    record = full_record()
    record.robots[1].id = "a-robot-with-a-long-name-at-the-edge-of-it-all-and-then-some"
    record.robots[1].track_map[-1, 1] = 30.0
    assert 'text-anchor="end"' in map_svg(record, sheet_of(record), [])
