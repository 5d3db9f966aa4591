"""From a bid as it is told to a bid that strategies can work with."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from coordination.bid import RobotBid
from mapping.geometry import Pose2

Numbers = npt.NDArray[np.floating[Any]]


class BidError(Exception):
    """A bid that contradicts itself."""


class ToldBid(Protocol):
    """A bid's words; its arrays are of any kind of floating-point numbers."""

    @property
    def number(self) -> int:
        """The count of the robot's bids."""
        ...

    @property
    def map_number(self) -> int:
        """The map it was made on."""
        ...

    @property
    def T_map_base(self) -> Pose2:  # noqa: N802
        """Where the robot stood."""
        ...

    @property
    def places_map(self) -> Numbers:
        """Where it could go, (n, 2) [m]."""
        ...

    @property
    def gains(self) -> Numbers:
        """Expected information, (n,) [m2]."""
        ...

    @property
    def costs_m(self) -> Numbers:
        """Lengths of the ways, (n,) [m]."""
        ...

    @property
    def rectangles_map(self) -> Numbers:
        """What it would see: x_min, y_min, x_max, y_max, (n, 4) [m]."""
        ...

    @property
    def unreachable_map(self) -> Numbers:
        """Where it cannot get to, (k, 2) [m]."""
        ...

    @property
    def losses(self) -> Numbers:
        """See `RobotBid`, (n,) [m2]; or empty for none."""
        ...


def robot_bid(robot: str, told: ToldBid, cost_weight: float = 1.0) -> RobotBid:
    """Return a robot's bid, checked.

    Args:
        robot: who bids.
        told: what it said.
        cost_weight: how dear its way is.

    Raises:
        BidError: its arrays do not fit together, or hold negative gains or costs, or rectangles
            turned inside out.
    """
    count = len(told.places_map)
    losses = told.losses if len(told.losses) else np.zeros(count)
    lengths = (len(told.gains), len(told.costs_m), len(told.rectangles_map), len(losses))
    if any(length != count for length in lengths):
        raise BidError(f"{count} places, but gains, costs, rectangles and losses for {lengths}")
    rectangles = told.rectangles_map.astype(np.float64)
    if any((values < 0.0).any() for values in (told.gains, told.costs_m, losses)):
        raise BidError("a negative gain, cost or loss")
    if (rectangles[:, :2] > rectangles[:, 2:]).any():
        raise BidError("a rectangle whose least corner is not its least")
    return RobotBid(
        robot,
        told.number,
        told.map_number,
        told.T_map_base,
        told.places_map.astype(np.float64),
        told.gains.astype(np.float64),
        told.costs_m.astype(np.float64),
        rectangles,
        told.unreachable_map.astype(np.float64),
        losses.astype(np.float64),
        cost_weight,
    )
