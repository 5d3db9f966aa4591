from __future__ import annotations

import numpy as np

from protocol.log.announcing import Announcing


def announcing() -> Announcing:
    return Announcing(5.0, 40.0, np.random.default_rng(0), 0.0)


def ends(timer: Announcing, count: int) -> list[bool]:
    """Let so many intervals pass; return in which it spoke."""
    return [timer.speak(timer.due) for _ in range(count)]


def test_a_member_that_is_alone_speaks_ever_more_rarely() -> None:
    timer = announcing()
    times = []
    for _ in range(7):
        times.append(timer.due)
        assert timer.speak(timer.due)
    begins = [0.0, 5.0, 15.0, 35.0, 75.0, 115.0, 155.0]
    lengths = [5.0, 10.0, 20.0, 40.0, 40.0, 40.0, 40.0]
    for at, begin, length in zip(times, begins, lengths, strict=True):
        assert begin + length / 2 <= at <= begin + length


def test_it_is_silent_when_another_spoke_for_it() -> None:
    timer = announcing()
    timer.hear(covers=True, lacks=False, back=False, now=1.0)
    assert ends(timer, 2) == [False, True]


def test_it_is_not_silent_when_somebody_lacks_news() -> None:
    timer = announcing()
    timer.hear(covers=True, lacks=False, back=False, now=1.0)
    timer.hear(covers=False, lacks=True, back=False, now=1.0)
    assert ends(timer, 1) == [True]


def test_changes_and_news_begin_a_short_interval() -> None:
    timer = announcing()
    ends(timer, 4)
    timer.change(100.0)
    assert 102.5 <= timer.due <= 105.0
    timer.change(101.0)
    assert 102.5 <= timer.due <= 105.0
    ends(timer, 1)
    assert 107.5 <= timer.due <= 110.0
    ends(timer, 5)
    now = timer.due - 10.0
    timer.hear(covers=False, lacks=True, back=False, now=now)
    assert now + 2.5 <= timer.due <= now + 5.0
    assert ends(timer, 1) == [True]


def test_one_that_comes_back_is_told_soon() -> None:
    timer = announcing()
    ends(timer, 5)
    timer.contact(150.0)
    assert 150.2 <= timer.due <= 150.8
    timer.hear(covers=True, lacks=False, back=False, now=150.1)
    assert ends(timer, 1) == [True]
    timer.hear(covers=False, lacks=True, back=True, now=170.0)
    assert timer.due <= 170.8
