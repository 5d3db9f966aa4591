"""What decides who goes where, and the table of ways to decide.

A strategy gets the bids of the robots that are up for assignment and says which place each of them
is to explore. A new strategy is one file in `coordination/strategies` and one row in `STRATEGIES`;
one from elsewhere is named by an import string, "module:Class".
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, cast, runtime_checkable

from coordination.bid import RobotBid
from coordination.task import Point, Rectangle


class StrategyError(Exception):
    """A strategy that cannot be found or does not take its settings."""


@dataclass(frozen=True, slots=True)
class Region:
    """Where a robot is already heading.

    Attributes:
        robot: who.
        goal: (x, y) [m], map frame.
        rectangle: x_min, y_min, x_max, y_max [m] around what it will see there.
    """

    robot: str
    goal: Point
    rectangle: Rectangle


@dataclass(frozen=True, slots=True)
class Choice:
    """One robot's next place.

    Attributes:
        robot: who.
        row: which place of its bid.
        goal: that place, (x, y) [m], map frame.
        rectangle: x_min, y_min, x_max, y_max [m] of its information gain region.
        gain: expected information, less what others will see [m2].
        cost: path length [m].
        utility: what the strategy made the choice by; larger is better.
    """

    robot: str
    row: int
    goal: Point
    rectangle: Rectangle
    gain: float
    cost: float
    utility: float


@runtime_checkable
class Strategy(Protocol):
    """A way to decide who goes where. Holds settings only, no state between calls."""

    @classmethod
    def from_settings(cls, settings: Mapping[str, object]) -> Strategy:
        """Return the strategy with these settings; those not given have defaults.

        Raises:
            ValueError: a setting is unknown or out of range (pydantic's ValidationError is one).
        """
        ...

    @property
    def coordinated(self) -> bool:
        """Whether it never sends two robots to one place."""
        ...

    @property
    def min_gain(self) -> float:
        """The least expected information [m2] worth a trip."""
        ...

    def assign(
        self,
        bids: tuple[RobotBid, ...],
        current: tuple[Region, ...],
        running: tuple[Region, ...],
    ) -> tuple[Choice, ...]:
        """Choose places for the bidding robots.

        Args:
            bids: at most one for each robot that is up for assignment, by name.
            current: what those of them that have a task are heading for now; they may be sent
                elsewhere.
            running: what all other robots are heading for; they go on.

        Returns:
            At most one choice for each bid, by the robot's name. A robot without one gets nothing
            to explore.
        """
        ...


@runtime_checkable
class ChoosesAlone(Protocol):
    """A strategy by which a robot can choose for itself, without working out what others choose."""

    def choose(
        self,
        own: RobotBid,
        others: Sequence[RobotBid],
        heading: Region | None,
        running: tuple[Region, ...],
    ) -> Choice | None:
        """Return what `assign` would choose for one robot.

        Args:
            own: its bid.
            others: the bids of all others, in any order.
            heading: where it is heading now.
            running: as for `Strategy.assign`.
        """
        ...


STRATEGIES: dict[str, str] = {
    "auction": "coordination.strategies.auction:Auction",
    "nearest": "coordination.strategies.nearest:Nearest",
    "minpos": "coordination.strategies.minpos:MinPos",
}


def load_strategy(name: str, settings: Mapping[str, object] | None = None) -> Strategy:
    """Return a strategy by its name in `STRATEGIES` or by an import string "module:Class".

    Raises:
        StrategyError: there is no such strategy, or it does not take the settings.
    """
    module_name, _, class_name = STRATEGIES.get(name, name).partition(":")
    if not class_name:
        known = ", ".join(STRATEGIES)
        raise StrategyError(f"no strategy '{name}': choose one of {known}, or give module:Class")
    try:
        kind = getattr(importlib.import_module(module_name), class_name)
    except (ImportError, AttributeError, ValueError) as error:
        raise StrategyError(f"cannot load strategy '{name}': {error}") from error
    try:
        return cast(Strategy, kind.from_settings(settings or {}))
    except ValueError as error:
        raise StrategyError(f"strategy '{name}' does not take these settings: {error}") from error


def choice_of(bid: RobotBid, row: int, gain: float, utility: float) -> Choice:
    """Return the choice of place `row` of a bid, with the gain [m2] and utility it was made by."""
    x, y = (float(v) for v in bid.places[row])
    x0, y0, x1, y1 = (float(v) for v in bid.rectangles[row])
    return Choice(bid.robot, row, (x, y), (x0, y0, x1, y1), gain, float(bid.costs[row]), utility)
