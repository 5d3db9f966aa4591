"""What bad links and restarts do to a team that shares its map: the same map, and how many bytes.

Four robots without a master (Pfingsthorn et al. 2007, section 2: every robot's map is equivalent to
the global map), each seed once over the team's radio as it is, and once with frames lost, doubled
and overtaken; and once with a robot whose software starts anew without its log, and one with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from expedition.experiments.experiment import (
    Claim,
    ExperimentOptions,
    ExperimentResult,
    Row,
    run_all,
)
from expedition.experiments.missions import Mission, run_mission, worst_rmse
from expedition.experiments.rescue_bandwidth import BEACON, MAP_TYPES, aired_bytes

NAME = "rescue-links"
TEAM, WORLD, QUICK_WORLD, ROBOTS, SEEDS = "rescue", "office_rescue", "office_single_corridor", 4, 5
GOOD, BAD, RESTARTS = "as it is", "loss 30 %, doubled 10 %, overtaken 20 %", "restart and reboot"
BAD_RADIO = {"loss": 0.3, "duplication": 0.1, "reordering": 0.2}
FAULTS = [
    {"at_s": 60.0, "robot": "robot2", "kind": "restart"},
    {"at_s": 90.0, "robot": "robot4", "kind": "reboot"},
]
BYTES_MOST = 1.6  # times those of the same team where nothing is lost


@dataclass(frozen=True)
class LinkJob:
    """A mission, and what its links are like."""

    links: str
    mission: Mission


def run(options: ExperimentOptions) -> ExperimentResult:
    """All robots' maps over links that lose, double and disorder frames, and over restarts."""
    seeds = range(1, (options.seeds or (1 if options.quick else SEEDS)) + 1)
    world = QUICK_WORLD if options.quick else WORLD
    jobs = [link_job(world, links, seed) for seed in seeds for links in (GOOD, BAD)]
    jobs.append(link_job(world, RESTARTS, 1))
    rows = run_all(_measured, jobs, options.workers)
    return ExperimentResult(NAME, rows, claims_of(rows))


def link_job(world: str, links: str, seed: int) -> LinkJob:
    """Return a mission of the team in a world, over links of a kind."""
    settings: dict[str, Any] = {
        "mission": {"world": world, "robots": ROBOTS, "seed": seed, "max_time_s": 1800.0},
        "server": {"enabled": False},
    }
    if links == BAD:
        settings["world"] = {"radio": BAD_RADIO}
    elif links == RESTARTS:
        settings["world"] = {"faults": FAULTS}
    return LinkJob(links, Mission(TEAM, settings))


def _measured(job: LinkJob) -> Row:
    return row_of(job.links, run_mission(job.mission))


def row_of(links: str, summary: Mapping[str, Any]) -> Row:
    """Return a row of the table.

    Returns:
        `maps`: how many different maps the robots hold at the end; `bytes`: of all messages, on
        each link they were sent over, and `map_bytes` of those that tell of the map; `air` and
        `map_air`: the same, a word to everybody counted once.
    """
    by_type, aired = summary["bytes"], summary["aired"]
    digests = {robot["map_digest"] for robot in summary["robots"]}
    return {
        "links": links,
        "seed": summary["seed"],
        "ended": summary["ended"],
        "sim_time_s": summary["sim_time_s"],
        "coverage": summary["coverage"],
        "rmse_max_m": worst_rmse(summary),
        "maps": len(digests) if digests and None not in digests else None,
        "bytes": sum(kind["bytes"] for kind in by_type.values()),
        "map_bytes": sum(by_type[kind]["bytes"] for kind in MAP_TYPES if kind in by_type),
        "air": aired_bytes(aired, (*MAP_TYPES, BEACON)),
        "map_air": aired_bytes(aired, MAP_TYPES),
    }


def claims_of(rows: list[Row]) -> list[Claim]:
    """Return what the table says of the paper's claim and of ours."""
    good = {row["seed"]: row for row in rows if row["links"] == GOOD}
    bad = {row["seed"]: row for row in rows if row["links"] == BAD}
    pairs = [(good[seed], bad[seed]) for seed in sorted(good.keys() & bad.keys())]
    ratios = {
        name: [other[name] / base[name] for base, other in pairs if base[name]]
        for name in ("bytes", "map_bytes", "air", "map_air")
    }
    most = max(ratios["bytes"], default=None)
    return [
        Claim(
            "all missions end explored, and all robots with the same map",
            bool(rows) and all(row["ended"] == "explored" and row["maps"] == 1 for row in rows),
            ", ".join(f"{row['ended']} {row['maps']}" for row in rows),
        ),
        Claim(
            f"over the bad links the team sends at most {BYTES_MOST:g} times the bytes",
            most is not None and most <= BYTES_MOST,
            "; ".join(f"{name} {_listed(values)}" for name, values in ratios.items()),
        ),
    ]


def _listed(ratios: list[float]) -> str:
    return ", ".join(f"{ratio:.2f}" for ratio in ratios) or "-"
