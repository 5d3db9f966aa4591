"""Settings of a robot that needs no server."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from protocol.fields import NotNegative, Positive
from protocol.log.settings import LogSyncSettings


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class DecisionSettings(_Settings):
    """How a robot decides for itself where to go.

    A robot counts as here while it was heard in the last `here_s`; one that was not heard for
    `lost_s` is not waited for any more. A place that it visited in vain, or found no way to, rests
    for `rest_s`; one where it got stuck it tries again when nothing else is left. After `max_tries`
    in vain it gives a place up, visits of teammates included; places within `tried_radius_m` are
    one. A robot that finds nothing for `quiet_s` drives home, where the others find it again; it
    tries that `max_tries` times.

    A place within `claim_apart_m` of where a teammate is heading is left to that teammate if it
    comes there first, and so is one that somebody else is nearer to, and from where a share of
    `claim_overlap` of what is to be seen is seen from the teammate's goal, too; ways that differ by
    less than `claim_tie_m` are equally long, and the smaller name comes first. A robot for which
    nothing else is left waits out of the way, looks again every `wait_period_s`, and moves then if
    that takes it on by more than `wait_move_m`. A task without progress for `patience_s` has
    failed.
    """

    here_s: Positive = 10.0
    lost_s: Positive = 60.0
    tried_radius_m: Positive = 0.75
    max_tries: Annotated[int, Field(ge=1)] = 3
    rest_s: NotNegative = 10.0
    quiet_s: Positive = 4.0
    agreed_s: Positive = 3.0
    claim_apart_m: NotNegative = 2.0
    claim_overlap: Annotated[float, Field(ge=0.0)] = 0.8
    claim_tie_m: NotNegative = 0.5
    wait_period_s: Positive = 5.0
    wait_move_m: NotNegative = 1.5
    patience_s: Positive = 20.0
    lease_s: Positive = 3600.0


class TyingSettings(_Settings):
    """How a robot finds where its own map lies in the team's, see `robot_agent.decentral.tying`.

    One whose start is known no better than `start_m` does not tell what it sees until that fits
    what others saw: with `points` end points of `scans` or more scans at walls, a share of `fit` of
    those that fall where the map is known, which a share of `known` must; with a place known to
    `sigma_m` and `sigma_deg`; and where it leaves no more end points unexplained than a share of
    `rival` of those that any other place does. It tries no more often than every `period_s`.

    Robots tell every `sight_period_s` whom they saw from their starts, while somebody does not know
    its place. For `sight_wait_s` a robot waits for others to say that they saw it. A place where
    they did need be known to `sight_sigma_m` only; after `sight_tries` tries it counts without
    walls, unless a smaller share than `wrong_fit` of the end points fits.

    One that does not know its place after `alone_s` explores by its own map, and shares all that it
    saw when it knows. One that heard nobody for `settle_s` takes its place for what it was told,
    as nobody is there to fit, but does not say that it is sure. So does, and is sure, the first by
    name of those that hear each other if the first robot was not heard in that time.

    Once it knows, it looks whether all that it saw where others were fits what these saw: after
    `mend_period_s`, and ever more seldom, to `mend_period_most_s`, while all is well. A place that
    is off by `mend_m` or `mend_deg`, with errors of about `mend_sigma_m` and `mend_sigma_deg`, is
    put right; after `wrong_looks` looks at which it did not fit at all it is searched for anew.
    """

    start_m: Positive = 0.15
    period_s: Positive = 1.0
    scans: Annotated[int, Field(ge=1)] = 4
    points: Annotated[int, Field(ge=1)] = 30
    fit: Annotated[float, Field(gt=0.0, le=1.0)] = 0.85
    known: Annotated[float, Field(ge=0.0, le=1.0)] = 0.7
    sigma_m: Positive = 0.03
    sigma_deg: Positive = 1.0
    rival: Annotated[float, Field(gt=0.0, le=1.0)] = 0.6
    sight_period_s: Positive = 1.0
    sight_wait_s: NotNegative = 10.0
    sight_sigma_m: Positive = 0.1
    sight_tries: Annotated[int, Field(ge=1)] = 8
    wrong_fit: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    alone_s: Positive = 30.0
    settle_s: Positive = 60.0
    mend_period_s: Positive = 5.0
    mend_period_most_s: Positive = 60.0
    mend_m: Positive = 0.03
    mend_deg: Positive = 0.2
    mend_sigma_m: Positive = 0.05
    mend_sigma_deg: Positive = 1.0
    wrong_looks: Annotated[int, Field(ge=1)] = 2


class PeerSettings(_Settings):
    """How robots share their map without a server.

    Scans are coded with an error of at most `error_bound_m`. Where a robot is, it tells every
    `beacon_period_s`, and at rest every `beacon_rest_s`, with at most `beacon_points` of its path.
    Its poses are told anew when one is off by `repose_m` or `repose_deg`, which it looks for every
    `repose_period_s`. The map is drawn every `map_period_s`. It is no larger than `largest_cells`.

    With `use_team_map` an estimator that can, as `particle_filter`, places the robot by what the
    others saw, too, where their newest poses put it.
    """

    log: LogSyncSettings = LogSyncSettings()
    decision: DecisionSettings = DecisionSettings()
    error_bound_m: Annotated[float, Field(ge=0.0005, le=0.5)] = 0.01
    beacon_period_s: Positive = 0.8
    beacon_rest_s: Positive = 2.0
    beacon_points: Annotated[int, Field(ge=0, le=64)] = 12
    repose_m: Positive = 0.02
    repose_deg: Positive = 0.3
    repose_period_s: Positive = 0.5
    use_team_map: bool = False
    map_period_s: Positive = 0.3
    largest_cells: Annotated[int, Field(ge=1_000, le=50_000_000)] = 25_000_000
    tying: TyingSettings = TyingSettings()
