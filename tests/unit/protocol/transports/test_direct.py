"""The server's own socket, with a socket made of lists."""

from __future__ import annotations

from typing import Any, cast

import pytest
import zmq

from protocol.host import Parcel
from protocol.transports import direct
from protocol.transports.direct import STRANGER, DirectPeers


class FakeSocket:
    """What came, and what was sent."""

    def __init__(self) -> None:
        self.waiting: list[list[bytes]] = []
        self.sent: list[list[bytes]] = []
        self.gone: set[bytes] = set()

    def getsockopt(self, option: int) -> int:
        assert option == zmq.EVENTS
        return zmq.POLLIN if self.waiting else 0

    def recv_multipart(self) -> list[bytes]:
        return self.waiting.pop(0)

    def send_multipart(self, parts: list[bytes], flags: int = 0) -> None:
        if parts[0] in self.gone:
            raise zmq.ZMQError(zmq.EHOSTUNREACH)
        self.sent.append(parts)


def peers() -> tuple[DirectPeers, FakeSocket]:
    socket = FakeSocket()
    return DirectPeers(cast("zmq.Socket[bytes]", socket), frozenset({"robot1"})), socket


def speak(made: DirectPeers, socket: FakeSocket, *identities: bytes) -> list[str]:
    socket.waiting += [[identity, b"frame"] for identity in identities]
    return [parcel.peer for parcel in made.arrivals()]


def send(made: DirectPeers, name: str, channel: str = "fleet") -> Any:
    return made.send(Parcel(channel, name, [b"frame"]))


def test_peers_are_heard_and_answered_by_name() -> None:
    made, socket = peers()
    assert speak(made, socket, b"boss#1") == ["boss"]
    assert send(made, "boss") and socket.sent == [[b"boss#1", b"frame"]]
    assert not send(made, "nobody") and not send(made, "boss", "clock")
    speak(made, socket, b"boss#2")  # it came back on another connection
    send(made, "boss")
    assert socket.sent[-1][0] == b"boss#2"


def test_reserved_and_bad_names_are_strangers() -> None:
    made, socket = peers()
    assert speak(made, socket, b"robot1#1", b"not a name", b"\xff") == [STRANGER] * 3
    assert not send(made, "robot1")


def test_one_too_many_and_the_longest_silent_is_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(direct, "MAX_PEERS", 3)
    made, socket = peers()
    speak(made, socket, b"a", b"b", b"c", b"a", b"d")
    assert [send(made, name) for name in "abcd"] == [True, False, True, True]
    assert speak(made, socket, b"b") == ["b"]  # it is heard again at once
    assert [send(made, name) for name in "abcd"] == [True, True, False, True]


def test_a_flood_is_taken_in_portions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(direct, "MAX_FRAMES_PER_INSTANT", 4)
    made, socket = peers()
    assert len(speak(made, socket, *[b"a"] * 10)) == 4
    assert len(socket.waiting) == 6


def test_a_peer_that_is_gone_is_forgotten() -> None:
    made, socket = peers()
    speak(made, socket, b"boss")
    socket.gone.add(b"boss")
    assert send(made, "boss")  # nobody else could have sent it
    assert not send(made, "boss")
