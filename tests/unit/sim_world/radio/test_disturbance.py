from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sim_world.radio.disturbance import Disturbance
from sim_world.radio.settings import RadioSettings


def disturbance(seed: int = 1, **settings: Any) -> Disturbance:
    return Disturbance(RadioSettings(**settings), np.random.default_rng(seed))


def test_an_undisturbed_frame_arrives_when_it_is_through_and_draws_nothing() -> None:
    rng = np.random.default_rng(1)
    air = Disturbance(RadioSettings(), rng)
    assert not air.lost()
    assert air.arrivals("a", "b", 3.0) == [3.0]
    assert rng.random() == np.random.default_rng(1).random()


def test_loss_is_never_always_or_as_often_as_set() -> None:
    assert all(disturbance(loss=1.0).lost() for _ in range(10))
    air = disturbance(loss=0.25)
    assert sum(air.lost() for _ in range(4000)) == pytest.approx(1000, abs=110)


def test_jitter_spreads_arrivals_but_keeps_the_order_of_a_link() -> None:
    air = disturbance(latency_s=0.1, jitter_s=0.5)
    arrivals = [air.arrivals("a", "b", 0.01 * k)[0] for k in range(200)]
    assert arrivals == sorted(arrivals)
    delays = np.array(arrivals) - 0.01 * np.arange(200)
    assert delays.min() >= 0.1
    assert delays.max() <= 0.6
    assert np.ptp(delays) > 0.2
    other = [air.arrivals("a", "c", 0.0)[0] for _ in range(50)]
    assert min(other) < 0.5  # another link does not wait for this one


def test_a_frame_that_is_held_back_is_overtaken() -> None:
    air = disturbance(reordering=0.3, reordering_delay_s=1.0)
    arrivals = [air.arrivals("a", "b", 0.1 * k)[0] for k in range(300)]
    delays = np.array(arrivals) - 0.1 * np.arange(300)
    assert delays.min() >= -1e-9
    assert delays.max() <= 1.0
    assert (delays > 1e-9).mean() == pytest.approx(0.3, abs=0.1)
    assert arrivals != sorted(arrivals)


def test_a_duplicate_comes_no_earlier_than_the_frame() -> None:
    first, second = disturbance(duplication=1.0, jitter_s=0.4).arrivals("a", "b", 1.0)
    assert first <= second <= first + 0.4
    assert disturbance(duplication=1.0).arrivals("a", "b", 1.0) == [1.0, 1.0]
