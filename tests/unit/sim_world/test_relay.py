from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from protocol.codec import Frame, Header
from sim_world.relay import Ledger, Outage, Relay, Tally

FRAME: Frame = [b"12345", b"678"]
ROBOTS = ("robot1", "robot2", "robot3")


def header(to: str, source: str = "robot1", kind: str = "bid") -> Header:
    return Header(kind, source, to, 1, 0.0)


def test_a_frame_for_the_server_or_one_robot_reaches_just_that() -> None:
    relay = Relay(ROBOTS)
    assert relay.carry("robot1", header("server"), FRAME, 0.0) == ["server"]
    assert relay.carry("server", header("robot2"), FRAME, 0.0) == ["robot2"]
    assert relay.carry("robot1", header("robot3"), FRAME, 0.0) == ["robot3"]


def test_a_frame_for_everyone_reaches_all_robots_but_its_sender() -> None:
    relay = Relay(ROBOTS)
    assert relay.carry("robot2", header("*"), FRAME, 0.0) == ["robot1", "robot3"]
    assert relay.carry("server", header("*"), FRAME, 0.0) == list(ROBOTS)


def test_a_frame_for_nobody_we_know_is_not_counted() -> None:
    relay = Relay(ROBOTS)
    assert relay.carry("robot1", header("robot9"), FRAME, 0.0) == []
    assert relay.ledger == Ledger()


def test_every_byte_is_entered_by_link_and_type() -> None:
    relay = Relay(ROBOTS)
    relay.carry("robot1", header("server"), FRAME, 0.0)
    relay.carry("robot1", header("server"), FRAME, 0.1)
    assert relay.ledger.sent == {("robot1", "server", "bid"): Tally(2, 16)}
    assert relay.ledger.delivered == relay.ledger.sent
    assert relay.ledger.lost == {}


def test_during_an_outage_nothing_comes_through_either_way() -> None:
    relay = Relay(ROBOTS, (Outage("robot1", 1.0, 2.0),))
    assert relay.carry("robot1", header("server"), FRAME, 0.9) == ["server"]
    assert relay.carry("robot1", header("server"), FRAME, 1.0) == []
    assert relay.carry("server", header("robot1"), FRAME, 1.9) == []
    assert relay.carry("server", header("*"), FRAME, 1.5) == ["robot2", "robot3"]
    assert relay.carry("server", header("robot1"), FRAME, 2.0) == ["robot1"]
    assert relay.ledger.lost["robot1", "server", "bid"] == Tally(1, 8)


SENDS = st.lists(
    st.tuples(
        st.sampled_from([*ROBOTS, "server"]),
        st.sampled_from([*ROBOTS, "server", "*", "stranger"]),
        st.floats(0.0, 10.0),
    ),
    max_size=30,
)


@given(SENDS)
def test_what_is_sent_is_delivered_or_lost(sends: list[tuple[str, str, float]]) -> None:
    relay = Relay(ROBOTS, (Outage("robot1", 2.0, 5.0), Outage("robot2", 4.0, 8.0)))
    arrived = sum(len(relay.carry(a, header(to, a), FRAME, now)) for a, to, now in sends)
    books = relay.ledger
    assert sum(t.count for t in books.delivered.values()) == arrived
    for key, tally in books.sent.items():
        delivered, lost = books.delivered.get(key, Tally()), books.lost.get(key, Tally())
        assert tally == Tally(delivered.count + lost.count, delivered.bytes + lost.bytes)
