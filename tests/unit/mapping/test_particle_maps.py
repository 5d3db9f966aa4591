from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import Pose2
from mapping.match_map import MapSettings
from mapping.particle_maps import ParticleMaps, WallSettings
from mapping.scan_points import scan_points
from mapping.wall_tiles import FIRST, HITS, MOST_HITS, OFFSET_X, OFFSET_Y
from tests.unit.mapping.rectangle import corridor_scan, rectangle_scan

HERE = Pose2(1.6, 1.3, 0.4)
WIDE = np.diag([0.1**2, 0.1**2, 0.05**2])


def maps_of_a_room(count: int = 2, scans: int = 4) -> ParticleMaps:
    maps, rng = ParticleMaps(count, MapSettings(), WallSettings()), np.random.default_rng(1)
    maps.insert(
        (
            scan_points(rectangle_scan(HERE, beams=91, noise=0.01, rng=rng)),
            np.tile(HERE.as_array(), (count, 1)),
        )
        for _ in range(scans)
    )
    return maps


@pytest.mark.parametrize("off", [(0.1, -0.08, 0.05), (-0.15, 0.1, -0.06), (0.0, 0.0, 0.0)])
def test_a_scan_is_matched_to_where_it_was_taken(off: tuple[float, float, float]) -> None:
    maps = maps_of_a_room()
    true = HERE @ Pose2(0.2, 0.1, 0.3)
    points = scan_points(rectangle_scan(true, beams=91))
    guess = true.as_array() + np.array(off)
    pose, covariance, value, explained = maps.match(1, points, guess, guess, WIDE)
    assert pose == pytest.approx(true.as_array(), abs=0.012)
    assert explained > 0.85 * len(points)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert np.trace(covariance) < 0.01 * np.trace(WIDE)
    elsewhere = guess + np.array([1.0, 1.0, 1.0])
    assert value > maps.match(1, points, elsewhere, elsewhere, WIDE)[2]


def test_along_bare_walls_the_prior_stands() -> None:
    maps = ParticleMaps(1, MapSettings(), WallSettings())
    for x in (0.0, 0.3, 0.6):
        maps.insert([(scan_points(corridor_scan(Pose2(x, 0.0, 0.0))), np.array([[x, 0.0, 0.0]]))])
    guess = np.array([0.8, 0.05, 0.0])
    points = scan_points(corridor_scan(Pose2(0.75, 0.0, 0.0)))
    pose, covariance, _, _ = maps.match(0, points, guess, guess, WIDE)
    assert pose == pytest.approx([0.8, 0.0, 0.0], abs=0.02)
    assert covariance[0, 0] == pytest.approx(WIDE[0, 0], rel=0.2)
    assert covariance[1, 1] < 0.1 * WIDE[1, 1]


def test_without_end_points_or_without_a_map_the_prior_stands() -> None:
    empty = ParticleMaps(1, MapSettings(), WallSettings())
    guess = np.array([0.3, 0.2, 3.1])
    for maps, points in (
        (maps_of_a_room(), np.zeros((0, 4))),
        (empty, scan_points(rectangle_scan(HERE))),
    ):
        maps.insert([(np.zeros((0, 4)), np.tile(guess, (len(maps.tiles.tables), 1)))])
        pose, covariance, value, explained = maps.match(0, points, guess, guess, WIDE)
        assert pose == pytest.approx(guess) and covariance == pytest.approx(WIDE)
        assert value == 0.0 and explained == 0


def test_a_start_half_a_turn_away_from_the_prior_in_numbers_only_is_close() -> None:
    maps, points = maps_of_a_room(), scan_points(rectangle_scan(HERE, beams=91))
    prior = HERE.as_array() + np.array([0.0, 0.0, 2.0 * math.pi])
    pose, _, _, _ = maps.match(0, points, HERE.as_array(), prior, WIDE)
    assert pose == pytest.approx(HERE.as_array(), abs=0.01)


def test_heirs_of_a_map_match_as_it_does() -> None:
    maps = maps_of_a_room(count=3)
    points = scan_points(rectangle_scan(HERE, beams=91))
    maps.insert([(points, np.array([[0.0, 0.0, 0.0], HERE.as_array(), [5.0, 5.0, 1.0]]))])
    maps.inherit(np.array([1, 1, 1]))
    guess = HERE.as_array() + 0.03
    found = [maps.match(i, points, guess, guess, WIDE)[0].tolist() for i in range(3)]
    assert found[0] == found[1] == found[2]
    assert (maps.tiles.tables[0] == maps.tiles.tables[2]).all()


def test_a_cell_keeps_its_mean_however_often_it_is_hit() -> None:
    maps = ParticleMaps(1, MapSettings(), WallSettings())
    point = np.array([[1.04, 0.53, -1.0, 0.0]])
    for _ in range(3):
        maps.insert([(point, np.zeros((1, 3)))] * MOST_HITS)
    hit = maps.tiles.pool[maps.tiles.pool[..., HITS] > 0]
    assert len(hit) == 1 and MOST_HITS // 2 <= hit[0, HITS] <= MOST_HITS
    # The solid lies 0.05 m behind, in the cell from 1.0 to 1.1 m; its centre is at (1.05, 0.55).
    parts = hit[0, [OFFSET_X, OFFSET_Y]] / hit[0, HITS]
    assert parts == pytest.approx([-0.01 / 0.1 * 200, -0.02 / 0.1 * 200], abs=1.0)
    assert hit[0, FIRST] == 1


def shifted_room(x: float, scans: int) -> ParticleMaps:
    """The room as others have it who are off by `x` [m]."""
    others = ParticleMaps(1, MapSettings(), WallSettings())
    points = scan_points(rectangle_scan(HERE, beams=91))
    others.insert((points, HERE.as_array()[np.newaxis] + [x, 0.0, 0.0]) for _ in range(scans))
    return others


def test_what_others_saw_places_a_scan_where_the_own_map_is_empty() -> None:
    empty = ParticleMaps(1, MapSettings(), WallSettings())
    points = scan_points(rectangle_scan(HERE, beams=91))
    guess = HERE.as_array() + 0.06
    empty.others = shifted_room(0.02, 6)
    pose, covariance, value, explained = empty.match(0, points, guess, guess, WIDE)
    assert pose == pytest.approx((HERE.x + 0.02, HERE.y, HERE.theta), abs=0.01)
    assert np.trace(covariance) < 0.01 * np.trace(WIDE) and value > 0.0
    assert explained == 0, "the own map explains nothing"


def test_a_scan_that_both_maps_know_comes_to_lie_between() -> None:
    points = scan_points(rectangle_scan(HERE, beams=91))
    guess = HERE.as_array()
    maps = maps_of_a_room(scans=8)
    maps.others = shifted_room(0.06, 8)
    pose, _, _, explained = maps.match(0, points, guess, guess, WIDE)
    assert 0.01 < pose[0] - HERE.x < 0.055
    assert abs(pose[1] - HERE.y) < 0.01
    assert explained > 0.8 * len(points)


def test_others_who_saw_nothing_change_nothing() -> None:
    maps, points = maps_of_a_room(), scan_points(rectangle_scan(HERE, beams=91))
    guess = HERE.as_array() + 0.03
    alone = maps.match(0, points, guess, guess, WIDE)
    maps.others = ParticleMaps(1, MapSettings(), WallSettings())
    together = maps.match(0, points, guess, guess, WIDE)
    assert alone[0].tolist() == together[0].tolist() and alone[2] == together[2]
