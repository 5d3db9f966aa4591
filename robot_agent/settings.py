"""Settings of a robot's software."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from protocol.fields import NotNegative, Positive
from robot_agent.decentral.settings import PeerSettings
from robot_agent.navigation_settings import NavigationSettings


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class LocalMapSettings(_Settings):
    """How a robot maps and what it reports.

    Every `report_every`-th scan goes to the server (Simmons et al. 2000: "a subset of its scans,
    e.g., every 10th"), unless the robot has not moved since the last one. A scan that shows more
    than `news_m2` of what the team's map does not have goes at once, but `news_every` scans after
    the last report at the soonest.
    """

    resolution_m: Annotated[float, Field(gt=0.005, le=1.0)] = 0.05
    report_every: Annotated[int, Field(ge=1)] = 10
    news_m2: Positive = 0.3
    news_every: Annotated[int, Field(ge=1)] = 2
    report_moved_m: NotNegative = 0.05
    report_turned_deg: NotNegative = 3.0
    resend_period_s: Positive = 1.0
    teammate_margin_m: NotNegative = 0.2


class ExplorerSettings(_Settings):
    """How a robot builds its bids.

    Attributes:
        spacing_m: least distance between the frontier cells of one frontier.
        frontier_cells_min: a frontier of fewer cells is noise.
        gain_range_m: the flood that counts what is to be gained at a frontier (Simmons et al. 2000)
            goes this far, or to the sensor's range if that is less: between walls a laser rarely
            sees as far as it could.
        sight_factor: a flood counts no more than so many times what rays from there find, each cell
            by the chance to be seen: floods leak through every hole. 0 counts it in full.
        free_path_m: the way through the unknown over which the chance that a ray gets on falls to
            1/e.
        weigh_by_probability: whether cells that are partly known weigh less (the improvement that
            Simmons et al. 2000 name).
        coarsening: information is counted on blocks of so many cells along an edge.
        bid_period_s: a bid is built on every map update, but no more often than this.
        reach_m: a place may lie this much farther from the frontier than the body's radius.
        look_ahead: whether bids tell what going somewhere first costs the rest of the route; only
            the auction's utility `net` asks for that (`strategy.loss_weight`).
        route_gain_m2: frontiers with less to gain do not count when the robot looks ahead.
        route_places_max: the richest frontiers count, up to so many.
        route_worth: how much must be gained for each metre that a route gets longer [m2 per m].
        route_apart_m: a frontier counts in full when the nearest teammate's way there is longer by
            half of this, and not at all when it is shorter by half of this.
        route_beyond: what is expected to be driven beyond a frontier, there and back, as a multiple
            of the square root of the area there.
        places_max: the richest places are told, up to so many.
    """

    spacing_m: Positive = 0.5
    frontier_cells_min: Annotated[int, Field(ge=1)] = 6
    gain_range_m: Positive = 4.0
    sight_factor: NotNegative = 1.7
    free_path_m: Positive = 1.5
    weigh_by_probability: bool = True
    coarsening: Annotated[int, Field(ge=1, le=8)] = 4
    bid_period_s: Positive = 1.0
    reach_m: NotNegative = 0.5
    look_ahead: bool = False
    route_gain_m2: NotNegative = 1.0
    route_places_max: Annotated[int, Field(ge=1, le=200)] = 40
    route_worth: NotNegative = 1.0
    route_apart_m: Positive = 8.0
    route_beyond: NotNegative = 1.0
    places_max: Annotated[int, Field(ge=1, le=2000)] = 150


class TaskSettings(_Settings):
    """How a robot works on its tasks.

    At a frontier the robot turns until it faces what is left of it within `look_radius_m`; when no
    frontier of `look_cells_min` cells is left there, on arrival or before, the task is done.
    """

    arrive_explore_m: Positive = 0.4
    arrive_visit_m: Positive = 0.15
    look_radius_m: Positive = 1.0
    look_cells_min: Annotated[int, Field(ge=1)] = 6
    progress_period_s: Positive = 1.0
    drive_timeout_s: Positive = 1.0


class RobotSettings(_Settings):
    """Everything that can be set of a robot's software.

    `decides`: who says what a robot does next: a `server`, or it decides for `itself`, as `peer`
    says, see `robot_agent.decentral`.
    `look_around`: turn once on the spot before anything else, so that the first reports show all
    that is around the start and tie the robot to the team's map.
    """

    estimator: str = "scan_matching"
    decides: Literal["server", "itself"] = "server"
    peer: PeerSettings = PeerSettings()
    mapping: LocalMapSettings = LocalMapSettings()
    explorer: ExplorerSettings = ExplorerSettings()
    navigation: NavigationSettings = NavigationSettings()
    task: TaskSettings = TaskSettings()
    look_around: bool = True
    heartbeat_period_s: Positive = 0.3
    hello_period_s: Positive = 1.0
