from pathlib import Path

import numpy as np
import pytest

from expedition.experiments import auction_overlap
from expedition.experiments.auction_overlap import (
    Comparison,
    claims_of,
    compare,
    rectangles_of,
    row_of,
    run,
)
from expedition.experiments.experiment import ExperimentOptions
from mapping.grid import CLEAR, OBSTACLE, GridGeometry
from mapping.information_gain import gain_region


def corridor() -> tuple[np.ndarray, GridGeometry]:
    """Return a clear corridor with unknown space on both sides, walls at a few places."""
    classes = np.zeros((40, 60), dtype=np.uint8)
    classes[18:22, 10:50] = CLEAR
    classes[17, 15:25] = classes[22, 30:40] = OBSTACLE
    return classes, GridGeometry(0.15, 1.0, 2.0, 40, 60)


def test_rectangles_lie_around_boxes() -> None:
    geometry = GridGeometry(0.5, 10.0, 20.0, 8, 8)
    assert rectangles_of(np.array([[0, 1, 2, 4]]), geometry).tolist() == [[10.5, 20.0, 12.0, 21.0]]


def test_comparison_against_sets_of_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(auction_overlap, "REPEATS", 1)
    monkeypatch.setattr(auction_overlap, "SENSOR_RANGE", 1.2)
    classes, geometry = corridor()
    seen: list[tuple] = []
    original = auction_overlap._by_cells
    monkeypatch.setattr(
        auction_overlap, "_by_cells", lambda *args: seen.append(args) or original(*args)
    )
    found = compare(classes, geometry, np.random.default_rng(0))
    assert found is not None
    assert len(found.truth) == len(found.rectangles) > 5
    assert (found.truth >= 0.0).all() and (found.truth <= 1.0).all()
    assert np.abs(found.truth - found.rectangles).mean() < 0.3
    regions, assigned, others, _ = seen[0]
    taken = set().union(*(regions[i].tolist() for i in assigned))
    expected = [len(taken & set(regions[i].tolist())) / len(regions[i]) for i in others]
    np.testing.assert_allclose(original(*seen[0]), expected)
    np.testing.assert_allclose(auction_overlap._by_mask(*seen[0]), expected)


def test_too_little_to_bid_for() -> None:
    classes = np.full((20, 20), CLEAR, dtype=np.uint8)
    geometry = GridGeometry(0.15, 0.0, 0.0, 20, 20)
    assert compare(classes, geometry, np.random.default_rng(0)) is None
    assert len(gain_region(classes, (3, 3), 10.0)) == 0


def test_rows_and_claims() -> None:
    one = Comparison(np.array([0.5, 0.2]), np.array([0.6, 0.6]), 40.0, 4e-4, 1e-5, 1e-6)
    row = row_of("room", [one])
    assert (row["maps"], row["overlaps"], row["within_15"]) == (1, 2, 0.5)
    assert row["error_mean"] == pytest.approx(0.25)
    assert row["cheaper_than_cells"] == pytest.approx(400.0)
    assert [claim.holds for claim in claims_of(row)] == [False, True]
    empty = row_of("nowhere", [])
    assert empty["error_mean"] is None and empty["cheaper_than_mask"] is None
    assert claims_of(empty) == []
    assert list(empty) == list(row)


def test_the_whole_experiment_on_little(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(auction_overlap, "WORLDS", ("obstacle_free",))
    monkeypatch.setattr(auction_overlap, "VIEWS", (1,))
    monkeypatch.setattr(auction_overlap, "REPEATS", 1)
    monkeypatch.setattr(auction_overlap, "BEAMS", 60)
    monkeypatch.setattr(auction_overlap, "RESOLUTION", 0.4)
    result = run(ExperimentOptions(True, 1, 1, tmp_path / "out"))
    assert [row["world"] for row in result.rows] == ["obstacle_free", "all"]
    assert (tmp_path / "out" / "auction-overlap.png").stat().st_size > 1000
    assert result.name == "auction-overlap"
