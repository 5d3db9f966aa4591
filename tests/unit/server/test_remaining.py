from __future__ import annotations

from coordination.tried_places import TriedPlaces
from protocol.body import Body
from server.executive_settings import ExecutiveSettings
from server.pool import Member, Pool
from server.remaining import frontiers, remaining
from server.work import Work
from tests.unit.server.executive_rig import bid_of


def pool_of(*bids: object) -> Pool:
    work, pool = Work(ExecutiveSettings()), Pool()
    for bid in bids:
        name = bid.robot  # type: ignore[attr-defined]
        pool.add(Member(name, Body(), work.new_robot(name, 0.0), 0.0, bid=bid))  # type: ignore[arg-type]
    return pool


def test_only_the_newest_map_counts_and_one_place_is_one() -> None:
    pool = pool_of(
        bid_of("anna", [(5, 20, 2), (9, 3, 4)], 1, map_number=7),
        bid_of("ben", [(5.1, 25, 2)], 1, map_number=7),
        bid_of("carl", [(50, 90, 2)], 1, map_number=6),
    )
    places, gains, closed = frontiers(pool)
    assert places[:, 0].tolist() == [5.1, 9.0]
    assert gains.tolist() == [25.0, 3.0] and len(closed) == 0


def test_what_one_robot_can_get_to_is_not_unreachable() -> None:
    pool = pool_of(
        bid_of("anna", [(5, 20, 2)], 1, unreachable=[(30.0, 0.0), (30.1, 0.0)]),
        bid_of("ben", [], 1, unreachable=[(5.0, 0.0)]),
    )
    assert frontiers(pool)[2].tolist() == [[30.0, 0.0]]


def test_every_reason() -> None:
    tried = TriedPlaces(0.5, 1)
    tried.failed((5.0, 0.0), "anna", "stuck")
    tried.failed((60.0, 0.0), "anna", "no way")
    bid = bid_of(
        "anna",
        [(5, 20, 2), (9, 0.2, 4), (30, 8, 30)],
        1,
        unreachable=[(60.0, 0.0), (70.0, 0.0)],
    )
    assert remaining(pool_of(bid), tried, 0.5) == [
        {
            "x_m": 5.0,
            "y_m": 0.0,
            "gain_m2": 20.0,
            "reason": "given up after 1 tries",
            "tries": ["anna: stuck"],
        },
        {"x_m": 30.0, "y_m": 0.0, "gain_m2": 8.0, "reason": "not visited: mission ended first"},
        {"x_m": 9.0, "y_m": 0.0, "gain_m2": 0.2, "reason": "below the minimum gain"},
        {
            "x_m": 60.0,
            "y_m": 0.0,
            "gain_m2": None,
            "reason": "given up after 1 tries",
            "tries": ["anna: no way"],
        },
        {"x_m": 70.0, "y_m": 0.0, "gain_m2": None, "reason": "unreachable for this body"},
    ]


def test_nothing_known_nothing_left() -> None:
    assert remaining(Pool(), TriedPlaces(0.5, 1), 0.5) == []
