from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.codec import Frame, Header
from sim_world.radio.ledger import Ledger, Tally
from sim_world.radio.partitions import Outage
from sim_world.radio.relay import Relay, build_relay
from sim_world.radio.settings import RadioSettings
from sim_world.radio.shadowing import Place
from tests.unit.rooms import room

FRAME: Frame = [b"12345", b"678"]  # 64 bits
ROBOTS = ("robot1", "robot2", "robot3")
PLACES: dict[str, Place] = {
    "server": (0.0, 0.0),
    "robot1": (1.0, 0.0),
    "robot2": (2.0, 0.0),
    "robot3": (9.0, 0.0),
}
STEP = 0.1


def header(to: str, source: str = "robot1", kind: str = "bid") -> Header:
    return Header(kind, source, to, 1, 0.0)


def relay_of(*outages: Outage, seed: int = 1, **settings: Any) -> Relay:
    rng = np.random.default_rng(seed)
    return build_relay(ROBOTS, RadioSettings(**settings), room(), rng, outages)


def say(relay: Relay, sender: str, to: str, now: float, frame: Frame = FRAME) -> None:
    relay.carry(sender, header(to, sender), frame, now)


def said(relay: Relay, sender: str, to: str, now: float = 0.0) -> list[str]:
    """Who gets a frame at once."""
    say(relay, sender, to, now)
    return [receiver for receiver, _ in relay.due(now)]


def instant(relay: Relay, now: float) -> list[str]:
    """Who gets something at an instant."""
    relay.advance(now, PLACES)
    return [receiver for receiver, _ in relay.due(now)]


def total(book: dict[tuple[str, str, str], Tally]) -> int:
    return sum(tally.count for tally in book.values())


def test_a_frame_for_the_server_or_one_robot_reaches_just_that() -> None:
    relay = relay_of()
    assert relay.at_once
    assert said(relay, "robot1", "server") == ["server"]
    assert said(relay, "server", "robot2") == ["robot2"]
    assert said(relay, "robot1", "robot3") == ["robot3"]


def test_a_frame_for_everyone_reaches_all_robots_but_its_sender() -> None:
    relay = relay_of()
    assert said(relay, "robot2", "*") == ["robot1", "robot3"]
    assert said(relay, "server", "*") == list(ROBOTS)


def test_a_frame_for_everyone_reaches_the_server_when_it_listens() -> None:
    relay = relay_of()
    relay.switch_on("server")
    assert said(relay, "robot2", "*") == ["robot1", "robot3", "server"]
    assert said(relay, "server", "*") == list(ROBOTS)


def test_a_frame_for_everyone_is_on_the_air_once() -> None:
    relay = relay_of()
    said(relay, "robot2", "*")
    assert relay.ledger.aired == {("robot2", "bid"): Tally(1, 8)}
    assert total(relay.ledger.sent) == 2


def test_a_frame_for_nobody_we_know_is_not_counted() -> None:
    relay = relay_of()
    assert said(relay, "robot1", "robot9") == []
    assert relay.ledger == Ledger()


def test_every_byte_is_entered_by_link_and_type() -> None:
    relay = relay_of()
    said(relay, "robot1", "server")
    said(relay, "robot1", "server", 0.1)
    assert relay.ledger.sent == {("robot1", "server", "bid"): Tally(2, 16)}
    assert relay.ledger.delivered == relay.ledger.sent
    assert relay.ledger.lost == relay.queued() == {}


def test_during_an_outage_nothing_comes_through_either_way() -> None:
    relay = relay_of(Outage("robot1", 1.0, 2.0))
    assert said(relay, "robot1", "server", 0.9) == ["server"]
    assert said(relay, "robot1", "server", 1.0) == []
    assert said(relay, "server", "robot1", 1.9) == []
    assert said(relay, "server", "*", 1.5) == ["robot2", "robot3"]
    assert said(relay, "server", "robot1", 2.0) == ["robot1"]
    assert relay.ledger.lost["robot1", "server", "bid"] == Tally(1, 8)


def test_with_time_enough_a_frame_arrives_as_early_as_over_a_perfect_radio() -> None:
    relay = relay_of(model="disc", range_m=5.0, latency_s=0.05)
    assert not relay.at_once
    say(relay, "robot1", "*", 0.1)
    assert instant(relay, 0.1) == ["robot2"]
    assert total(relay.ledger.lost) == 1  # robot3 is too far away


def test_latency_counts_from_the_instant_at_which_it_was_said() -> None:
    relay = relay_of(latency_s=0.25)
    instant(relay, 0.1)
    say(relay, "robot1", "robot2", 0.2)
    assert instant(relay, 0.2) == []
    assert total(relay.queued()) == 1
    assert instant(relay, 0.3) == []
    assert instant(relay, 0.4) == ["robot2"]
    assert relay.queued() == {}


