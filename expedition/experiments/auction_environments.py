"""Simmons et al. 2000, Figures 7 to 10: five environments, one to three robots, ten runs each."""

from __future__ import annotations

from typing import Any

from expedition.experiments.experiment import (
    Claim,
    ExperimentOptions,
    ExperimentResult,
    Row,
    run_all,
)
from expedition.experiments.missions import Mission, run_mission
from expedition.experiments.plots import new_figure, plot_spreads, save_figure
from expedition.experiments.tables import spread

ENVIRONMENTS = {
    "A": "office_single_corridor",
    "B": "office_parallel_corridors",
    "C": "obstacle_free",
    "D": "random_15",
    "E": "random_30",
}
TEAM_SIZES = (1, 2, 3)
SEEDS = 10
SHARES = (50, 90, 95, 100)

# "The resultant map was qualitatively wrong" in figures: a team's map that misses a tenth of the
# floor, has more than a tenth of its walls out of place, or a trajectory off by half a metre.
LEAST_COVERAGE = 0.9
LEAST_PRECISION = 0.9
MOST_RMSE = 0.5


def failed(summary: dict[str, Any]) -> bool:
    """Whether a mission's map is qualitatively wrong or unfinished."""
    errors = [robot["trajectory_rmse_m"] for robot in summary["robots"]]
    return bool(
        summary["ended"] != "explored"
        or (summary["coverage"] or 0.0) < LEAST_COVERAGE
        or (summary["map"]["precision_occupied"] or 0.0) < LEAST_PRECISION
        or any(error is None or error > MOST_RMSE for error in errors)
    )


def run(options: ExperimentOptions) -> ExperimentResult:
    """Time to map 50, 90, 95 and 100 % of five environments, and failures (Figures 7-10)."""
    environments = ("C",) if options.quick else tuple(ENVIRONMENTS)
    seeds = options.seeds or (1 if options.quick else SEEDS)
    settings = [(e, n) for e in environments for n in TEAM_SIZES]
    jobs = [_mission(e, n, seed) for e, n in settings for seed in range(1, seeds + 1)]
    summaries = run_all(run_mission, jobs, options.workers)
    rows = []
    for k, (environment, robots) in enumerate(settings):
        rows.append(_row(environment, robots, summaries[k * seeds : (k + 1) * seeds]))
    for environment in environments:
        _plot(environment, rows, options)
    return ExperimentResult("auction-environments", rows, _claims(rows))


def _mission(environment: str, robots: int, seed: int) -> Mission:
    mission = {
        "world": ENVIRONMENTS[environment],
        "robots": robots,
        "seed": seed,
        "max_time_s": 1800.0,
    }
    return Mission("auction", {"mission": mission})


def _row(environment: str, robots: int, summaries: list[dict[str, Any]]) -> Row:
    """Return the table's row for all runs of one setting."""
    row: Row = {
        "environment": environment,
        "world": ENVIRONMENTS[environment],
        "robots": robots,
        "runs": len(summaries),
        "failed": sum(failed(summary) for summary in summaries),
    }
    for share in SHARES:
        figures = spread([summary[f"t{share}_s"] for summary in summaries])
        row |= {f"t{share}_{name}_s": figures[name] for name in ("min", "median", "max")}
    return row


def _plot(environment: str, rows: list[Row], options: ExperimentOptions) -> None:
    """Draw one environment in the manner of Figures 8 to 10."""
    figure, axes = new_figure(
        f"Environment {environment}: {ENVIRONMENTS[environment]}", "explored [%]", "time [s]"
    )
    lines = {}
    for row in rows:
        if row["environment"] == environment:
            name = f"{row['robots']} robot{'s' if row['robots'] > 1 else ''}"
            lines[name] = [
                (
                    float(share),
                    {m: row[f"t{share}_{m}_s"] for m in ("min", "median", "max")},
                )
                for share in SHARES
            ]
    plot_spreads(axes, lines)
    axes.legend()
    save_figure(figure, options.out / f"environment_{environment}.png")


def _claims(rows: list[Row]) -> list[Claim]:
    """Return what the table says about the paper's observations."""
    by = {(row["environment"], row["robots"]): row for row in rows}
    claims = []
    paper = {1: "30 %", 2: "10 %", 3: "0 %"}
    for robots in TEAM_SIZES:
        row = by.get(("C", robots))
        if row is not None:
            claims.append(
                Claim(
                    f"no failed map in the obstacle-free environment with {robots} robots "
                    f"(the paper: {paper[robots]} failed)",
                    row["failed"] == 0,
                    f"{row['failed']} of {row['runs']} failed",
                )
            )
    for environment in ENVIRONMENTS:
        one, two = by.get((environment, 1)), by.get((environment, 2))
        if one and two and one["t90_median_s"] and two["t90_median_s"]:
            claims.append(
                Claim(
                    f"two robots map 90 % of environment {environment} faster than one",
                    two["t90_median_s"] < one["t90_median_s"],
                    f"{two['t90_median_s']:.0f} s against {one['t90_median_s']:.0f} s",
                )
            )
    return claims
