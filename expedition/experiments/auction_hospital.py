"""Simmons et al. 2000, Figure 6: three robots map a hospital floor in eight minutes."""

from __future__ import annotations

from expedition.experiments.experiment import (
    Claim,
    ExperimentOptions,
    ExperimentResult,
    Row,
    run_all,
)
from expedition.experiments.missions import Mission, run_mission, worst_rmse
from expedition.experiments.plots import new_figure, plot_points, save_figure

SEEDS = 3
EIGHT_MINUTES = 480.0  # [s], "a 62 by 43 meter map in about eight minutes"


def run(options: ExperimentOptions) -> ExperimentResult:
    """Three robots in the shipped hospital-like floor: time, coverage, accuracy (Figure 6)."""
    seeds = options.seeds or (1 if options.quick else SEEDS)
    limit = 120.0 if options.quick else 1800.0
    jobs = [
        Mission(
            "auction",
            {"mission": {"world": "hospital", "robots": 3, "seed": seed, "max_time_s": limit}},
            str(options.out / f"seed_{seed}"),
        )
        for seed in range(1, seeds + 1)
    ]
    rows = [_row(summary) for summary in run_all(run_mission, jobs, options.workers)]
    figure, axes = new_figure("Hospital floor, three robots", "explored [%]", "time [s]")
    plot_points(
        axes,
        {
            f"seed {row['seed']}": [
                (float(share), row[f"t{share}_s"])
                for share in (50, 90, 95, 99)
                if row[f"t{share}_s"] is not None
            ]
            for row in rows
        },
    )
    save_figure(figure, options.out / "hospital.png")
    fast = [row["t95_s"] for row in rows if row["t95_s"] is not None]
    claims = [
        Claim(
            "95 % of the floor within eight minutes",
            len(fast) == len(rows) and max(fast) <= EIGHT_MINUTES,
            ", ".join("never" if row["t95_s"] is None else f"{row['t95_s']:.0f} s" for row in rows),
        )
    ]
    return ExperimentResult("auction-hospital", rows, claims)


def _row(summary: dict[str, object]) -> Row:
    """Return the table's row for one mission."""
    robots = summary["robots"]
    maps = summary["map"]
    assert isinstance(robots, list)
    assert isinstance(maps, dict)
    keys = ("seed", "ended", "coverage", "t50_s", "t90_s", "t95_s", "t99_s", "sim_time_s")
    row: Row = {key: summary[key] for key in keys}
    row["path_m"] = sum(robot["path_m"] for robot in robots)
    row["rmse_max_m"] = worst_rmse(summary)
    row["precision_occupied"] = maps["precision_occupied"]
    row["real_time_factor"] = summary["real_time_factor"]
    return row