def test_a_frame_longer_than_an_instant_arrives_later() -> None:
    relay = relay_of(capacity_bit_s=256.0)  # 64 bits take 0.25 s
    say(relay, "robot1", "robot2", 0.1)
    say(relay, "robot3", "robot2", 0.1)
    arrived = {round(k * STEP, 6): instant(relay, k * STEP) for k in range(1, 7)}
    assert [now for now, names in arrived.items() if names] == [0.3, 0.5]
    assert relay.ledger.aired == {("robot1", "bid"): Tally(1, 8), ("robot3", "bid"): Tally(1, 8)}


def test_what_waits_is_counted_for_each_receiver() -> None:
    relay = relay_of(capacity_bit_s=1.0)
    say(relay, "robot1", "*", 0.1)
    instant(relay, 0.1)
    key = ("robot1", "robot2", "bid")
    assert relay.queued() == {key: Tally(1, 8), ("robot1", "robot3", "bid"): Tally(1, 8)}
    assert relay.ledger.aired == {}


def test_a_full_radio_loses_what_it_is_handed() -> None:
    relay = relay_of(capacity_bit_s=640.0, queue_max_bytes=16)
    for _ in range(3):
        say(relay, "robot1", "robot2", 0.1)
    say(relay, "robot3", "robot2", 0.1)
    assert relay.ledger.lost == {("robot1", "robot2", "bid"): Tally(1, 8)}
    assert instant(relay, 0.1) == ["robot2"]
    say(relay, "robot1", "robot2", 0.2)  # there is room again
    assert total(relay.ledger.lost) == 1


def test_a_frame_that_is_longer_than_the_queue_is_sent_when_nothing_else_waits() -> None:
    relay = relay_of(capacity_bit_s=640.0, queue_max_bytes=2)
    say(relay, "robot1", "robot2", 0.1)
    say(relay, "robot1", "robot2", 0.1)
    assert instant(relay, 0.1) == ["robot2"]
    assert total(relay.ledger.lost) == 1


def test_a_radio_that_is_switched_off_loses_what_waits_and_what_arrives() -> None:
    relay = relay_of(capacity_bit_s=64 / STEP, latency_s=STEP)
    say(relay, "robot1", "robot2", 0.1)
    say(relay, "robot1", "robot2", 0.1)
    say(relay, "robot3", "robot1", 0.1)
    assert instant(relay, 0.1) == []  # one of robot1's is on its way
    relay.switch_off("robot1")
    assert relay.ledger.lost == {("robot1", "robot2", "bid"): Tally(1, 8)}
    assert instant(relay, 0.2) == ["robot2"]
    assert instant(relay, 0.3) == []
    assert relay.ledger.lost["robot3", "robot1", "bid"] == Tally(1, 8)
    relay.switch_on("robot1")
    say(relay, "robot3", "robot1", 0.4)
    assert [instant(relay, t) for t in (0.4, 0.5)] == [[], ["robot1"]]


def test_a_link_carries_one_way_only() -> None:
    relay = relay_of(one_way=({"speaker": "server", "listener": "robot1"},))
    assert said(relay, "server", "robot1") == ["robot1"]
    assert said(relay, "robot1", "server") == []
    assert said(relay, "robot1", "robot2") == ["robot2"]


def test_a_partition_keeps_groups_apart_for_its_time() -> None:
    parted = {"start_s": 1.0, "duration_s": 1.0, "groups": (("robot1", "robot2"),)}
    relay = relay_of(partitions=(parted,))
    relay.switch_on("server")
    assert said(relay, "robot1", "*", 0.9) == ["robot2", "robot3", "server"]
    assert said(relay, "robot1", "*", 1.0) == ["robot2"]
    assert said(relay, "robot3", "*", 1.5) == ["server"]
    assert said(relay, "robot3", "*", 2.0) == ["robot1", "robot2", "server"]


def test_a_wired_server_hears_everybody_at_once_and_takes_no_airtime() -> None:
    relay = relay_of(model="disc", range_m=0.5, capacity_bit_s=1.0, loss=1.0, server_place="wired")
    relay.switch_on("server")
    say(relay, "robot3", "*", 0.1)
    say(relay, "server", "robot1", 0.1)
    assert instant(relay, 0.1) == ["server", "robot1"]
    assert relay.ledger.aired == {}
    assert set(relay.queued()) == {("robot3", "robot1", "bid"), ("robot3", "robot2", "bid")}


