"""Maps side by side, and what their table says."""

from __future__ import annotations

from pathlib import Path

import pytest

from expedition.experiments.double_walls import WallThickness
from expedition.experiments.rescue_maps import RescueMap, claims_of, plot_maps, row_of, walls_of
from expedition.results.map_image import map_png
from expedition.results.record import RunRecord
from expedition.results.summary import summarise
from tests.unit.expedition.records import full_record


def test_a_row_of_a_run():
    record = full_record()
    walls = walls_of(record)
    assert walls is not None
    row = row_of(summarise(record), walls)
    assert (row["robots"], row["seed"], row["ended"]) == (2, 3, "explored")
    assert row["doubled"] == walls.doubled
    assert row["rmse_max_m"] == pytest.approx(0.0, abs=1e-6)


def test_a_run_without_a_map():
    assert walls_of(RunRecord()) is None
    row = row_of(summarise(RunRecord()), None)
    assert row["doubled"] is None and row["rmse_max_m"] is None
    assert [c.holds for c in claims_of([row | {"robots": 1}, row | {"robots": 3}])] == [False] * 2


def rows(*figures: tuple[int, float, float]) -> list[dict[str, float]]:
    return [{"robots": r, "doubled": d, "precision_occupied": p} for r, d, p in figures]


def test_claims():
    assert [c.holds for c in claims_of(rows((1, 0.01, 0.99), (3, 0.02, 0.985)))] == [True, True]
    assert [c.holds for c in claims_of(rows((1, 0.0, 0.99), (3, 0.02, 0.97)))] == [False, False]
    assert [c.holds for c in claims_of(rows((1, 0.2, 0.9), (3, 0.2, 0.9)))] == [False, True]
    assert [c.holds for c in claims_of(rows((3, 0.0, 1.0)))] == [False, False]


def test_the_picture(tmp_path: Path):
    record = full_record()
    row = row_of(summarise(record), WallThickness(10, 0.1, 0.01, 0.02))
    maps = [RescueMap(row | {"robots": k}, map_png(record)) for k in (1, 3, 3)]
    plot_maps(maps, tmp_path / "maps.png")
    assert (tmp_path / "maps.png").stat().st_size > 10_000
