from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.beam_coding import (
    NOISES,
    decode_beams,
    encode_beams,
    nearest_noise,
    ranging,
    rays_of,
    shown_noise,
)
from mapping.range_cells import NO_RETURN, TO_IGNORE

STEP = math.radians(1.0)
SENSOR = ranging(0.02, 400, 9)


def cells_of_wall(beams: int, sigma: float, seed: int = 1) -> np.ndarray:
    bearings = STEP * (np.arange(beams) - beams / 2)
    noise = sigma * np.random.default_rng(seed).standard_normal(beams)
    return np.floor((2.0 / np.cos(bearings) + noise) / 0.02).astype(np.int32)


def there_and_back(cells: np.ndarray, sensor=SENSOR, step: float = STEP) -> int:
    rays = rays_of(len(cells), step)
    data = encode_beams(cells, sensor, rays)
    back, asked = decode_beams(data, sensor, rays)
    np.testing.assert_array_equal(back, cells)
    assert asked >= len(data)
    return len(data)


@settings(max_examples=40)
@given(
    st.lists(st.integers(-2, 399), min_size=1, max_size=40),
    st.integers(0, NOISES - 1),
    st.floats(-6.3, 6.3),
)
def test_any_cells_come_back(cells, noise, step):
    there_and_back(np.array(cells, dtype=np.int32), ranging(0.02, 400, noise), step)


@pytest.mark.parametrize("count", [1, 2, 65536])
def test_few_and_many_cells_come_back(count):
    cells = np.array([0, count - 1, NO_RETURN, TO_IGNORE, count // 2] * 4, dtype=np.int32)
    there_and_back(cells, ranging(0.02, count, 4))


def test_a_wall_costs_little_more_than_its_noise():
    # 0.5 log2(2 pi e) + log2(30 / 20) bits a beam, and some for where the wall is.
    sizes = [there_and_back(cells_of_wall(60, 0.03, seed)) for seed in range(5)]
    assert np.mean(sizes) < 60 * 2.63 / 8 + 4.0


def test_runs_without_a_return_and_masked_runs_cost_little():
    wall = cells_of_wall(60, 0.03)
    for special in (NO_RETURN, TO_IGNORE):
        holed = wall.copy()
        holed[20:50] = special
        assert there_and_back(holed) < 0.75 * there_and_back(wall)
        assert there_and_back(np.full(60, special, dtype=np.int32)) <= 6


@pytest.mark.parametrize("sigma", [0.01, 0.03, 0.06])
def test_a_scan_shows_its_noise(sigma):
    shown = shown_noise(cells_of_wall(120, sigma))
    assert abs(shown - nearest_noise(sigma, 0.02)) <= 1


def test_a_scan_without_readings_shows_no_noise():
    assert shown_noise(np.full(30, NO_RETURN, dtype=np.int32)) == NOISES // 2
    assert shown_noise(np.zeros(1, dtype=np.int32)) == NOISES // 2


def test_noises_are_a_ladder():
    sigmas = [math.sqrt(ranging(0.02, 400, n).variance) for n in range(NOISES)]
    assert [nearest_noise(sigma, 0.02) for sigma in sigmas] == list(range(NOISES))
    assert nearest_noise(0.0, 0.02) == 0
    assert nearest_noise(5.0, 0.02) == NOISES - 1


@pytest.mark.parametrize("step", [0.0, STEP, -0.3, 2.0 * math.pi])
def test_rays_are_cosines_and_sines(step):
    angles = step * np.arange(50)
    np.testing.assert_allclose(
        rays_of(50, step), np.column_stack((np.cos(angles), np.sin(angles))), atol=1e-11
    )


@settings(max_examples=40)
@given(st.binary(max_size=40), st.integers(0, NOISES - 1), st.integers(1, 65536))
def test_any_bytes_are_some_cells(data, noise, count):
    cells, _ = decode_beams(data, ranging(0.02, count, noise), rays_of(40, 0.1))
    assert ((cells >= -2) & (cells < count)).all()
