from __future__ import annotations

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from protocol.body import Body, Lidar
from protocol.map_cells import pack_cells
from protocol.messages import Bid, MapDelta, MapSnapshot
from robot_agent.explorer import Explorer
from robot_agent.navigation_settings import PlanningMapSettings
from robot_agent.planning_map import PlanningMap
from robot_agent.settings import ExplorerSettings

BODY = Body(radius_m=0.2, lidar=Lidar(range_max_m=3.0))
RESOLUTION = 0.1
ALONE = np.zeros((0, 2))


def hall(open_end: bool = True) -> MapSnapshot:
    """A hall from (-1, -1) to (2, 1) m with walls all round; its right end may be open."""
    log_odds = np.full((20, 30), -3.0, dtype=np.float32)
    log_odds[[0, -1], :] = 3.0
    log_odds[:, 0] = 3.0
    if not open_end:
        log_odds[:, -1] = 3.0
    return MapSnapshot(
        number=1,
        resolution_m=RESOLUTION,
        origin_x_m=-1.0,
        origin_y_m=-1.0,
        rows=20,
        cols=30,
        cells=pack_cells(np.pad(log_odds, ((0, 0), (0, 0)))),
    )


def unknown_beyond(number: int) -> MapDelta:
    """A change that gives the map room beyond the hall's open end."""
    return MapDelta(
        number=number,
        resolution_m=RESOLUTION,
        lattice_x=20,
        lattice_y=-10,
        rows=20,
        cols=20,
        cells=pack_cells(np.zeros((20, 20), dtype=np.float32)),
    )


def explorer_in(snapshot: MapSnapshot, **settings: object) -> tuple[Explorer, PlanningMap]:
    planning_map = PlanningMap(BODY.radius_m, PlanningMapSettings(resolution_m=RESOLUTION))
    explorer = Explorer(BODY, ExplorerSettings.model_validate(settings), planning_map)
    planning_map.apply_snapshot(snapshot)
    assert planning_map.apply_delta(unknown_beyond(2)) is not None
    return explorer, planning_map


def touch(planning_map: PlanningMap) -> None:
    """Change one cell of the map for nothing."""
    row = pack_cells(np.full((1, 1), -3.0, dtype=np.float32))
    number = planning_map.number + 1
    change = MapDelta(
        number=number, resolution_m=RESOLUTION, lattice_x=0, lattice_y=0, rows=1, cols=1, cells=row
    )
    assert planning_map.apply_delta(change) is not None


def bid_of(explorer: Explorer, T_map_base: Pose2 = IDENTITY, now: float = 0.0) -> Bid:
    bid = explorer.bid(T_map_base, ALONE, False, now)
    assert bid is not None
    return bid


def test_a_bid_names_the_places_at_the_open_end_and_what_they_cost_and_bring() -> None:
    explorer, planning_map = explorer_in(hall())
    bid = bid_of(explorer)
    assert len(bid.places_map) > 0
    assert (bid.places_map[:, 0] > 1.2).all()
    assert (bid.gains > 0.0).all()
    straight = np.hypot(*bid.places_map.T.astype(float))
    assert (bid.costs_m >= straight - 0.2).all()
    assert (bid.rectangles_map[:, 2] > 2.0).all()
    assert (bid.number, bid.map_number) == (1, planning_map.number)
    assert bid.T_map_base == IDENTITY


def test_there_is_nothing_to_bid_on_in_a_closed_room() -> None:
    explorer, _ = explorer_in(hall(open_end=False))
    assert len(bid_of(explorer).places_map) == 0


def test_a_bid_is_made_on_news_only_and_not_too_often_unless_one_is_idle() -> None:
    explorer, planning_map = explorer_in(hall(), bid_period_s=1.0)
    bid_of(explorer)
    assert explorer.bid(IDENTITY, ALONE, False, 5.0) is None
    touch(planning_map)
    assert bid_of(explorer, now=5.0).number == 2
    touch(planning_map)
    assert explorer.bid(IDENTITY, ALONE, False, 5.5) is None
    assert explorer.bid(IDENTITY, ALONE, True, 5.5) is not None


def test_places_behind_a_wall_are_told_as_unreachable() -> None:
    snapshot = hall()
    explorer, planning_map = explorer_in(snapshot)
    wall = MapDelta(
        number=3,
        resolution_m=RESOLUTION,
        lattice_x=8,
        lattice_y=-10,
        rows=20,
        cols=2,
        cells=pack_cells(np.full((20, 2), 3.0, dtype=np.float32)),
    )
    assert planning_map.apply_delta(wall) is not None
    bid = bid_of(explorer)
    assert len(bid.places_map) == 0
    assert len(bid.unreachable_map) > 0
    assert (bid.unreachable_map[:, 0] > 1.0).all()


def test_one_that_believes_to_be_outside_the_map_reaches_nothing() -> None:
    explorer, _ = explorer_in(hall())
    bid = bid_of(explorer, Pose2(50.0, 50.0, 0.0))
    assert len(bid.places_map) == 0
    assert len(bid.unreachable_map) > 0


def test_weighing_by_probability_can_be_turned_off() -> None:
    plain, _ = explorer_in(hall(), weigh_by_probability=False)
    assert (bid_of(plain).gains > 0.0).all()


