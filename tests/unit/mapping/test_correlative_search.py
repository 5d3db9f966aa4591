from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.correlative_search import (
    BLOCK,
    SearchWindow,
    _keep,
    running_maximum,
    search,
)
from mapping.geometry import Pose2, wrap_angle
from mapping.match_map import MapSettings, MatchMap
from mapping.scan_points import scan_points
from mapping.search_image import SearchSettings, score_image
from tests.unit.mapping.rectangle import rectangle_scan

VAGUE = np.diag([1.0, 1.0, 1.0]) * 1e-3

# Where the room lies in the map: off the lattice. A wall on the line between two rows of cells
# would fall into one or the other by rounding alone.
ROOM = Pose2(0.04, 0.03, 0.0)


@pytest.fixture(scope="module")
def room() -> MatchMap:
    built = MatchMap(MapSettings(resolution=0.1))
    for x, theta in ((1.5, 0.0), (2.5, 1.0), (3.0, 2.0)):
        pose = Pose2(x, 1.2, theta)
        built.insert(rectangle_scan(pose, beams=60), ROOM @ pose)
    return built


def look(room: MatchMap, pose: Pose2, guess: Pose2, window: SearchWindow, **chosen):
    """Search around a guess; poses are in the room."""
    points = scan_points(rectangle_scan(pose, beams=24))
    found = search(
        room.grid, room.surfaces, points, ROOM @ guess, window, VAGUE, 1.0, SearchSettings(**chosen)
    )
    return [ROOM.inverse() @ T for T in found]


def test_a_kidnapped_guess_is_found_again(room):
    pose = Pose2(2.0, 1.5, 0.4)
    guess = Pose2(2.5, 1.1, 0.4 + math.radians(15.0))
    found = look(room, pose, guess, SearchWindow(0.7, math.radians(18.0), math.radians(3.0)))
    # The true pose is one of the lattice's; a neighbour may score as well, none farther off.
    assert max(abs(found[0].x - pose.x), abs(found[0].y - pose.y)) < 0.1 + 1e-9
    assert abs(wrap_angle(found[0].theta - pose.theta)) < math.radians(3.0) + 1e-9


@pytest.mark.parametrize("bounded_from", [0.0, 1e9])
def test_the_best_of_the_whole_lattice_is_found(room, bounded_from):
    pose, guess = Pose2(2.0, 1.5, 0.4), Pose2(2.2, 1.4, 0.5)
    window = SearchWindow(0.4, 0.2, 0.1)
    points = scan_points(rectangle_scan(pose, beams=24))
    best = look(room, pose, guess, window, candidates=1, bounded_from=bounded_from)[0]
    chosen = SearchSettings()
    image, unit = score_image(room.grid.log_odds, room.surfaces.squared, 0.1, chosen)

    def score(T: Pose2) -> float:
        from mapping.scan_points import turned_points
        from mapping.surface_map import layer_of

        # As the search does: turn first, then shift by whole cells.
        turned = turned_points(points, ROOM @ Pose2(guess.x, guess.y, T.theta))
        cells = room.grid.geometry.cells_at(turned[:, :2])
        cells[:, 0] += round((T.y - guess.y) / 0.1)
        cells[:, 1] += round((T.x - guess.x) / 0.1)
        offset = np.array([T.x - guess.x, T.y - guess.y, T.theta - guess.theta])
        total = -0.5 * offset @ VAGUE @ offset
        for (iy, ix), (_, _, nx, ny) in zip(cells, turned, strict=True):
            inside = room.grid.geometry.holds(iy, ix)
            neutral = 255.0 + math.log(chosen.unknown) / unit
            total += unit * (int(image[layer_of(nx, ny), iy, ix]) if inside else round(neutral))
        return total

    brute = max(
        score(Pose2(guess.x + 0.1 * i, guess.y + 0.1 * j, guess.theta + 0.1 * k))
        for i in range(-4, 5)
        for j in range(-4, 5)
        for k in range(-2, 3)
    )
    assert score(best) == pytest.approx(brute, abs=1e-9)


def test_several_starts_are_apart(room):
    found = look(room, Pose2(2.0, 1.5, 0.0), Pose2(2.0, 1.5, 0.0), SearchWindow(0.8, 0.1, 0.05))
    assert len(found) == 3
    for i in range(3):
        for j in range(i):
            turn = abs(wrap_angle(found[i].theta - found[j].theta))
            apart = max(abs(found[i].x - found[j].x), abs(found[i].y - found[j].y))
            assert apart >= 0.25 or turn >= 0.07


def test_the_prior_decides_where_nothing_is_known():
    built = MatchMap(MapSettings(resolution=0.1))
    guess = Pose2(5.0, 5.0, 0.3)
    found = search(
        built.grid, built.surfaces, scan_points(rectangle_scan(Pose2(2.0, 1.0, 0.0), beams=12)),
        guess, SearchWindow(0.5, 0.1, 0.05), np.eye(3), 1.0, SearchSettings(),
    )  # fmt: skip
    assert found[0].distance_to(guess) < 1e-9


def test_many_beams_are_thinned_evenly(room):
    pose = Pose2(2.0, 1.5, 0.4)
    points = scan_points(rectangle_scan(pose, beams=48))
    window = SearchWindow(0.3, 0.1, 0.05)
    found = search(
        room.grid, room.surfaces, points, ROOM @ Pose2(2.2, 1.4, 0.4), window, VAGUE, 1.0,
        SearchSettings(beams=20),
    )  # fmt: skip
    best = ROOM.inverse() @ found[0]
    # With fewer beams a neighbour on the lattice may score as well, none farther off.
    assert max(abs(best.x - pose.x), abs(best.y - pose.y)) < 0.1 + 1e-9


def test_scores_fall_with_the_distance_and_are_neutral_where_unknown():
    log_odds = np.array([[-1.0, -1.0, -1.0, 0.0]], dtype=np.float32)
    squared = np.array([[[0, 1, 255, 255]], [[255, 255, 255, 0]]], dtype=np.uint8)
    chosen = SearchSettings()
    image, unit = score_image(log_odds, squared, 0.1, chosen)
    assert image[0, 0, 0] == image[1, 0, 3] == 255
    assert image[0, 0, 0] > image[0, 0, 1] > image[0, 0, 2] == 0
    assert unit * (255 - image[0, 0, 3]) == pytest.approx(-math.log(chosen.unknown), abs=unit)


def test_therunning_maximum_covers_the_block_that_starts_there():
    image = np.random.default_rng(2).integers(0, 255, (2, 13, 17)).astype(np.uint8)
    highest = running_maximum(image, BLOCK)
    for k in range(2):
        for iy in range(13):
            for ix in range(17):
                block = image[k, iy : iy + BLOCK, ix : ix + BLOCK]
                assert highest[k, iy, ix] == block.max()


def test_candidates_are_kept_sorted_and_apart():
    found = np.empty((3, 4))
    count = 0
    for x, score in ((0.0, 1.0), (1.0, 3.0), (0.1, 2.0), (1.1, 2.5), (5.0, 0.5), (6.0, 0.1)):
        count = _keep(found, count, (x, 0.0, 0.0, score))
    assert count == 3
    assert found[:, 0].tolist() == [1.0, 0.1, 5.0]
    assert _keep(found, count, (9.0, 0.0, 0.0, 2.2)) == 3
    assert found[:, 0].tolist() == [1.0, 9.0, 0.1]