def test_about_as_much_is_lost_and_doubled_as_is_set() -> None:
    relay = relay_of(loss=0.2, duplication=0.1)
    for _ in range(2000):
        say(relay, "robot1", "robot2", 0.1)
    arrived = len(instant(relay, 0.1))
    lost, doubled = total(relay.ledger.lost), total(relay.ledger.duplicated)
    assert lost == pytest.approx(400, abs=60)
    assert doubled == pytest.approx(160, abs=40)
    assert arrived == 2000 - lost + doubled


SENDS = st.lists(
    st.tuples(
        st.sampled_from([*ROBOTS, "server"]),
        st.sampled_from([*ROBOTS, "server", "*", "stranger"]),
        st.integers(1, 20),
        st.integers(0, 400),
    ),
    max_size=30,
)
RARELY = st.sampled_from([0.0, 0.3, 1.0])
SETTINGS = st.fixed_dictionaries(
    {
        "model": st.sampled_from(["perfect", "disc", "path_loss"]),
        "server_place": st.sampled_from(["first_start", "wired"]),
        "range_m": st.sampled_from([1.5, 5.0]),
        "capacity_bit_s": st.sampled_from([None, 1000.0, 20000.0]),
        "turn_bytes": st.sampled_from([10, 1500]),
        "queue_max_bytes": st.sampled_from([300, 100_000]),
        "latency_s": st.sampled_from([0.0, 0.15]),
        "jitter_s": st.sampled_from([0.0, 0.3]),
        "loss": RARELY,
        "duplication": RARELY,
        "reordering": RARELY,
    }
)


@given(SENDS, SETTINGS)
def test_the_books_balance_and_nothing_arrives_that_cannot(
    sends: list[tuple[str, str, int, int]], given_settings: dict[str, Any]
) -> None:
    settings = {
        **given_settings,
        "partitions": ({"start_s": 0.6, "duration_s": 0.4, "groups": (("robot1",),)},),
        "one_way": ({"speaker": "robot1", "listener": "robot2"},),
    }
    cuts = (Outage("robot1", 0.2, 0.5), Outage("robot3", 1.0, 1.2))
    relay = relay_of(*cuts, **settings)
    relay.switch_on("server")
    said_at: dict[bytes, float] = {}
    arrived: Counter[tuple[str, str]] = Counter()
    for k in range(1, 31):
        now = round(k * STEP, 6)
        for number, (sender, to, at, size) in enumerate(sends):
            if at == k:
                mark = f"{number}.{sender}".encode()
                said_at[mark] = now - STEP
                relay.carry(sender, header(to, sender), [mark, bytes(size)], now)
        relay.advance(now, PLACES)
        if k == 15:
            relay.switch_off("robot2")
        if k == 18:
            relay.switch_on("robot2")
        for receiver, frame in relay.due(now):
            sender = frame[0].split(b".")[1].decode()
            arrived[sender, receiver] += 1
            wired = settings["server_place"] == "wired" and "server" in (sender, receiver)
            if not wired:
                assert now + 1e-6 >= said_at[frame[0]] + settings["latency_s"]
                assert (sender, receiver) != ("robot2", "robot1")
            if settings["model"] == "disc" and not wired:
                gap = abs(PLACES[sender][0] - PLACES[receiver][0])
                assert gap <= settings["range_m"]
            assert not (receiver == "robot1" and 0.2 <= now < 0.5)
            assert not (receiver == "robot2" and 1.5 <= now < 1.8)
    books, queued, none = relay.ledger, relay.queued(), Tally()
    assert set(books.delivered) | set(books.lost) | set(queued) == set(books.sent)
    for key, sent in books.sent.items():
        came = [book.get(key, none) for book in (books.delivered, books.lost, queued)]
        extra = books.duplicated.get(key, none)
        assert sent.count + extra.count == sum(tally.count for tally in came)
        assert sent.bytes + extra.bytes == sum(tally.bytes for tally in came)
    for link, count in arrived.items():
        entered = [t.count for key, t in books.delivered.items() if key[:2] == link]
        assert sum(entered) == count


def test_the_same_seed_gives_the_same_fates() -> None:
    def fates(seed: int) -> list[list[str]]:
        settings = {"loss": 0.3, "jitter_s": 0.4, "duplication": 0.2, "reordering": 0.2}
        relay = relay_of(seed=seed, **settings)
        heard = []
        for k in range(1, 20):
            say(relay, "robot1", "*", k * STEP)
            say(relay, "server", "robot3", k * STEP)
            heard.append(instant(relay, k * STEP))
        return heard

    assert fates(3) == fates(3)
    assert fates(3) != fates(4)
