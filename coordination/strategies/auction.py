"""The greedy auction of Simmons et al. 2000.

Again and again the place with the highest utility of all bids goes to the robot that bid it, and
the gains of everybody else's places are discounted by how much of their regions that robot will see
on its way.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from coordination.bid import RobotBid, inside, near, overlap_fractions
from coordination.strategy import Choice, Region, choice_of
from mapping.geometry import Floats


class AuctionSettings(BaseModel):
    """Settings of the auction.

    Attributes:
        utility: what a place is worth. `net`: its gain less the cost of the way, as in the paper.
            `rate`: its gain for each metre of way, see docs/decisions/0016.
        overhead_m: with `rate`, what each task takes besides its way, as a length of way: turning,
            looking, waiting for the map to change.
        cost_weight_m2_per_m: with `net`, how much information one metre of way must be worth.
        loss_weight: with `net`, how much it counts what a robot loses on the rest of its route by
            going to a place first, if bids tell (`robot.explorer.look_ahead`); 0 is the paper's
            rule, which looks at one place at a time.
        min_gain_m2: the least discounted gain worth a trip.
        hysteresis_ratio: a place in the region of the robot's running task has its gain divided by
            this; lower values make robots stay with what they are at. 1 switches it off.
        gain_cap_m2: more than this counts no more, so that one huge open area does not always beat
            the small rooms on the way: they would have to be come back for.
        stay_m2: the place a robot is heading for, those in its region, and those within
            `stay_radius_m` of it, count this much more: turning round costs time that path lengths
            do not tell.
        stay_radius_m: see `stay_m2`.
        separation_m: no two robots are sent to places closer than this.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    utility: Literal["rate", "net"] = "rate"
    overhead_m: Annotated[float, Field(gt=0.0)] = 3.0
    cost_weight_m2_per_m: Annotated[float, Field(ge=0.0)] = 1.0
    loss_weight: Annotated[float, Field(ge=0.0)] = 0.3
    min_gain_m2: Annotated[float, Field(ge=0.0)] = 0.7
    hysteresis_ratio: Annotated[float, Field(gt=0.0, le=1.0)] = 0.85
    gain_cap_m2: Annotated[float, Field(gt=0.0)] = 60.0
    stay_m2: Annotated[float, Field(ge=0.0)] = 4.0
    stay_radius_m: Annotated[float, Field(ge=0.0)] = 1.0
    separation_m: Annotated[float, Field(ge=0.0)] = 0.5


@dataclass(slots=True)
class _Offer:
    """One robot's bid while the auction runs; arrays (n,), one entry for each place."""

    bid: RobotBid
    values: Floats  # capped gain, with hysteresis [m2]
    overlaps: Floats  # d_j
    open: npt.NDArray[np.bool_]  # not too close to a place already given away


class Auction:
    """Greedy assignment by net utility, discounted by overlap.

    Source: Simmons et al. 2000, section "Assigning Tasks".
    """

    coordinated = True

    def __init__(self, settings: AuctionSettings | None = None) -> None:
        self.settings = settings or AuctionSettings()

    @classmethod
    def from_settings(cls, settings: Mapping[str, object]) -> Auction:
        """Return an auction with these settings."""
        return cls(AuctionSettings.model_validate(dict(settings)))

    @property
    def min_gain(self) -> float:
        """The least discounted gain [m2] worth a trip."""
        return self.settings.min_gain_m2

    def assign(
        self,
        bids: tuple[RobotBid, ...],
        current: tuple[Region, ...],
        running: tuple[Region, ...],
    ) -> tuple[Choice, ...]:
        """Choose places for the bidding robots; see `Strategy.assign`."""
        heading = {region.robot: region for region in current}
        offers = [
            self._offer(bid, heading.get(bid.robot), running)
            for bid in sorted(bids, key=lambda bid: bid.robot)
        ]
        choices: list[Choice] = []
        while offers:
            best = [self._best(offer) for offer in offers]
            # On a tie the shorter way wins, then the robot's name: max keeps the first it meets.
            won = max(best, key=lambda choice: (choice.utility, -choice.cost) if choice else _NONE)
            if won is None:
                break
            choices.append(won)
            offers = [offer for offer in offers if offer.bid.robot != won.robot]
            taken = running + tuple(Region(c.robot, c.goal, c.rectangle) for c in choices)
            for offer in offers:
                self._discount(offer, taken)
        return tuple(sorted(choices, key=lambda choice: choice.robot))

    def _offer(self, bid: RobotBid, heading: Region | None, running: tuple[Region, ...]) -> _Offer:
        """Return a bid ready for the auction, discounted by the robots that go on."""
        values = np.minimum(bid.gains, self.settings.gain_cap_m2)
        if heading is not None:
            held = inside(bid.places, heading.rectangle)
            values = np.where(held, values / self.settings.hysteresis_ratio, values)
            stays = held | near(bid.places, heading.goal, self.settings.stay_radius_m)
            values = np.where(stays, values + self.settings.stay_m2, values)
        offer = _Offer(bid, values, np.zeros(len(bid)), np.ones(len(bid), dtype=np.bool_))
        for count in range(1, len(running) + 1):
            self._discount(offer, running[:count])
        return offer

    def _discount(self, offer: _Offer, taken: tuple[Region, ...]) -> None:
        """Take the newest (last) of the taken regions into account.

        The overlap is with the union of all, so it changes only where the newest one touches.
        """
        newest = np.array(taken[-1].rectangle)
        rectangles = offer.bid.rectangles
        touched = (rectangles[:, :2] <= newest[2:]).all(axis=1) & (
            rectangles[:, 2:] >= newest[:2]
        ).all(axis=1)
        if touched.any():
            union = np.array([region.rectangle for region in taken])
            offer.overlaps[touched] = overlap_fractions(rectangles[touched], union)
        offer.open &= ~near(offer.bid.places, taken[-1].goal, self.settings.separation_m)

    def _best(self, offer: _Offer) -> Choice | None:
        """Return the place with the highest utility, or None."""
        bid = offer.bid
        gains = (1.0 - offer.overlaps) * bid.gains
        worth = offer.open & (gains >= self.settings.min_gain_m2) & (gains > 0.0)
        if not worth.any():
            return None
        utilities = self._utilities(offer)
        rows = np.flatnonzero(worth)
        first = np.lexsort((rows, bid.costs[rows], -utilities[rows]))[0]
        row = int(rows[first])
        return choice_of(bid, row, float(gains[row]), float(utilities[row]))

    def _utilities(self, offer: _Offer) -> Floats:
        """Return what each place is worth to the robot, (n,).

        `net` is u_j = (1 - d_j) i_j - c_j [m2] of Simmons et al. 2000. Its weight of the way is
        right for one rate of discovery only: when all places near are worth little, a far room is
        worth less than the crumb on this side. `rate` [m2/m] needs no such weight.
        """
        settings, bid = self.settings, offer.bid
        values, ways = (1.0 - offer.overlaps) * offer.values, bid.cost_weight * bid.costs
        if settings.utility == "rate":
            rates: Floats = values / (settings.overhead_m + ways)
            return rates
        net: Floats = (
            values - settings.cost_weight_m2_per_m * ways - settings.loss_weight * bid.losses
        )
        return net


_NONE = (-np.inf, -np.inf)
