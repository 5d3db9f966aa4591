"""Settings of a robot's software."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from protocol.fields import NotNegative, Positive
from robot_agent.navigation_settings import NavigationSettings


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class LocalMapSettings(_Settings):
    """How a robot maps and what it reports.

    Every `report_every`-th scan goes to the server (Simmons et al. 2000: "a subset of its scans,
    e.g., every 10th"), unless the robot has not moved since the last one.
    """

    resolution_m: Annotated[float, Field(gt=0.005, le=1.0)] = 0.05
    report_every: Annotated[int, Field(ge=1)] = 10
    report_moved_m: NotNegative = 0.05
    report_turned_deg: NotNegative = 3.0
    resend_period_s: Positive = 1.0
    teammate_margin_m: NotNegative = 0.2


class ExplorerSettings(_Settings):
    """How a robot builds its bids.

    `spacing_m` is the least distance between frontier cells, `frontier_cells_min` the size below
    which a frontier is noise. `coarsening` is the factor by which the grid is made coarser for
    information gains. `weigh_by_probability` gives less weight to cells that are partly known
    (Simmons et al. 2000, the improvement they name). A bid is built on every map update, but at most
    every `bid_period_s`.
    """

    spacing_m: Positive = 0.3
    frontier_cells_min: Annotated[int, Field(ge=1)] = 4
    coarsening: Annotated[int, Field(ge=1, le=8)] = 4
    weigh_by_probability: bool = True
    bid_period_s: Positive = 1.0
    reach_m: NotNegative = 0.5
    places_max: Annotated[int, Field(ge=1, le=2000)] = 400


class TaskSettings(_Settings):
    """How a robot works on its tasks."""

    arrive_explore_m: Positive = 0.4
    arrive_visit_m: Positive = 0.15
    progress_period_s: Positive = 1.0
    drive_timeout_s: Positive = 1.0


class RobotSettings(_Settings):
    """Everything that can be set of a robot's software.

    `look_around`: turn once on the spot before anything else, so that the first reports show all
    that is around the start and tie the robot to the team's map.
    """

    estimator: str = "scan_matching"
    mapping: LocalMapSettings = LocalMapSettings()
    explorer: ExplorerSettings = ExplorerSettings()
    navigation: NavigationSettings = NavigationSettings()
    task: TaskSettings = TaskSettings()
    look_around: bool = True
    heartbeat_period_s: Positive = 0.3
    hello_period_s: Positive = 1.0
