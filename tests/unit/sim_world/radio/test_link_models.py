from __future__ import annotations

from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry import Pose2
from sim_world.radio.link_models import LINK_MODELS, PathLoss, link_model
from sim_world.radio.settings import RadioSettings
from sim_world.scene import WallScene
from sim_world.walls import build_walls


class CountingScene(WallScene):
    """Two thick walls across the x axis, at 5 m and 10 m, and how often somebody counted them."""

    asked = 0

    def __init__(self) -> None:
        walls = [[(x, -50.0), (x + 0.2, -50.0), (x + 0.2, 50.0), (x, 50.0)] for x in (5.0, 10.0)]
        super().__init__(build_walls(walls))

    def walls_between(self, x1: float, y1: float, x2: float, y2: float) -> int:
        self.asked += 1
        return super().walls_between(x1, y1, x2, y2)


def path_loss(scene: CountingScene | None = None, seed: int = 1, **settings: Any) -> PathLoss:
    given_settings = {"fading_sigma_db": 0.0, "path_loss_exponent": 2.0, **settings}
    return PathLoss(RadioSettings(**given_settings), scene or CountingScene(), seed)


def test_every_model_that_can_be_set_is_in_the_table() -> None:
    named = get_args(RadioSettings.model_fields["model"].annotation)
    assert sorted(named) == sorted(LINK_MODELS)


@pytest.mark.parametrize("name", LINK_MODELS)
def test_every_model_reaches_whoever_stands_beside(name: str) -> None:
    settings = RadioSettings.model_validate({"model": name, "fading_sigma_db": 0.0})
    model = link_model(settings, CountingScene(), 1)
    assert model.reaches("a", "b", {"a": (0.0, 0.0), "b": (0.5, 0.0)})


def test_perfect_reaches_any_place_and_disc_up_to_its_range() -> None:
    far = {"a": (0.0, 0.0), "b": (3.0, 4.0), "c": (3.0, 4.01)}
    scene = CountingScene()
    assert link_model(RadioSettings(), scene, 1).reaches("a", "c", far)
    disc = link_model(RadioSettings(model="disc", range_m=5.0), scene, 1)
    assert disc.reaches("a", "b", far)
    assert not disc.reaches("a", "c", far)
    assert scene.asked == 0


def test_the_signal_loses_strength_with_distance_and_with_each_wall() -> None:
    model = path_loss()
    strengths = [model.strength("a", "b", (0.0, 0.0), (x, 0.0)) for x in (0.1, 1.0, 4.0, 8.0, 20.0)]
    # 15 dBm less 40 dB less 20 log10 of the distance, less 3.1 dB a wall.
    expected = [-25.0, -25.0, -37.041, -43.062 - 3.1, -51.021 - 6.2]
    assert strengths == pytest.approx(expected, abs=0.001)


def test_walls_beyond_the_most_take_nothing_more_and_none_are_counted_for_nothing() -> None:
    one = path_loss(walls_max=1)
    assert one.strength("a", "b", (0.0, 0.0), (20.0, 0.0)) == pytest.approx(-54.121, abs=0.001)
    scene = CountingScene()
    for settings in ({"walls_max": 0}, {"wall_loss_db": 0.0}):
        model = path_loss(scene, **settings)
        assert model.strength("a", "b", (0.0, 0.0), (20.0, 0.0)) == pytest.approx(-51.021, abs=1e-3)
    assert scene.asked == 0


def test_in_reach_is_who_gets_the_floor() -> None:
    places = {"a": (0.0, 0.0), "b": (4.0, 0.0), "c": (6.0, 0.0)}
    model = path_loss(receiver_floor_dbm=-40.0)
    assert model.reaches("a", "b", places)
    assert not model.reaches("a", "c", places)  # -40.6 dBm less a wall
    assert model.reaches("b", "a", places)


def test_walls_are_counted_again_only_when_somebody_has_moved() -> None:
    scene = CountingScene()
    model = path_loss(scene)
    for x in (7.0, 7.04, 7.09, 7.0):
        model.strength("a", "b", (0.0, 0.0), (x, 0.0))
        model.strength("b", "a", (x, 0.0), (0.0, 0.0))
    assert scene.asked == 1
    model.strength("a", "b", (0.0, 0.0), (7.11, 0.0))
    model.strength("a", "c", (0.0, 0.0), (7.11, 0.0))
    assert scene.asked == 3


def test_fading_is_of_the_places_and_the_seed() -> None:
    def strengths(seed: int) -> list[float]:
        model = path_loss(seed=seed, fading_sigma_db=4.0)
        return [model.strength("a", "b", (0.0, 0.0), (float(x), 0.0)) for x in range(2, 40)]

    assert strengths(1) == strengths(1)
    assert strengths(1) != strengths(2)
    still = [path_loss().strength("a", "b", (0.0, 0.0), (float(x), 0.0)) for x in range(2, 40)]
    off = [a - b for a, b in zip(strengths(1), still, strict=True)]
    assert 2.0 < (sum(d * d for d in off) / len(off)) ** 0.5 < 6.0


@given(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
def test_a_signal_is_as_strong_both_ways(x1: float, x2: float, y2: float) -> None:
    a, b = (x1, 0.0), (x2, y2)
    there = path_loss(fading_sigma_db=4.0).strength("a", "b", a, b)
    assert path_loss(fading_sigma_db=4.0).strength("b", "a", b, a) == there


def test_the_antenna_stands_at_the_first_start_or_where_it_is_set() -> None:
    start = Pose2(3.0, 4.0, 1.0)
    assert RadioSettings().antenna(start) == (3.0, 4.0)
    assert RadioSettings(server_place=(1.0, 2.0)).antenna(start) == (1.0, 2.0)


def test_the_defaults_reach_as_far_as_they_are_said_to() -> None:
    places = {"a": (0.0, 0.0), "b": (0.0, 79.0), "c": (0.0, 80.0)}
    walls = [[(2.0 + x, -9.0), (2.1 + x, -9.0), (2.1 + x, 9.0), (2.0 + x, 9.0)] for x in range(5)]
    model = PathLoss(RadioSettings(fading_sigma_db=0.0), WallScene(build_walls(walls)), 1)
    assert model.reaches("a", "b", places)
    assert not model.reaches("a", "c", places)
    assert model.reaches("a", "d", {**places, "d": (30.0, 0.0)})
    assert not model.reaches("a", "e", {**places, "e": (31.0, 0.0)})
