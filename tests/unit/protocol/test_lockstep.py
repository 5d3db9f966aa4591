from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.codec import decode
from protocol.effects import Effect, Note, PeerLeft, Received, Send, Stop, Strike
from protocol.host import Parcel
from protocol.lockstep import Bundle, Conductor
from protocol.messages import Welcome
from protocol.operator_messages import PauseRequest
from protocol.world_messages import Ping
from tests.unit.protocol.cores import Scripted, host_of, parcel

STEP = 0.1


def conductor_of(world: Scripted, *members: str) -> Conductor:
    conductor = Conductor(host_of("world", world), STEP)
    for name in members:
        conductor.join(name)
    return conductor


def answer_all(conductor: Conductor, bundles: list[Bundle], deadline: float | None = 0.0) -> None:
    for bundle in bundles:
        if bundle.strike != "kill":
            conductor.done(bundle.member, [], deadline)


def names(bundles: list[Bundle]) -> list[str]:
    return [bundle.member for bundle in bundles]


def ping(peer: str, value: float = 0.0) -> Parcel:
    return parcel("body", peer, Ping(value=value))


def strikes(*of: tuple[str, str], at: float = STEP) -> Scripted:
    """A world that strikes once."""

    def beat(now: float) -> list[Effect]:
        return [Strike(*strike) for strike in of] if abs(now - at) < 1e-9 else []

    return Scripted(deadline=0.0, beat=beat)


def heard(world: Scripted) -> list[tuple[str, float]]:
    return [
        (event.header.source, event.message.value)
        for _, event in world.events
        if isinstance(event, Received) and isinstance(event.message, Ping)
    ]


def test_time_is_counted_in_instants() -> None:
    world = Scripted(deadline=0.0)
    conductor = conductor_of(world)
    for _ in range(3):
        conductor.begin()
    assert conductor.now == 3 * STEP
    assert world.ticks == [STEP, 2 * STEP, 3 * STEP]


def test_all_members_that_are_due_get_a_bundle_in_order_of_their_names() -> None:
    conductor = conductor_of(Scripted(), "server", "robot2", "robot1")
    bundles = conductor.begin()
    assert names(bundles) == ["robot1", "robot2", "server"]
    assert conductor.awaited == {"robot1", "robot2", "server"}
    assert {bundle.now for bundle in bundles} == {STEP}
    conductor.done("robot1", [], None)
    conductor.done("robot2", [], 3 * STEP)
    conductor.done("server", [], 2 * STEP)
    assert conductor.awaited == set()
    assert names(conductor.begin()) == ["server"]
    conductor.done("server", [], None)
    assert names(conductor.begin()) == ["robot2"]


def test_a_message_wakes_a_member_that_has_no_deadline() -> None:
    def beat(now: float) -> list[Effect]:
        return [Send("body", "robot1", Ping(value=1.0)), Send("body", "nobody", Ping())]

    conductor = conductor_of(Scripted(deadline=2 * STEP, beat=beat), "robot1")
    answer_all(conductor, conductor.begin(), None)
    (bundle,) = conductor.begin()
    ((channel, peer),) = [(p.channel, p.peer) for p in bundle.parcels]
    assert (channel, peer) == ("body", "world")
    assert decode(bundle.parcels[0].frame)[1] == Ping(value=1.0)


def test_what_members_send_reaches_the_world_by_name_and_then_in_order_of_sending() -> None:
    world = Scripted()
    conductor = conductor_of(world, "robot1", "robot2")
    conductor.begin()
    conductor.done("robot2", [ping("robot2", 1.0), ping("robot2", 2.0)], 0.0)
    conductor.done("robot1", [ping("robot1", 3.0)], 0.0)
    conductor.begin()
    assert heard(world) == [("robot1", 3.0), ("robot2", 1.0), ("robot2", 2.0)]


def test_the_servers_fleet_is_the_worlds_uplink() -> None:
    world = Scripted(react=lambda event, now: [Send("uplink", "server", Welcome(now_s=now))])
    conductor = conductor_of(world, "server")
    conductor.begin()
    conductor.done("server", [parcel("fleet", "server", PauseRequest(robot="a"))], None)
    (bundle,) = conductor.begin()
    assert isinstance(world.events[0][1], Received)
    assert world.events[0][1].channel == "uplink"
    assert bundle.parcels[0].channel == "fleet"


def test_a_killed_member_is_not_waited_for_and_gets_nothing_any_more() -> None:
    world = strikes(("robot1", "kill"))
    conductor = conductor_of(world, "robot1", "robot2")
    bundles = conductor.begin()
    assert [(b.member, b.strike) for b in bundles] == [("robot1", "kill"), ("robot2", None)]
    assert conductor.awaited == {"robot2"}
    answer_all(conductor, bundles)
    world.beat = lambda now: [Send("body", "robot1", Ping())]
    assert names(conductor.begin()) == ["robot2"]
    assert conductor.members["robot1"].waiting == []


