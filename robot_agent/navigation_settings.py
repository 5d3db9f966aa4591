"""What a user may set about how a robot keeps its map and drives."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from protocol.fields import NotNegative, Positive


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PlanningMapSettings(_Settings):
    """How the robot reads the team's map.

    `p_obstacle` and `p_clear` are the thresholds of Simmons et al. 2000 on the probability that a
    cell is occupied. `resolution_m` only matters until the first map arrives. Where the map leaves
    the body up to `squeeze_m` too little room, routes lead there for want of a better way; where it
    did not get through in spite of the map, it must show `tight_m` more room from then on.
    """

    p_obstacle: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.65
    p_clear: Annotated[float, Field(gt=0.0, lt=0.5)] = 0.4
    clearance_limit_m: Positive = 0.7
    comfort_m: Positive = 0.6
    squeeze_m: NotNegative = 0.025
    tight_m: NotNegative = 0.1
    resolution_m: Positive = 0.05
    largest_cells: Annotated[int, Field(ge=1)] = 50_000_000


class DrivingSettings(_Settings):
    """How a robot follows its path.

    The distances named `gap` are between the robot's rim and what it might touch.
    """

    lookahead_m: Positive = 0.5
    lookahead_tight_m: Positive = 0.32
    turn_on_spot_deg: Annotated[float, Field(gt=10.0, le=180.0)] = 80.0
    aligned_deg: Annotated[float, Field(gt=1.0, le=90.0)] = 25.0
    gap_least_m: NotNegative = 0.015
    gap_full_speed_m: Positive = 0.07
    speed_tight_m_s: Positive = 0.18
    braking_m_s2: Positive = 0.7
    watch_ahead_m: Positive = 0.6
    replan_period_s: Positive = 2.0
    off_path_m: Positive = 0.35
    unreachable_after_s: NotNegative = 1.5


class RecoverySettings(_Settings):
    """What a robot does that is stuck."""

    stalled_after_s: Positive = 4.0
    stalled_within_m: Positive = 0.12
    no_progress_after_s: Positive = 20.0
    back_up_m: Positive = 0.2
    back_up_speed_m_s: Positive = 0.12
    block_radius_m: Positive = 0.25
    block_for_s: Positive = 20.0
    most_recoveries: Annotated[int, Field(ge=0)] = 5


class RightOfWaySettings(_Settings):
    """How robots keep out of each other's way. Gaps are between rims."""

    gap_m: Positive = 0.12
    gap_least_m: Positive = 0.06
    gap_waiting_m: Positive = 0.22
    horizon_m: Positive = 8.0
    time_apart_s: Positive = 3.0
    detour_m: NotNegative = 6.0
    assess_period_s: Positive = 0.4
    jammed_after_s: Positive = 6.0
    forget_after_s: Positive = 4.0
    silent_after_s: Positive = 6.0
    blocked_for_s: Positive = 30.0


class NavigationSettings(_Settings):
    """All of a robot's driving."""

    planning_map: PlanningMapSettings = PlanningMapSettings()
    driving: DrivingSettings = DrivingSettings()
    recovery: RecoverySettings = RecoverySettings()
    right_of_way: RightOfWaySettings = RightOfWaySettings()
