"""Settings of the server."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from mapping.loop_settings import LoopSettings
from protocol.fields import NotNegative, Positive
from protocol.map_cells import LARGEST_CELLS
from server.executive_settings import ExecutiveSettings


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class MergerSettings(_Settings):
    """How scans of all robots become one map.

    A report counts as contradicting the map when at least `known_least` of its end points fall
    where the map is known and a smaller share than `fit_least` of them lies at walls.

    A robot is tied to the team's map when all its reports so far, together, match it with at least
    `align_points` end points at walls, a share of `align_fit`, and an uncertainty of no more than
    `align_sigma_m` and `align_sigma_deg`; or after `hold_most` reports if only the last fails. For
    so many reports as `sight_wait` it only looks around: who sees whom is clear when all have.

    A report that would make the map larger than `largest_cells` is refused: a robot whose pose is
    nonsense must not cost the team its server.
    """

    resolution_m: Annotated[float, Field(gt=0.005, le=1.0)] = 0.05
    known_least: int = 12
    fit_least: float = 0.5
    align_points: int = 30
    align_fit: float = 0.6
    align_sigma_m: Positive = 0.1
    align_sigma_deg: Positive = 1.5
    hold_most: Annotated[int, Field(ge=1)] = 12
    sight_wait: Annotated[int, Field(ge=0)] = 3
    drift_m: NotNegative = 0.03
    drift_deg: NotNegative = 0.5
    search_sigma_m: Positive = 0.1
    wide_scale: Positive = 9.0
    loops: LoopSettings = LoopSettings()
    largest_cells: Annotated[int, Field(ge=1_000, le=LARGEST_CELLS)] = 25_000_000


class MapSettings(_Settings):
    """Which cells count as what, and how often the map is published.

    p_obstacle and p_clear are the thresholds p_o and p_c of Simmons et al. 2000. A cell that one
    scan saw free, and no other, counts as clear: robots must not have to look at everything twice.

    Before a mission ends, robots are sent up to `last_looks` times to look at seams of the map that
    may be off by more than `loose_m` (one sigma), for at most `look_s` each, see `last_looks` and
    `seams`.
    """

    p_obstacle: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.65
    p_clear: Annotated[float, Field(gt=0.0, lt=0.5)] = 0.4
    delta_period_s: Positive = 0.3
    poses_period_s: Positive = 0.5
    teammate_margin_m: NotNegative = 0.25
    last_looks: Annotated[int, Field(ge=0)] = 3
    loose_m: Positive = 0.1
    look_s: Positive = 60.0


class ServerSettings(_Settings):
    """Everything that can be set of the server.

    `enabled`: a team whose robots decide for themselves needs none; where there is one, it hears
    what the robots tell each other, and draws the same map; while it hears one, it says every
    `presence_period_s` that it is there.
    `cost_weights` multiply the path costs of single robots in the auction.
    """

    enabled: bool = True
    merger: MergerSettings = MergerSettings()
    map: MapSettings = MapSettings()
    executive: ExecutiveSettings = ExecutiveSettings()
    silence_s: Positive = 5.0
    abandon_s: Positive = 60.0
    farewell_s: NotNegative = 1.0
    presence_period_s: Positive = 2.0
    cost_weights: dict[str, Annotated[float, Field(gt=0.0)]] = {}
