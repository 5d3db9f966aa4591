"""The table of bytes, its claims and its picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from expedition.experiments.map_updates import map_updates
from expedition.experiments.rescue_bandwidth import (
    BandwidthSet,
    aired_bytes,
    claims_of,
    other_meanings,
    plot_sets,
    row_of,
)
from expedition.experiments.update_sizes import update_sizes
from tests.unit.expedition.observations import SEEN, observation, repositioning

SUMMARY = {"robots": [{}, {}], "seed": 4, "ended": "explored", "coverage": 0.9}
AIRED = {
    "ada": {
        "observations": {"count": 2, "bytes": 300},
        "pose_set": {"count": 1, "bytes": 40},
        "beacon": {"count": 9, "bytes": 900},
        "bid": {"count": 1, "bytes": 7},
    },
    "bob": {"log_have": {"count": 3, "bytes": 5}, "log_want": {"count": 1, "bytes": 6}},
    "server": {},
}


def test_a_row_tells_sizes_and_wire():
    sizes = update_sizes(map_updates(SEEN, [repositioning(2.5, "ada", [12.0, 13.0])]))
    row = row_of(SUMMARY, sizes, AIRED)
    assert (row["robots"], row["observations"], row["discarded"]) == (2, 4, 0)
    assert row["pose_graph"] == 4 * (3 + 3) * 4 + 2 * 12
    assert row["best_grid"] == int(
        np.minimum(sizes.sizes["cell_list"], sizes.sizes["bounding_box"]).sum()
    )
    assert row["improvement"] == pytest.approx(row["best_grid"] / row["pose_graph"])
    assert (row["wire"], row["beacons"]) == (351, 900)
    assert aired_bytes({}, ("beacon",)) == 0


def test_other_meanings_of_a_change_make_grids_cheaper():
    # Every step to the side shows some new cells, and more that were seen before.
    seen = [observation(float(k), "ada", k, 10.0 + 0.1 * k) for k in range(5)]
    updates = map_updates(seen, [])
    totals = update_sizes(updates).totals
    others = other_meanings(updates)
    assert list(others) == ["improvement_share", "improvement_known"]
    assert max(others.values()) < 0.8 * totals["best_grid"] / totals["pose_graph"]
    assert other_meanings([]) == dict.fromkeys(others)


def rows(*figures: tuple[int, int, int]) -> list[dict[str, int]]:
    return [{"best_grid": b, "pose_graph": p, "wire": w} for b, p, w in figures]


def test_claims():
    assert [c.holds for c in claims_of(rows((370, 100, 12), (1560, 100, 10)))] == [True, True]
    assert [c.holds for c in claims_of(rows((370, 100, 12), (360, 100, 13)))] == [False, False]
    lonely = claims_of(rows((400, 100, 0), (400, 100, 10)))
    assert [c.holds for c in lonely] == [True, True]
    assert lonely[1].figure == "-, 10.0"
    assert [c.holds for c in claims_of(rows((0, 0, 0)))] == [False, False]
    assert [c.holds for c in claims_of([])] == [False, False]


def test_the_picture(tmp_path: Path):
    sizes = update_sizes(map_updates(SEEN, [repositioning(2.5, "ada", [12.0, 13.0])]))
    row = row_of(SUMMARY, sizes, AIRED)
    plot_sets(
        [BandwidthSet(row, sizes), BandwidthSet(row | {"robots": 1}, sizes)], tmp_path / "a.png"
    )
    assert (tmp_path / "a.png").stat().st_size > 10_000
