from __future__ import annotations

import numpy as np
import pytest

from coordination.bid import RobotBid
from coordination.strategies.auction import Auction
from coordination.strategy import Choice, StrategyError, choice_of, load_strategy
from mapping.geometry import IDENTITY


def test_by_name_and_by_import_string() -> None:
    assert isinstance(load_strategy("auction"), Auction)
    assert isinstance(load_strategy("coordination.strategies.auction:Auction"), Auction)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("swarm?", "choose one of auction, nearest, minpos, or give module:Class"),
        ("no.such.module:Class", "cannot load"),
        ("coordination.strategies.auction:Nothing", "cannot load"),
        (":Class", "cannot load"),
    ],
)
def test_unknown(name: str, message: str) -> None:
    with pytest.raises(StrategyError, match=message):
        load_strategy(name)


def test_choice_of() -> None:
    bid = RobotBid(
        "anna",
        1,
        1,
        IDENTITY,
        np.array([[1.0, 2.0]]),
        np.array([5.0]),
        np.array([3.0]),
        np.array([[0.0, 0.0, 4.0, 4.0]]),
        np.empty((0, 2)),
        np.zeros(1),
    )
    expected = Choice("anna", 0, (1.0, 2.0), (0.0, 0.0, 4.0, 4.0), 4.5, 3.0, 1.5)
    assert choice_of(bid, 0, 4.5, 1.5) == expected
