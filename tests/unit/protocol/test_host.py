from __future__ import annotations

import pytest

from protocol.codec import Header, decode, encode
from protocol.effects import (
    Note,
    Passing,
    PassOn,
    PeerLeft,
    Received,
    Rejected,
    Send,
    Stop,
    Strike,
)
from protocol.host import Host, Parcel
from protocol.messages import Welcome
from protocol.operator_messages import PauseRequest
from tests.unit.protocol.cores import Scripted, host_of, parcel
from tests.unit.protocol.samples import header_of

WELCOME = Welcome(now_s=1.0)
PAUSE = PauseRequest(robot="robot1")


def test_a_valid_frame_becomes_an_event() -> None:
    core = Scripted()
    host_of("server", core).advance([parcel("fleet", "robot1", PAUSE)], 2.0)
    ((now, event),) = core.events
    assert now == 2.0
    assert isinstance(event, Received)
    assert (event.channel, event.header.source, event.message) == ("fleet", "robot1", PAUSE)


def test_on_a_raw_channel_the_frame_passes_as_it_is() -> None:
    core = Scripted()
    frame = [encode(header_of(PAUSE), PAUSE)[0], b"never looked at"]
    host_of("world", core, frozenset({"radio"})).advance([Parcel("radio", "robot1", frame)], 0.0)
    ((_, event),) = core.events
    assert isinstance(event, Passing)
    assert event.frame == frame


@pytest.mark.parametrize(
    ("frame", "kind"),
    [
        ([b"rubbish", b""], "FrameError"),
        (encode(Header("welcome", "robot1", "server", 1, 0.0, (9, 0)), WELCOME), "VersionError"),
        (encode(Header("pause_request", "robot1", "server", 1, 0.0), WELCOME), "MessageError"),
        (encode(Header("teleport", "robot1", "server", 1, 0.0), WELCOME), "unknown type"),
        (encode(Header("welcome", "robot2", "server", 1, 0.0), WELCOME), "FrameError"),
    ],
)
def test_what_is_not_valid_is_counted_and_named(frame: list[bytes], kind: str) -> None:
    core = Scripted()
    host = host_of("server", core)
    host.advance([Parcel("fleet", "robot1", frame)], 0.0)
    ((_, event),) = core.events
    assert isinstance(event, Rejected)
    assert event.source == "robot1"
    assert host.rejected == {("robot1", kind): 1}


@pytest.mark.parametrize("raw", [frozenset({"fleet"}), frozenset()])
def test_nobody_speaks_in_anothers_name_but_the_world_which_forwards(raw: frozenset[str]) -> None:
    core = Scripted()
    host = host_of("server", core, raw)
    host.advance([parcel("fleet", "evil", PAUSE, source="robot1")], 0.0)
    host.advance([parcel("fleet", "world", PAUSE, source="robot1")], 0.0)
    kinds = [type(event) for _, event in core.events]
    assert kinds == [Rejected, Passing if raw else Received]


@pytest.mark.parametrize(
    ("frame", "blamed"),
    [
        ([encode(header_of(PAUSE, source="robot2"), PAUSE)[0], b"not msgpack"], "robot2"),
        ([b"rubbish", b""], "world"),
    ],
)
def test_behind_the_relay_the_one_that_a_refused_frame_names_is_to_blame(
    frame: list[bytes], blamed: str
) -> None:
    core = Scripted()
    host = host_of("robot1", core)
    host.advance([Parcel("radio", "world", frame)], 0.0)
    ((_, event),) = core.events
    assert isinstance(event, Rejected)
    assert (event.channel, event.source) == ("radio", blamed)
    assert [peer for peer, _ in host.rejected] == ["world"]


def test_the_core_is_woken_when_it_is_due_and_not_before() -> None:
    core = Scripted(deadline=1.0)
    host = host_of("robot1", core)
    host.advance([], 0.9)
    assert core.ticks == []
    host.advance([], 1.0)
    assert core.ticks == [1.0]
    assert host.next_deadline == 1.0


def test_effects_are_carried_out_in_order_and_frames_are_numbered_by_receiver() -> None:
    frame = encode(header_of(PAUSE), PAUSE)
    effects = [
        Send("fleet", "robot1", WELCOME),
        Note("info", "hello"),
        Send("fleet", "robot2", WELCOME),
        PassOn("radio", "robot2", frame),
        Send("fleet", "robot1", WELCOME),
        Strike("robot1", "kill"),
        Stop("explored"),
    ]
    host = host_of("server", Scripted(deadline=0.0, beat=lambda now: list(effects)))
    outbox = host.advance([], 0.5)
    assert [(p.channel, p.peer) for p in outbox.parcels] == [
        ("fleet", "robot1"),
        ("fleet", "robot2"),
        ("radio", "robot2"),
        ("fleet", "robot1"),
    ]
    headers = [decode(p.frame)[0] for p in outbox.parcels if p.frame is not frame]
    assert [(h.to, h.sequence, h.source, h.stamp) for h in headers] == [
        ("robot1", 1, "server", 0.5),
        ("robot2", 1, "server", 0.5),
        ("robot1", 2, "server", 0.5),
    ]
    assert outbox.notes == [Note("info", "hello")]
    assert outbox.strikes == [Strike("robot1", "kill")]
    assert outbox.stop == "explored"


def test_an_effect_nobody_knows_is_passed_over() -> None:
    core = Scripted(deadline=0.0, beat=lambda now: [object()])  # type: ignore[list-item]
    assert host_of("server", core).advance([], 0.0).parcels == []


def test_a_peer_that_left_is_told_to_the_core() -> None:
    core = Scripted(react=lambda event, now: [Note("info", "gone")])
    outbox = host_of("world", core).peer_left("body", "robot1", 3.0)
    assert core.events == [(3.0, PeerLeft("body", "robot1"))]
    assert outbox.notes == [Note("info", "gone")]


def test_a_restart_makes_a_new_core_that_counts_its_frames_anew() -> None:
    lives: list[int] = []

    def build(life: int) -> Scripted:
        lives.append(life)
        return Scripted(deadline=0.0, beat=lambda now: [Send("radio", "server", PAUSE)])

    host = Host("robot1", build)
    first = host.core
    host.advance([], 0.0)
    assert decode(host.advance([], 0.0).parcels[0].frame)[0].sequence == 2
    host.restart(4)
    assert lives == [0, 4]
    assert host.core is not first
    assert decode(host.advance([], 0.0).parcels[0].frame)[0].sequence == 1
