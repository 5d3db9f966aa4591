from __future__ import annotations

import numpy as np

from mapping.estimator import OthersScan
from mapping.geometry import Pose2
from mapping.match_map import MapSettings
from mapping.others_map import OthersMap
from mapping.particle_maps import WallSettings
from mapping.scan import LaserScan
from tests.unit.mapping.rectangle import rectangle_scan

PLACES = [Pose2(1.0, 1.0, 0.0), Pose2(2.0, 1.4, 1.0), Pose2(3.0, 2.0, -2.0)]
SCANS = [rectangle_scan(place, beams=40) for place in PLACES]


def seen(
    number: int, T_odom_base: Pose2 | None = None, scan: LaserScan | None = None
) -> OthersScan:
    return OthersScan(("bob", 0), number, scan or SCANS[number], T_odom_base or PLACES[number])


def map_of(*rounds: list[OthersScan]) -> OthersMap:
    others = OthersMap(MapSettings(), WallSettings())
    for scans in rounds:
        others.tell(scans)
        others.follow()
    return others


def cells(others: OthersMap) -> bytes:
    """All that is in the map, whatever its tiles are numbered."""
    assert others.walls is not None
    tiles = others.walls.tiles
    return tiles.pool[tiles.tables[0]].tobytes() + (tiles.tables[0] >= 0).tobytes()


def test_there_is_no_map_without_a_scan() -> None:
    assert map_of([]).walls is None
    assert map_of([seen(0)], []).walls is None
    others = OthersMap(MapSettings(), WallSettings())
    others.tell([seen(0)])
    assert others.walls is None, "it is drawn when asked for"


def test_what_is_new_is_added_and_what_stays_is_not_drawn_again() -> None:
    others = map_of([seen(0)], [seen(0)], [seen(0), seen(1)], [seen(0), seen(1), seen(2)])
    assert others.drawn == 3
    assert cells(others) == cells(map_of([seen(0), seen(1), seen(2)]))


def test_what_was_moved_or_taken_back_or_replaced_is_drawn_where_it_is_now() -> None:
    for after in (
        [seen(0, Pose2(1.3, 1.0, 0.0)), seen(1)],
        [seen(0, scan=SCANS[2]), seen(1)],
        [seen(1)],
    ):
        others = map_of([seen(0), seen(1)], after)
        assert others.drawn == 2 + len(after)
        assert cells(others) == cells(map_of(after))


def test_scans_without_end_points_are_no_walls() -> None:
    blind = LaserScan(np.zeros(40, dtype=np.float32), -3.0, 0.15, 8.0, 0.0)
    others = map_of([seen(0, scan=blind)])
    assert others.walls is not None and others.walls.tiles.used == 0
