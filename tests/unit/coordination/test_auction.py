from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from coordination.bid import RobotBid
from coordination.strategies.auction import Auction, AuctionSettings
from coordination.strategy import Region
from mapping.geometry import IDENTITY

Row = tuple[float, float, float, float, float]  # x, y, gain, cost, half a square region's edge

# As in the paper, one square metre for one metre; defaults may be tuned without touching this file.
PLAIN = AuctionSettings(
    utility="net", cost_weight_m2_per_m=1.0, loss_weight=1.0, gain_cap_m2=1e6, stay_m2=0.0
)
CAPPED = PLAIN.model_copy(update={"gain_cap_m2": 25.0})


def bid(
    robot: str, *rows: Row, cost_weight: float = 1.0, losses: list[float] | None = None
) -> RobotBid:
    table = np.array(rows, dtype=np.float64).reshape(-1, 5)
    places, half = table[:, :2], table[:, 4:5]
    return RobotBid(
        robot,
        1,
        1,
        IDENTITY,
        places,
        table[:, 2],
        table[:, 3],
        np.column_stack((places - half, places + half)),
        np.empty((0, 2)),
        np.zeros(len(table)) if losses is None else np.array(losses, dtype=np.float64),
        cost_weight,
    )


def goals(choices: object) -> dict[str, tuple[float, float]]:
    return {choice.robot: choice.goal for choice in choices}  # type: ignore[attr-defined]


def test_the_highest_net_utility_goes_first_and_discounts_the_rest() -> None:
    # Both like the left place best; anna is nearer, so ben's share of it is discounted away.
    choices = Auction(PLAIN).assign(
        (
            bid("anna", (0, 0, 20, 2, 2), (9, 0, 18, 9, 2)),
            bid("ben", (0, 0, 20, 3, 2), (9, 0, 18, 8, 2)),
        ),
        (),
        (),
    )
    assert goals(choices) == {"anna": (0, 0), "ben": (9, 0)}
    assert [choice.utility for choice in choices] == [18, 10]


def test_what_going_there_first_costs_the_rest_counts() -> None:
    rows = ((0, 0, 4, 2, 1), (9, 0, 20, 9, 2))
    ahead = bid("anna", *rows, losses=[0.0, 16.0])
    assert goals(Auction(PLAIN).assign((ahead,), (), ())) == {"anna": (0, 0)}
    paper = Auction(PLAIN.model_copy(update={"loss_weight": 0.0}))
    assert goals(paper.assign((ahead,), (), ())) == {"anna": (9, 0)}


def test_overlap_discounts_by_area() -> None:
    # u_j = (1 - d_j) i_j - c_j with d_j = 1/2: 0.5 * 16 - 3.
    choices = Auction(PLAIN).assign(
        (bid("ben", (2, 0, 16, 3, 2)),), (), (Region("anna", (0.0, 0.0), (-2, -2, 2, 2)),)
    )
    assert (choices[0].gain, choices[0].utility) == (8.0, 5.0)


def test_a_robot_with_nothing_left_stays_idle() -> None:
    # Two directions in a corridor, three robots (Simmons et al. 2000, section "Experiments").
    both: tuple[Row, Row] = ((-5, 0, 20, 5, 3), (5, 0, 20, 5, 3))
    choices = Auction(PLAIN).assign((bid("a", *both), bid("b", *both), bid("c", *both)), (), ())
    assert goals(choices) == {"a": (-5, 0), "b": (5, 0)}


def test_the_threshold_is_on_the_discounted_gain() -> None:
    running = (Region("anna", (0.0, 0.0), (-2, -2, 2, 2)),)
    offer = (bid("ben", (2, 0, 16, 3, 2)),)
    assert Auction(AuctionSettings(min_gain_m2=8.0)).assign(offer, (), running)
    assert not Auction(AuctionSettings(min_gain_m2=8.1)).assign(offer, (), running)


def test_hysteresis_keeps_a_robot_at_its_task() -> None:
    offer = (bid("anna", (0, 0, 10, 2, 1), (9, 0, 11, 2, 1)),)
    current = (Region("anna", (0.5, 0.5), (-1, -1, 1, 1)),)
    assert goals(Auction(PLAIN).assign(offer, (), ())) == {"anna": (9, 0)}
    assert goals(Auction(PLAIN).assign(offer, current, ())) == {"anna": (0, 0)}
    off = PLAIN.model_copy(update={"hysteresis_ratio": 1.0})
    assert goals(Auction(off).assign(offer, current, ())) == {"anna": (9, 0)}


