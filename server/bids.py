"""From a bid on the wire to a bid the auction can work with."""

from __future__ import annotations

import numpy as np

from coordination.bid import RobotBid
from protocol.body import Body
from protocol.messages import Bid

# The speed [m/s] at which a metre of way costs just what the auction's settings say.
NOMINAL_SPEED = 0.5


class BidError(Exception):
    """A bid that contradicts itself."""


def robot_bid(robot: str, message: Bid, body: Body, cost_weight: float = 1.0) -> RobotBid:
    """Return a robot's bid, checked.

    A slow robot's ways cost more, a fast one's less, in proportion to the time they take.

    Args:
        robot: who bids.
        message: what it said.
        body: how fast it is.
        cost_weight: how dear its way is besides.

    Raises:
        BidError: its arrays do not fit together, or hold negative gains or costs, or rectangles
            turned inside out.
    """
    count = len(message.places_map)
    losses = message.losses if len(message.losses) else np.zeros(count)
    lengths = (len(message.gains), len(message.costs_m), len(message.rectangles_map), len(losses))
    if any(length != count for length in lengths):
        raise BidError(f"{count} places, but gains, costs, rectangles and losses for {lengths}")
    rectangles = message.rectangles_map.astype(np.float64)
    if any((values < 0.0).any() for values in (message.gains, message.costs_m, losses)):
        raise BidError("a negative gain, cost or loss")
    if (rectangles[:, :2] > rectangles[:, 2:]).any():
        raise BidError("a rectangle whose least corner is not its least")
    return RobotBid(
        robot,
        message.number,
        message.map_number,
        message.T_map_base,
        message.places_map.astype(np.float64),
        message.gains.astype(np.float64),
        message.costs_m.astype(np.float64),
        rectangles,
        message.unreachable_map.astype(np.float64),
        losses.astype(np.float64),
        cost_weight * NOMINAL_SPEED / body.drive.speed_max_m_s,
    )
