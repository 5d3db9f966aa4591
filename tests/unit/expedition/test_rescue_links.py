"""The table of a team's maps over bad links."""

from __future__ import annotations

from typing import Any

from expedition.experiments.rescue_links import BAD, GOOD, RESTARTS, claims_of, link_job, row_of
from expedition.team import load_team

SUMMARY: dict[str, Any] = {
    "seed": 2,
    "ended": "explored",
    "sim_time_s": 300.0,
    "coverage": 0.99,
    "robots": [
        {"map_digest": "a", "trajectory_rmse_m": 0.02},
        {"map_digest": "a", "trajectory_rmse_m": 0.03},
    ],
    "bytes": {
        "beacon": {"count": 9, "bytes": 900},
        "observations": {"count": 3, "bytes": 600},
        "log_want": {"count": 1, "bytes": 60},
    },
    "aired": {"robot1": {"observations": {"count": 1, "bytes": 200}}},
}


def test_a_row() -> None:
    row = row_of(GOOD, SUMMARY)
    assert (row["maps"], row["rmse_max_m"]) == (1, 0.03)
    assert (row["bytes"], row["map_bytes"], row["air"], row["map_air"]) == (1560, 660, 200, 200)


def test_a_run_whose_robots_hold_different_maps_or_none() -> None:
    one, two = SUMMARY["robots"]
    different = row_of(BAD, SUMMARY | {"robots": [one, two | {"map_digest": "b"}]})
    nothing = row_of(BAD, SUMMARY | {"robots": [one, two | {"map_digest": None}]})
    assert (different["maps"], nothing["maps"]) == (2, None)
    assert [claims_of([row])[0].holds for row in (different, nothing)] == [False, False]


def test_claims() -> None:
    good = row_of(GOOD, SUMMARY)
    bad = good | {"links": BAD, "bytes": 1.5 * good["bytes"], "map_air": 3.0 * good["map_air"]}
    same, bytes_ = claims_of([good, bad])
    assert same.holds and bytes_.holds
    assert "bytes 1.50" in bytes_.figure and "map_air 3.00" in bytes_.figure
    worse = claims_of([good, bad | {"bytes": 1.7 * good["bytes"]}])
    assert [claim.holds for claim in worse] == [True, False]
    assert [claim.holds for claim in claims_of([])] == [False, False]


def test_its_missions_can_be_run() -> None:
    for links in (GOOD, BAD, RESTARTS):
        mission = link_job("office_rescue", links, 1).mission
        team = load_team(mission.team, mission.overrides)
        assert not team.server.enabled and team.mission.robots == 4
        assert bool(team.world.faults) == (links == RESTARTS)
        assert (team.world.radio.loss > 0.0) == (links == BAD)
