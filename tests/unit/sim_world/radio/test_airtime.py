from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_world.radio.airtime import Channel, Transmission


def item(sender: str, size: int) -> Transmission:
    return Transmission(sender, ("x",), "bid", [bytes(size)], size, 8.0 * size)


def through(channel: Channel, since: float, until: float) -> list[tuple[str, int, float]]:
    return [(t.sender, t.size, round(at, 9)) for t, at in channel.run(since, until)]


def test_frames_of_one_sender_go_in_order_each_after_its_airtime() -> None:
    channel = Channel(8000.0, 1500)  # 1 byte a millisecond
    channel.put(item("a", 30))
    channel.put(item("a", 50))
    channel.put(item("a", 40))
    assert through(channel, 0.0, 0.1) == [("a", 30, 0.03), ("a", 50, 0.08)]
    assert channel.held("a") == 40
    assert through(channel, 0.1, 0.2) == [("a", 40, 0.12)]
    assert channel.held("a") == 0


def test_time_in_which_nobody_sends_is_gone() -> None:
    channel = Channel(8000.0, 1500)
    assert through(channel, 0.0, 10.0) == []
    channel.put(item("a", 150))
    assert through(channel, 10.0, 10.1) == []
    assert through(channel, 10.1, 10.2) == [("a", 150, 10.15)]


def test_senders_take_turns_and_a_long_frame_lets_others_in_between() -> None:
    channel = Channel(8000.0, 10)
    channel.put(item("a", 30))
    channel.put(item("b", 10))
    channel.put(item("b", 10))
    channel.put(item("c", 5))
    assert through(channel, 0.0, 0.1) == [
        ("b", 10, 0.02),
        ("c", 5, 0.025),
        ("b", 10, 0.045),
        ("a", 30, 0.055),
    ]


def test_a_turn_goes_on_where_the_instant_broke_it_off() -> None:
    channel = Channel(8000.0, 10)
    channel.put(item("a", 20))
    channel.put(item("b", 10))
    assert through(channel, 0.0, 0.005) == []
    assert through(channel, 0.005, 0.03) == [("b", 10, 0.02), ("a", 20, 0.03)]


def test_a_channel_that_is_never_busy_carries_all_at_once() -> None:
    channel = Channel(None, 1)
    channel.put(item("a", 10**6))
    channel.put(item("b", 10))
    assert through(channel, 0.5, 0.5) == [("a", 10**6, 0.5), ("b", 10, 0.5)]


def test_what_is_dropped_is_out_of_the_round() -> None:
    channel = Channel(8000.0, 10)
    for sender in ("a", "b", "a", "c"):
        channel.put(item(sender, 20))
    assert through(channel, 0.0, 0.005) == []
    assert [t.sender for t in channel.drop("a")] == ["a", "a"]
    assert channel.drop("a") == channel.drop("nobody") == []
    assert [t.sender for t in channel.drop("c")] == ["c"]
    assert channel.held("a") == 0
    assert [t.sender for t in channel.waiting()] == ["b"]
    channel.put(item("a", 20))
    assert through(channel, 0.005, 1.0) == [("b", 20, 0.035), ("a", 20, 0.045)]


PUTS = st.tuples(st.sampled_from("abc"), st.integers(1, 300), st.integers(0, 9))


@given(st.lists(PUTS, max_size=25), st.sampled_from([3, 50, 1500]))
def test_no_more_is_carried_than_the_capacity_and_no_time_is_wasted(
    puts: list[tuple[str, int, int]], turn: int
) -> None:
    channel = Channel(8000.0, turn)
    carried: dict[str, list[int]] = {sender: [] for sender in "abc"}
    for k in range(10):
        for sender, size, at in puts:
            if at == k:
                channel.put(item(sender, size))
        left = sum(t.left for t in channel.waiting())
        ends = channel.run(0.1 * k, 0.1 * (k + 1))
        gone = left - sum(t.left for t in channel.waiting())
        assert gone == pytest.approx(min(left, 800.0), abs=0.1)
        times = [at for _, at in ends]
        assert times == sorted(times)
        assert all(0.1 * k - 1e-9 <= at <= 0.1 * (k + 1) + 1e-9 for at in times)
        for t, _ in ends:
            carried[t.sender].append(t.size)
    for sender in "abc":
        ordered = [size for k in range(10) for name, size, at in puts if (name, at) == (sender, k)]
        assert carried[sender] == ordered[: len(carried[sender])]
