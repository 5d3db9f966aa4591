"""A port takes what is there, waits for what is not, and wakes in time."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator

import pytest
import zmq

from protocol.transports.port import Port

Ends = tuple["zmq.Socket[bytes]", "zmq.Socket[bytes]"]


@pytest.fixture
def ends() -> Iterator[Ends]:
    """Two sockets that are connected to each other."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    near, far = context.socket(zmq.PAIR), context.socket(zmq.PAIR)
    near.bind("inproc://port")
    far.connect("inproc://port")
    yield near, far
    context.destroy(linger=0)


def test_what_is_there_is_taken_at_once(ends: Ends) -> None:
    async def run() -> list[list[bytes] | None]:
        port = Port(ends[0])
        assert not port.ready
        for number in (b"1", b"2", b"3"):
            ends[1].send_multipart([number, b"body"])
        taken = [await port.take(0.0) for _ in range(3)]
        assert not port.ready
        port.close()
        return taken

    assert asyncio.run(run()) == [[b"1", b"body"], [b"2", b"body"], [b"3", b"body"]]


def test_nothing_comes_in_time(ends: Ends) -> None:
    async def run() -> None:
        port = Port(ends[0])
        began = time.monotonic()
        assert await port.take(0.05) is None
        assert time.monotonic() - began >= 0.04
        assert await port.take(0.0) is None
        port.close()

    asyncio.run(run())


def test_it_wakes_for_every_message_and_answers(ends: Ends) -> None:
    async def answer(port: Port) -> None:
        for _ in range(50):
            message = await port.take(5.0)
            assert message is not None
            port.send([b"answer", *message])

    async def ask(port: Port) -> list[bytes]:
        answers = []
        for number in range(50):
            await asyncio.sleep(0.0 if number % 2 else 0.001)
            port.send([b"%d" % number])
            message = await port.take(5.0)
            assert message is not None
            answers.append(message[1])
        return answers

    async def run() -> list[bytes]:
        near, far = Port(ends[0]), Port(ends[1])
        _, answers = await asyncio.gather(answer(near), ask(far))
        near.close()
        far.close()
        return answers

    assert asyncio.run(run()) == [b"%d" % number for number in range(50)]


def test_a_wake_without_a_message_changes_nothing(ends: Ends) -> None:
    async def run() -> None:
        port = Port(ends[0])
        port._wake()  # nobody waits and nothing is there
        waiting = asyncio.ensure_future(port.take(1.0))
        await asyncio.sleep(0.01)
        port._wake()
        assert not waiting.done()
        ends[1].send_multipart([b"now"])
        assert await waiting == [b"now"]
        port.close()

    asyncio.run(run())


def test_what_cannot_be_sent_is_told() -> None:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    router = context.socket(zmq.ROUTER)
    router.setsockopt(zmq.ROUTER_MANDATORY, 1)

    async def run() -> None:
        port = Port(router)
        with pytest.raises(zmq.ZMQError):
            port.send([b"nobody", b"hello"])
        port.close()

    asyncio.run(run())
    context.term()
