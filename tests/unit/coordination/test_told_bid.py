from __future__ import annotations

import numpy as np
import pytest

from coordination.told_bid import BidError, robot_bid
from mapping.geometry import Pose2
from protocol.messages import Bid


def message(**changes: object) -> Bid:
    fields: dict[str, object] = {
        "number": 4,
        "map_number": 7,
        "T_map_base": Pose2(1.0, 2.0, 0.5),
        "places_map": np.array([[3.0, 4.0]], dtype=np.float32),
        "gains": np.array([12.5], dtype=np.float32),
        "costs_m": np.array([2.5], dtype=np.float32),
        "rectangles_map": np.array([[2.0, 3.0, 5.0, 6.0]], dtype=np.float32),
        "unreachable_map": np.zeros((0, 2), dtype=np.float32),
    }
    return Bid.model_validate(fields | changes)


def test_a_bid_is_taken_over() -> None:
    bid = robot_bid("anna", message())
    assert (bid.robot, bid.number, bid.map_number, len(bid)) == ("anna", 4, 7, 1)
    assert bid.T_map_base == Pose2(1.0, 2.0, 0.5)
    arrays = (bid.places, bid.gains, bid.costs, bid.rectangles, bid.unreachable)
    assert all(array.dtype == np.float64 for array in arrays)
    assert bid.cost_weight == 1.0
    assert robot_bid("anna", message(), 1.5).cost_weight == 1.5
    assert bid.losses.tolist() == [0.0]  # not told by an older robot
    told = message(losses=np.array([3.5], dtype=np.float32))
    assert robot_bid("anna", told).losses.tolist() == [3.5]


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"gains": np.zeros(2, dtype=np.float32)}, "1 places, but"),
        ({"gains": np.array([-1.0], dtype=np.float32)}, "negative"),
        ({"costs_m": np.array([-1.0], dtype=np.float32)}, "negative"),
        ({"losses": np.array([-1.0], dtype=np.float32)}, "negative"),
        ({"losses": np.zeros(3, dtype=np.float32)}, "1 places, but"),
        ({"rectangles_map": np.array([[2, 3, 1, 6]], dtype=np.float32)}, "least corner"),
    ],
)
def test_a_bid_that_contradicts_itself(changes: dict[str, object], complaint: str) -> None:
    with pytest.raises(BidError, match=complaint):
        robot_bid("anna", message(**changes))