def test_a_restarted_member_begins_a_new_life_and_what_it_sent_before_is_lost() -> None:
    world = strikes(("robot1", "restart"), at=2 * STEP)
    conductor = conductor_of(world, "robot1")
    conductor.begin()
    conductor.done("robot1", [ping("robot1")], 9.0)
    (bundle,) = conductor.begin()
    assert (bundle.strike, bundle.incarnation, bundle.parcels) == ("restart", 1, [])
    assert conductor.awaited == {"robot1"}
    answer_all(conductor, [bundle])
    (after,) = conductor.begin()
    assert (after.strike, after.incarnation) == (None, 1)


def test_the_dead_can_be_restarted() -> None:
    world = strikes(("robot1", "kill"))
    conductor = conductor_of(world, "robot1")
    conductor.begin()
    assert conductor.begin() == []
    world.beat = lambda now: [Strike("robot1", "restart")]
    (bundle,) = conductor.begin()
    assert (bundle.strike, bundle.incarnation) == ("restart", 1)


def test_what_is_sent_to_a_frozen_member_waits_until_it_thaws() -> None:
    world = strikes(("robot1", "freeze"))
    conductor = conductor_of(world, "robot1")
    assert conductor.begin() == []
    assert conductor.awaited == set()
    world.beat = lambda now: [Send("body", "robot1", Ping(value=now))]
    assert conductor.begin() == []
    assert conductor.begin() == []
    world.beat = lambda now: [Strike("robot1", "thaw")]
    (bundle,) = conductor.begin()
    assert [decode(p.frame)[1] for p in bundle.parcels] == [
        Ping(value=2 * STEP),
        Ping(value=3 * STEP),
    ]


def test_a_strike_at_somebody_who_is_not_there_hits_nobody() -> None:
    conductor = conductor_of(strikes(("robot9", "kill")), "robot1")
    assert names(conductor.begin()) == ["robot1"]


def test_one_that_left_is_not_waited_for_and_its_last_words_come_before_the_news() -> None:
    world = Scripted()
    conductor = conductor_of(world, "robot1", "server")
    conductor.begin()
    conductor.done("robot1", [ping("robot1", 5.0)], 0.0)
    conductor.left("robot1")
    conductor.left("robot1")  # twice is once
    conductor.done("server", [], 0.0)
    assert names(conductor.begin()) == ["server"]
    kinds = [type(event) for _, event in world.events]
    assert kinds == [Received, PeerLeft]
    conductor.begin()
    assert len(world.events) == 2


def test_one_that_left_without_an_answer_is_not_waited_for() -> None:
    conductor = conductor_of(Scripted(), "robot1")
    conductor.begin()
    conductor.left("robot1")
    assert conductor.awaited == set()
    conductor.done("robot1", [ping("robot1")], 0.0)  # too late
    assert "robot1" not in conductor.members


def test_a_comeback_is_a_new_life() -> None:
    conductor = conductor_of(Scripted(), "robot1")
    conductor.begin()
    conductor.left("robot1")
    assert conductor.join("robot1") == 1
    assert conductor.join("robot2") == 0
    (first, _) = conductor.begin()
    assert first.incarnation == 1


def test_nobody_misses_one_that_left_before_the_mission_and_came_back() -> None:
    world = Scripted()
    conductor = conductor_of(world, "server")
    conductor.left("server")
    conductor.join("server")
    conductor.begin()
    assert world.events == []


def test_the_world_says_when_it_is_over_and_what_it_logs() -> None:
    world = Scripted(deadline=0.0, beat=lambda now: [Note("info", "done"), Stop("explored")])
    conductor = conductor_of(world)
    assert conductor.stopped is None
    conductor.begin()
    assert conductor.stopped == "explored"
    assert conductor.notes == [Note("info", "done")]


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["join", "left", "kill", "restart", "freeze", "thaw", "talk"]),
        st.sampled_from(["a", "b", "c"]),
    ),
    max_size=30,
)


@given(EVENTS)
@settings(deadline=None, max_examples=150)
def test_no_sequence_of_faults_stops_the_clock(happenings: list[tuple[str, str]]) -> None:
    """Whoever is awaited was given a bundle; the dead and the frozen never are."""
    world = Scripted(deadline=0.0)
    conductor = conductor_of(world, "a", "b")
    for kind, name in happenings:
        if kind == "join" and name not in conductor.members:
            conductor.join(name)
        elif kind == "left":
            conductor.left(name)
        strike = kind if kind in ("kill", "restart", "freeze", "thaw") else None
        words = [Strike(name, strike)] if strike else [Send("body", name, Ping())]
        world.beat = lambda now, words=words: list(words)  # type: ignore[misc]
        bundles = conductor.begin()
        assert conductor.awaited == {b.member for b in bundles if b.strike != "kill"}
        for bundle in bundles:
            member = conductor.members[bundle.member]
            assert not member.frozen
            assert not member.dead or bundle.strike == "kill"
        for bundle in bundles:
            if bundle.strike != "kill":
                conductor.done(bundle.member, [ping(bundle.member)], conductor.now + STEP)
        assert not conductor.awaited
    now = conductor.now
    conductor.begin()
    assert conductor.now > now
