"""Every robot to its nearest frontier, without regard to the others.

The uncoordinated rival: robots share the map and nothing else, so two of them may well go to the
same place.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from coordination.bid import RobotBid, near
from coordination.strategy import Choice, Region, choice_of


class NearestSettings(BaseModel):
    """Settings of the nearest-frontier strategy.

    Attributes:
        min_gain_m2: the least gain worth a trip.
        keep_radius_m: a robot goes on to its goal while a frontier is left within this of it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    min_gain_m2: Annotated[float, Field(ge=0.0)] = 0.5
    keep_radius_m: Annotated[float, Field(ge=0.0)] = 0.5


class Nearest:
    """Each robot heads for its closest frontier and goes on until that is gone.

    Source: Yamauchi 1998, "Frontier-based exploration using multiple robots".
    """

    coordinated = False

    def __init__(self, settings: NearestSettings | None = None) -> None:
        self.settings = settings or NearestSettings()

    @classmethod
    def from_settings(cls, settings: Mapping[str, object]) -> Nearest:
        """Return the strategy with these settings."""
        return cls(NearestSettings.model_validate(dict(settings)))

    @property
    def min_gain(self) -> float:
        """The least gain [m2] worth a trip."""
        return self.settings.min_gain_m2

    def assign(
        self,
        bids: tuple[RobotBid, ...],
        current: tuple[Region, ...],
        running: tuple[Region, ...],
    ) -> tuple[Choice, ...]:
        """Choose places for the bidding robots; see `Strategy.assign`."""
        heading = {region.robot: region for region in current}
        choices = (
            self._nearest(bid, heading.get(bid.robot))
            for bid in sorted(bids, key=lambda bid: bid.robot)
        )
        return tuple(choice for choice in choices if choice is not None)

    def _nearest(self, bid: RobotBid, heading: Region | None) -> Choice | None:
        worth = (bid.gains >= self.settings.min_gain_m2) & (bid.gains > 0.0)
        if heading is not None:
            kept = worth & near(bid.places, heading.goal, self.settings.keep_radius_m)
            worth = kept if kept.any() else worth
        rows = np.flatnonzero(worth)
        if len(rows) == 0:
            return None
        row = int(rows[np.argmin(bid.costs[rows])])
        return choice_of(bid, row, float(bid.gains[row]), -float(bid.costs[row]))
