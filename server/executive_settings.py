"""Settings of the task executive."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

_NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class ExecutiveSettings(BaseModel):
    """Settings of the task executive.

    Attributes:
        bid_wait_s: how long to wait after a new bid in case others arrive.
        lease_s: a task without progress for so long is taken back.
        silence_s: a robot not heard for so long is lost, and its task with it.
        progress_step_m: by how much a way must shrink to count as progress.
        resend_s: an award without an echo is sent again after this, then after ever longer.
        resend_longest_s: the longest time between two sendings.
        probe_s: an award is also sent again when a robot at work was not heard of it for so long;
            robots tell their progress more often than that.
        drive_s: a robot driven by hand halts when no new word comes for so long.
        keep_radius_m: a choice so near to the goal a robot already has is the same place.
        beside_m: a robot sent elsewhere not farther than this from where it was going must get on
            as if it had one task.
        give_up_radius_m: places so near to one that failed are that place.
        max_tries: so many tries in vain, by whichever robots, and a place is given up.
        settle_s: how long a place rests after a visit, for the map to catch up; and how long
            nothing must be left to do before the mission counts as explored.
        bid_patience_s: a robot whose bids lag behind the map for longer is not waited for.
        expiries_max: after so many tasks in a row expired at one robot without a sign of progress
            it gets no more, until `bench_s` have passed: its software may hang while its radio
            still answers.
        bench_s: how long such a robot is left out.
        wait_after_s: a robot must have been idle for so long before it is sent to wait.
        wait_period_s: idle robots are given waiting places at most this often.
        wait_move_m: only when that would move them by more than this.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    bid_wait_s: _NotNegative = 0.3
    lease_s: _Positive = 20.0
    silence_s: _Positive = 5.0
    progress_step_m: _Positive = 0.1
    resend_s: _Positive = 1.0
    resend_longest_s: _Positive = 8.0
    probe_s: _Positive = 3.0
    drive_s: _Positive = 1.0
    keep_radius_m: _NotNegative = 0.5
    beside_m: _NotNegative = 2.0
    give_up_radius_m: _Positive = 0.5
    max_tries: Annotated[int, Field(ge=1)] = 2
    settle_s: _Positive = 4.0
    bid_patience_s: _Positive = 20.0
    expiries_max: Annotated[int, Field(ge=1)] = 3
    bench_s: _Positive = 60.0
    wait_after_s: _NotNegative = 2.0
    wait_period_s: _Positive = 5.0
    wait_move_m: _NotNegative = 1.5