def test_nothing_is_expected_behind_a_gap_too_narrow_for_the_body() -> None:
    explorer, planning_map = explorer_in(hall(), frontier_cells_min=2)
    assert bid_of(explorer).gains.max() > 1.0
    walls = np.full((20, 1), 3.0, dtype=np.float32)
    walls[9:12] = 0.0  # 0.3 m, and the body needs 0.4
    shut = MapDelta(
        number=3,
        resolution_m=RESOLUTION,
        lattice_x=19,
        lattice_y=-10,
        rows=20,
        cols=1,
        cells=pack_cells(walls),
    )
    planning_map.apply_delta(shut)
    assert len(bid_of(explorer, now=9.0).places_map) == 0


def test_a_flood_counts_no_more_than_some_times_what_is_in_sight() -> None:
    flood, _ = explorer_in(hall(), sight_factor=0.0)
    bounded, planning_map = explorer_in(hall(), sight_factor=0.5, free_path_m=0.5)
    by_flood, in_sight = bid_of(flood), bid_of(bounded)
    np.testing.assert_array_equal(by_flood.places_map, in_sight.places_map)
    np.testing.assert_array_equal(by_flood.rectangles_map, in_sight.rectangles_map)
    assert (in_sight.gains > 0.0).all() and (in_sight.gains < by_flood.gains).all()
    touch(planning_map)
    np.testing.assert_array_equal(bid_of(bounded, now=9.0).gains, in_sight.gains)


def two_ends() -> Explorer:
    """A corridor along x, open at x = 2 and, through a wide gap in its left end, at x = -1."""
    explorer, planning_map = explorer_in(
        hall(), look_ahead=True, route_worth=0.2, route_apart_m=0.5
    )
    opened = MapDelta(
        number=3,
        resolution_m=RESOLUTION,
        lattice_x=-20,
        lattice_y=-10,
        rows=20,
        cols=11,
        cells=pack_cells(np.pad(np.full((14, 1), -3.0, np.float32), ((3, 3), (10, 0)))),
    )
    planning_map.apply_delta(opened)
    return explorer


def test_going_to_one_end_first_costs_the_other() -> None:
    explorer = two_ends()
    bid = bid_of(explorer, Pose2(-0.4, 0.0, 0.0))
    left = bid.places_map[:, 0] < 0.0
    assert left.any() and not left.all()
    assert bid.losses.min() == 0.0 and (bid.losses >= 0.0).all()
    # Less is lost by going first to where there is less to gain.
    poor, rich = (left, ~left) if bid.gains[left].max() < bid.gains[~left].max() else (~left, left)
    assert bid.losses[poor].min() < bid.losses[rich].min()


def test_what_a_teammate_is_nearer_to_is_not_looked_ahead_to() -> None:
    explorer = two_ends()
    mates = np.array([[-0.6, 0.3], [1.6, 0.3]])
    bid = explorer.bid(Pose2(0.6, 0.0, 0.0), mates, False, 0.0)
    assert bid is not None
    assert (bid.losses == 0.0).all()


def test_only_the_richest_places_are_told() -> None:
    explorer, _ = explorer_in(hall(), spacing_m=0.1, places_max=2)
    assert len(bid_of(explorer).places_map) == 2


def test_what_a_place_costs_a_teammate_is_its_way_from_where_it_is() -> None:
    explorer, _ = explorer_in(hall())
    bid = bid_of(explorer)
    places = bid.places_map.astype(float)
    from_here = explorer.costs_from(IDENTITY, places)
    np.testing.assert_allclose(from_here, bid.costs_m, atol=1e-5)
    nearer = explorer.costs_from(Pose2(1.0, 0.0, 0.0), places)
    assert (nearer < from_here - 0.5).all()
    assert explorer.costs_from(IDENTITY, ALONE).shape == (0,)


def test_a_teammate_without_a_way_to_a_place_has_it_infinitely_far() -> None:
    explorer, _ = explorer_in(hall())
    places = bid_of(explorer).places_map.astype(float)
    assert np.isinf(explorer.costs_from(Pose2(50.0, 50.0, 0.0), places)).all()
    assert np.isinf(explorer.costs_from(IDENTITY, np.array([[90.0, 0.0]]))).all()


def test_costs_are_of_the_map_as_it_is_though_it_has_grown_since_the_bid() -> None:
    explorer, planning_map = explorer_in(hall())
    places = bid_of(explorer).places_map.astype(float)
    before = explorer.costs_from(IDENTITY, places)
    grown = MapDelta(
        number=3,
        resolution_m=RESOLUTION,
        lattice_x=-100,
        lattice_y=-100,
        rows=20,
        cols=20,
        cells=pack_cells(np.full((20, 20), -3.0, dtype=np.float32)),
    )
    assert planning_map.apply_delta(grown) is not None
    np.testing.assert_allclose(explorer.costs_from(IDENTITY, places), before, atol=0.2)
    bid = bid_of(explorer, now=9.0)  # what it knows of the change is not lost
    assert bid.map_number == 3
    np.testing.assert_allclose(bid.costs_m, before, atol=0.2)
