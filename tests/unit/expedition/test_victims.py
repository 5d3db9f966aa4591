from __future__ import annotations

import io
import re

import numpy as np
import pytest
from PIL import Image

from expedition.results.map_image import map_png, picture_of
from expedition.results.record import RunRecord, load_record, save_record
from expedition.results.report import report_html
from expedition.results.summary import summarise
from expedition.results.victims import MATCH_WITHIN, victim_marks, victim_section
from tests.unit.expedition.records import T_WORLD_MAP, full_record, nasty_records

LYING = {"v1": (3.0, 2.0), "v2": (1.0, 2.5), "v3": (3.2, 0.5)}


def told(x_world: float, y_world: float, t: float = 12.0) -> dict[str, object]:
    """A victim as a team tells it that saw somebody at a place of the world."""
    x, y = T_WORLD_MAP.inverse().apply([x_world, y_world]).tolist()
    return {"x_m": x, "y_m": y, "seen_by": "ada", "t_s": t, "sightings": 4}


def searched(*victims: dict[str, object]) -> RunRecord:
    """A run in which three people lie in the room."""
    record = full_record()
    assert record.truth is not None
    record.truth.victims = {id: np.array(place) for id, place in LYING.items()}
    record.victims = list(victims)
    return record


def test_where_nobody_searched_nothing_is_told() -> None:
    assert victim_section(full_record()) == {}
    assert "victims" not in summarise(full_record())
    assert victim_marks(full_record()) == []
    assert "victim missed" not in report_html(full_record(), summarise(full_record()))


def test_found_and_missed_victims_in_the_summary() -> None:
    summary = summarise(searched(told(3.1, 2.0), told(1.0, 2.2)))
    first, second = summary["victims"]
    assert (first["id"], first["seen_by"], first["t_s"], first["sightings"]) == (
        "v1",
        "ada",
        12.0,
        4,
    )
    assert first["error_m"] == pytest.approx(0.1, abs=0.02)
    assert (second["id"], second["error_m"]) == ("v2", pytest.approx(0.3, abs=0.02))
    assert summary["victims_missed"] == [{"id": "v3", "x_m": 3.2, "y_m": 0.5}]
    assert summary["problems"] == []


def test_one_who_lies_there_is_found_once() -> None:
    """The second report of the same person is nobody's; so is one far from everybody."""
    away = told(1.0 + MATCH_WITHIN + 0.1, 20.0)
    record = searched(told(3.0, 2.0), told(3.0, 2.1), away)
    assert record.truth is not None
    del record.truth.victims["v2"], record.truth.victims["v3"]
    section = victim_section(record)
    assert [victim["id"] for victim in section["victims"]] == ["v1", None, None]
    assert section["victims"][1]["error_m"] is None
    assert section["victims_missed"] == []


def test_as_many_as_possible_are_matched() -> None:
    record = searched(told(1.0, 1.0), told(2.5, 1.0))
    assert record.truth is not None
    record.truth.victims = {"a": np.array([2.4, 1.0]), "b": np.array([4.3, 1.0])}
    assert [victim["id"] for victim in victim_section(record)["victims"]] == ["a", "b"]


def test_without_a_truth_nobody_knows_who_was_missed() -> None:
    record = nasty_records()["no truth"]
    record.victims = [told(3.0, 2.0), {"reason": "says not where"}]
    summary = summarise(record)
    assert len(summary["victims"]) == 1
    assert summary["victims"][0]["error_m"] is None
    assert summary["victims_missed"] is None
    assert "no truth to compare with" in report_html(record, summary)


def test_without_tracks_reports_cannot_be_laid_onto_the_world() -> None:
    record = searched(told(3.0, 2.0))
    for robot in record.robots:
        robot.track_world = None
    assert victim_section(record)["victims_missed"] is None
    record.victims = []
    assert len(victim_section(record)["victims_missed"]) == 3
    assert victim_marks(record) == []


def test_the_record_keeps_victims(tmp_path) -> None:
    save_record(tmp_path, searched(told(3.0, 2.0)))
    loaded = load_record(tmp_path)
    assert loaded.victims == [told(3.0, 2.0)]
    assert loaded.truth is not None
    assert {id: tuple(place) for id, place in loaded.truth.victims.items()} == LYING


def test_marks_lie_in_the_map_frame() -> None:
    marks = victim_marks(searched(told(3.0, 2.0)))
    assert [mark.found for mark in marks] == [False, False, True]
    places_world = T_WORLD_MAP.apply([(mark.x, mark.y) for mark in marks])
    assert np.allclose(places_world, [LYING["v2"], LYING["v3"], LYING["v1"]], atol=0.02)
    assert marks[0].text == "victim v2 missed"


def test_the_report_marks_found_and_missed() -> None:
    record = searched(told(3.0, 2.0), told(1.0, 2.4))
    page = report_html(record, summarise(record))
    assert len(re.findall('class="victim"', page)) == 3
    assert "victim found</span>" in page
    assert "victim missed</span>" in page
    assert "<strong>2 of 3</strong><em>1 missed</em>" in page
    record.victims.append(told(3.2, 0.5) | {"seen_by": "<b>"})
    record.victims.append(told(30.0, 0.5))
    page = report_html(record, summarise(record))
    assert "victim missed</span>" not in page
    assert "<strong>3 of 3</strong><em>everybody, 1 where nobody lies</em>" in page
    assert "<b> at" not in page


def test_the_picture_marks_found_and_missed() -> None:
    plain = np.asarray(Image.open(io.BytesIO(map_png(searched())))).astype(int)
    found = searched(*(told(x, y) for x, y in LYING.values()))
    marked = np.asarray(Image.open(io.BytesIO(map_png(found)))).astype(int)
    red = [
        int((np.abs(picture - (209, 18, 43)).sum(axis=2) < 12).sum()) for picture in (plain, marked)
    ]
    assert red[1] > 1.2 * red[0] > 0


def test_the_picture_reaches_to_those_who_were_missed() -> None:
    record = searched()
    assert record.truth is not None
    record.truth.victims["far"] = np.array([15.0, 2.0])
    assert picture_of(record).width > picture_of(searched()).width + 8.0
