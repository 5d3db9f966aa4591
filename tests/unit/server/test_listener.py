"""A server that only listens, by events alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mapping.geometry import Pose2
from mapping.shared_map import SharedMap
from mapping.team_map import TeamMap
from protocol import messages as words
from protocol import operator_messages as asks
from protocol.codec import Header
from protocol.effects import Effect, PeerLeft, Received, Rejected, Send, Stop
from protocol.log.author_log import Author, Entry
from protocol.log.messages import LogHave, Observations
from protocol.messages import Message
from protocol.peer_messages import Presence
from protocol.world_messages import Finished, Join, Ping, Through
from server.listener import Listener
from server.settings import ServerSettings
from tests.unit.protocol.test_crew import beacon
from tests.unit.robot_agent.decentral.peer_rig import seen_by, sync_of
from tests.unit.rooms import heard, sent
from tests.unit.server.master_rig import notes, of_type

PLACES = (Pose2(0.0, 0.0, 0.0), Pose2(0.5, 0.0, 0.3))


class Rig:
    """A listener, its clock, and what it hears."""

    def __init__(self, time_limit: float | None = None, **settings: Any) -> None:
        given = ServerSettings.model_validate(settings)
        shared = SharedMap(TeamMap[tuple[str, int]](0.1))
        sync = sync_of("server")
        self.listener = Listener(given, sync, shared, ("ann", "bob"), time_limit)
        self.now = 0.0

    def says(self, name: str, message: Message) -> list[Effect]:
        header = Header(message.type, name, "*", 1, self.now)
        return self.listener.handle(Received("fleet", header, message), self.now)

    def tick(self, seconds: float = 0.5) -> list[Effect]:
        self.now = round(self.now + seconds, 6)
        return self.listener.tick(self.now)

    def through(self, name: str) -> None:
        held = self.listener.held.checksum()
        self.says(name, beacon(idle=True, through=True, held=held))


def begun() -> Rig:
    """One that holds what ann saw."""
    rig = Rig()
    rig.tick(0.0)
    rig.says("ann", seen_by("ann", *PLACES))
    rig.tick()
    return rig


def test_it_joins_once_and_then_keeps_its_copy() -> None:
    rig = Rig()
    assert rig.listener.next_deadline() == 0.0
    assert sent(rig.tick(0.0), "world") == [Join(role="server")]
    assert sent(rig.tick(), "world") == []
    rig.says("ann", seen_by("ann", *PLACES))
    announced = [m for _ in range(30) for m in sent(rig.tick()) if isinstance(m, LogHave)]
    assert announced[-1].authors == ("ann", "server")
    assert rig.listener.next_deadline() > rig.now - 0.01


def test_it_says_that_it_is_there_while_it_hears_somebody() -> None:
    rig = Rig(presence_period_s=2.0, silence_s=5.0)
    assert not of_type(rig.tick(), Presence)
    rig.says("ann", beacon())
    said = [bool(of_type(rig.tick(1.0), Presence)) for _ in range(10)]
    assert said == [False, True, False, True] + 6 * [False]


def test_it_draws_the_map_and_tells_those_who_asked_for_it() -> None:
    rig = begun()
    assert len(rig.listener.shared.team) == 2
    effects = rig.says("eve", words.Hello(role="observer"))
    assert [type(m) for m in sent(effects, "eve")] == [words.Welcome, words.MapSnapshot]
    rig.says("bob", seen_by("bob", Pose2(1.0, 0.0, 0.0)))
    rig.says("bob", beacon(1.0))
    effects = rig.tick()
    (delta,) = of_type(effects, words.MapDelta, "eve")
    assert delta.number == 2
    (poses,) = of_type(effects, words.TeamPoses, "eve")
    assert poses.robots == ("bob",)
    (snapshot,) = sent(rig.says("eve", words.MapRequest(have=0)), "eve")
    assert isinstance(snapshot, words.MapSnapshot) and snapshot.number == 2


def test_of_an_empty_map_there_is_no_snapshot() -> None:
    rig = Rig()
    (welcome,) = sent(rig.says("eve", words.Hello(role="observer")), "eve")
    assert isinstance(welcome, words.Welcome)
    assert of_type(rig.tick(), words.TeamPoses) == []


def test_it_asks_for_what_it_lacks() -> None:
    rig = begun()
    rig.says("ann", seen_by("ann", Pose2(1.0, 0.0, 0.0), first=5))
    wanted = [m for _ in range(20) for m in sent(rig.tick(), "ann")]
    assert [m.type for m in wanted][:1] == ["log_want"]


@pytest.mark.parametrize(
    "request_",
    [
        asks.VisitRequest(robot="ann", x_m=0.0, y_m=0.0),
        asks.PauseRequest(robot="ann"),
        asks.ResumeRequest(robot="ann"),
        asks.DriveRequest(robot="ann", speed_m_s=0.1, turn_rate_rad_s=0.0),
    ],
)
def test_nobody_can_tell_these_robots_what_to_do(request_: Message) -> None:
    (answer,) = sent(begun().says("operator", request_), "operator")
    assert isinstance(answer, asks.Answer) and not answer.accepted
    assert "decide for themselves" in answer.text


def test_an_operator_can_end_the_mission_once() -> None:
    rig = begun()
    effects = rig.says("op", asks.StopRequest(ended="operator"))
    assert of_type(effects, asks.Answer, "op")[0].accepted
    assert of_type(effects, Finished, "world") == [
        Finished(ended="operator", reason="asked for by op")
    ]
    assert Stop("operator") in effects
    again = rig.says("op", asks.StopRequest(ended="operator"))
    assert of_type(again, Finished) == []
    assert of_type(rig.tick(), Finished) == []


def test_what_is_none_of_its_business_is_passed_over() -> None:
    rig = begun()
    assert rig.says("eve", Ping()) == rig.says("ann", Ping()) == []
    assert rig.listener.handle(PeerLeft("fleet", "eve"), 0.0) == []
    assert rig.listener.handle(heard("clock", "world", Ping()), 0.0) == []


def test_who_tells_nonsense_is_heard_no_more() -> None:
    rig = begun()
    told = []
    for k in range(5):
        told += rig.listener.handle(Rejected("fleet", "bob", f"nonsense: {k}"), rig.now)
    assert "bob" in notes(told)
    assert rig.says("bob", beacon()) == []
    assert rig.listener.crew.beacons == {}


def test_who_tells_what_is_no_observation_is_to_blame() -> None:
    rig = begun()
    rig.listener.sync.log.put(Author("bob", 0), 1, Entry(b"", (0, 0, 0), 0), "bob")
    rig.tick()
    ((peer, _),) = rig.listener.sync.standing.book.counts
    assert peer == "bob"


# --- the end -------------------------------------------------------------------------------------


def test_it_is_through_when_all_say_so_and_hold_what_it_holds() -> None:
    rig = begun()
    rig.says("bob", beacon())
    rig.through("ann")
    assert of_type(rig.tick(), Through) == []
    rig.through("bob")
    rig.says("ann", seen_by("ann", Pose2(1.0, 0.0, 0.0), first=3))
    assert of_type(rig.tick(), Through) == [], "they do not hold the same any more"
    for name in ("ann", "bob"):
        rig.through(name)
    (word,) = of_type(rig.tick(), Through, "world")
    assert word.through and rig.listener.through
    rig.says("bob", beacon())
    (word,) = of_type(rig.tick(), Through, "world")
    assert not word.through, "one of them has learnt better"


def test_who_was_not_heard_for_long_is_not_waited_for() -> None:
    rig = begun()
    rig.says("bob", beacon())
    rig.tick(ServerSettings().abandon_s - 1.0)
    rig.through("ann")
    assert of_type(rig.tick(), Through) == []
    assert of_type(rig.tick(1.0), Through)[0].through


def test_it_ends_by_time() -> None:
    rig = Rig(time_limit=10.0)
    assert of_type(rig.tick(9.5), Finished) == []
    assert of_type(rig.tick(0.5), Finished)[0].ended == "time_limit"


def test_two_listeners_that_heard_the_same_have_the_same_map() -> None:
    one, other = begun(), Rig()
    for number in (2, 1):
        told = seen_by("ann", PLACES[number - 1], first=number)
        assert isinstance(told, Observations)
        other.says("ann", told)
    other.tick()
    assert one.listener.held.checksum() == other.listener.held.checksum()
    maps = [rig.listener.shared.team.grid().log_odds for rig in (one, other)]
    np.testing.assert_array_equal(*maps)
    assert isinstance(one.tick(), list) and all(isinstance(e, Send) for e in one.tick())
