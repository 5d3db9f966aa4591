"""Pfingsthorn et al. 2007, Figure 3: the map of one robot beside that of a team of three.

"Interestingly, the quality is very similar. There are no visible artifacts from map merging, such
as slightly misaligned walls." Misaligned walls are walls drawn twice; how many there are tells
`double_walls`.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from expedition.experiments.double_walls import WallThickness, wall_thickness
from expedition.experiments.experiment import (
    Claim,
    ExperimentOptions,
    ExperimentResult,
    Row,
    run_all,
)
from expedition.experiments.missions import Mission, run_mission, worst_rmse
from expedition.experiments.plots import new_panels, save_figure
from expedition.experiments.rescue_bandwidth import ROBOTS_OF_TEAM, rescue_mission
from expedition.results.map_image import map_png
from expedition.results.record import RunRecord, load_record
from expedition.results.summary import reachable_of
from expedition.results.team_frame import transform_to_world
from mapping.grid import classify

NAME = "rescue-maps"
# A team's map is as good as one robot's if its walls are no thicker than by this share [of cuts].
DOUBLED_MOST, DOUBLED_MORE = 0.02, 0.01
PRECISION_LESS = 0.01


@dataclass(frozen=True)
class RescueMap:
    """One run's map.

    Attributes:
        row: of the table.
        picture: PNG.
    """

    row: Row
    picture: bytes


def run(options: ExperimentOptions) -> ExperimentResult:
    """One robot's map beside a team's: are walls drawn twice where maps meet? (Figure 3)."""
    limit = 120.0 if options.quick else 1800.0
    seeds = options.seeds or 1
    jobs = [
        rescue_mission(robots, seed, limit, options.out / f"robots_{robots}_seed_{seed}")
        for seed in range(1, seeds + 1)
        for robots in (1, ROBOTS_OF_TEAM)
    ]
    maps = run_all(_mapped, jobs, options.workers)
    plot_maps(maps, options.out / f"{NAME}.png")
    rows = [found.row for found in maps]
    return ExperimentResult(NAME, rows, claims_of(rows))


def _mapped(mission: Mission) -> RescueMap:
    """Run a mission; return its map."""
    summary = run_mission(mission)
    assert mission.out is not None
    record = load_record(Path(mission.out) / "parts")
    return RescueMap(row_of(summary, walls_of(record)), map_png(record))


def walls_of(record: RunRecord) -> WallThickness | None:
    """Return how thick the walls of a run's map are; None where map or truth is missing."""
    T_world_map = transform_to_world(record)
    if record.truth is None or record.grid is None or T_world_map is None:
        return None
    return wall_thickness(
        record.truth.solid,
        reachable_of(record, record.truth),
        record.truth.geometry,
        classify(record.grid.log_odds, record.p_obstacle, record.p_clear),
        record.grid.geometry,
        T_world_map,
    )


def row_of(summary: dict[str, Any], walls: WallThickness | None) -> Row:
    """Return a row of the table: how right a run's map is, and how many of its walls are double."""
    return {
        "robots": len(summary["robots"]),
        "seed": summary["seed"],
        "ended": summary["ended"],
        "sim_time_s": summary["sim_time_s"],
        "coverage": summary["coverage"],
        "rmse_max_m": worst_rmse(summary),
        "precision_occupied": summary["map"]["precision_occupied"],
        "recall_occupied": summary["map"]["recall_occupied"],
        "cuts": walls.cuts if walls else None,
        "doubled": walls.doubled if walls else None,
        "excess_m": walls.excess_m if walls else None,
        "excess_p95_m": walls.excess_p95_m if walls else None,
    }


def claims_of(rows: list[Row]) -> list[Claim]:
    """Return what the table says of the paper's observations; none without maps."""
    one = [row for row in rows if row["robots"] == 1]
    team = [row for row in rows if row["robots"] > 1]
    both = bool(one) and bool(team)
    alone, together = _worst(one, "doubled"), _worst(team, "doubled")
    doubled = alone is not None and together is not None
    least_alone, least = _least(one, "precision_occupied"), _least(team, "precision_occupied")
    precise = least_alone is not None and least is not None
    return [
        Claim(
            f"no more than {DOUBLED_MOST:.0%} of the walls of a team's map are drawn twice, and "
            f"at most {DOUBLED_MORE:.0%} more than of one robot's",
            bool(
                both and doubled and together <= DOUBLED_MOST and together <= alone + DOUBLED_MORE
            ),
            f"{_share(together)} of the team's, {_share(alone)} of one robot's",
        ),
        Claim(
            "a team's occupied cells are as right as one robot's, to within "
            f"{PRECISION_LESS:.0%} of them",
            bool(both and precise and least >= least_alone - PRECISION_LESS),
            f"{_share(least)} against {_share(least_alone)}",
        ),
    ]


def _worst(rows: list[Row], name: str) -> Any:
    """Return the greatest value of a column, or None if one is not known or there are no rows."""
    values = [row[name] for row in rows]
    return None if not values or None in values else max(values)


def _least(rows: list[Row], name: str) -> Any:
    """Return the least value of a column, or None if one is not known or there are no rows."""
    values = [row[name] for row in rows]
    return None if not values or None in values else min(values)


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.1f} %"


def plot_maps(maps: list[RescueMap], path: Path) -> None:
    """Draw the maps side by side, two in a row."""
    figure, panels = new_panels(max(1, (len(maps) + 1) // 2), 2, 14.0)
    for place in range(2 * len(panels)):
        axes = panels[place // 2][place % 2]
        axes.set_axis_off()
        if place < len(maps):
            row = maps[place].row
            robots = "one robot" if row["robots"] == 1 else f"{row['robots']} robots"
            axes.set_title(f"{robots}, {_share(row['doubled'])} of walls double")
            axes.imshow(_pixels(maps[place].picture))
    save_figure(figure, path)


def _pixels(png: bytes) -> npt.NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