def test_a_huge_open_area_does_not_beat_the_room_nearby() -> None:
    offer = (bid("anna", (2, 0, 18, 2, 2), (30, 0, 150, 30, 8)),)
    assert goals(Auction(PLAIN).assign(offer, (), ())) == {"anna": (30, 0)}
    assert goals(Auction(CAPPED).assign(offer, (), ())) == {"anna": (2, 0)}


def test_what_it_is_heading_for_counts_more() -> None:
    offer = (bid("anna", (0, 0, 10, 2, 1), (9, 0, 11, 2, 1)),)
    current = (Region("anna", (0.5, 0.5), (8, 8, 9, 9)),)
    assert goals(Auction(PLAIN).assign(offer, current, ())) == {"anna": (9, 0)}
    stays = PLAIN.model_copy(update={"stay_m2": 2.0, "stay_radius_m": 1.0})
    assert goals(Auction(stays).assign(offer, current, ())) == {"anna": (0, 0)}


def test_tasks_are_swapped_when_the_other_robot_has_come_closer() -> None:
    office, corridor = (0.0, 0.0), (20.0, 0.0)
    offers = (
        bid("anna", (*office, 15, 12, 2), (*corridor, 15, 6, 2)),
        bid("ben", (*office, 15, 1, 2), (*corridor, 15, 14, 2)),
    )
    current = (
        Region("anna", office, (-2, -2, 2, 2)),
        Region("ben", corridor, (18, -2, 22, 2)),
    )
    assert goals(Auction(PLAIN).assign(offers, current, ())) == {"anna": corridor, "ben": office}


def test_no_two_robots_closer_than_the_separation() -> None:
    # Their regions are thin and do not overlap, yet the robots would stand on each other's toes.
    offers = (bid("anna", (0, 0, 9, 1, 0.1)), bid("ben", (0.3, 0, 9, 2, 0.1)))
    assert goals(Auction().assign(offers, (), ())) == {"anna": (0, 0)}
    apart = AuctionSettings(separation_m=0.2)
    assert len(Auction(apart).assign(offers, (), ())) == 2


def test_ties_go_to_the_shorter_way_then_the_name_then_the_first_place() -> None:
    free = AuctionSettings(utility="net", cost_weight_m2_per_m=0.0)
    offers = (bid("ben", (0, 0, 9, 4, 1)), bid("anna", (0, 0, 9, 5, 1)))
    assert goals(Auction(free).assign(offers, (), ())) == {"ben": (0, 0)}
    offers = (bid("ben", (0, 0, 9, 4, 1)), bid("anna", (0, 0, 9, 4, 1)))
    assert goals(Auction(free).assign(offers, (), ())) == {"anna": (0, 0)}
    offers = (bid("anna", (0, 0, 9, 4, 1), (9, 0, 9, 4, 1), (5, 5, 9, 3, 1)),)
    assert goals(Auction(free).assign(offers, (), ())) == {"anna": (5, 5)}


def test_a_slow_robot_pays_more_for_its_way() -> None:
    rows: tuple[Row, Row] = ((2, 0, 10, 2, 1), (12, 0, 24, 12, 1))
    assert goals(Auction(PLAIN).assign((bid("anna", *rows),), (), ())) == {"anna": (12, 0)}
    slow = bid("anna", *rows, cost_weight=3.0)
    assert goals(Auction(PLAIN).assign((slow,), (), ())) == {"anna": (2, 0)}


def test_a_far_room_beats_a_crumb_nearby_when_gains_are_divided_by_ways() -> None:
    offer = (bid("anna", (13, 0, 2, 13, 1), (25, 0, 10, 25, 1)),)
    assert goals(Auction(PLAIN).assign(offer, (), ())) == {"anna": (13, 0)}
    rate = PLAIN.model_copy(update={"utility": "rate", "overhead_m": 5.0})
    choice = Auction(rate).assign(offer, (), ())[0]
    assert (choice.goal, choice.utility) == ((25, 0), 10 / 30)


def test_a_slow_robot_pays_more_for_its_way_also_when_gains_are_divided_by_it() -> None:
    rows: tuple[Row, Row] = ((2, 0, 5, 2, 1), (12, 0, 13, 12, 1))
    rate = PLAIN.model_copy(update={"utility": "rate", "overhead_m": 6.0})
    assert goals(Auction(rate).assign((bid("anna", *rows),), (), ())) == {"anna": (12, 0)}
    slow = bid("anna", *rows, cost_weight=3.0)
    assert goals(Auction(rate).assign((slow,), (), ())) == {"anna": (2, 0)}


def test_settings_are_checked() -> None:
    with pytest.raises(ValidationError):
        Auction.from_settings({"hysteresis_ratio": 0.0})
    assert Auction.from_settings({"min_gain_m2": 2.0}).min_gain == 2.0
