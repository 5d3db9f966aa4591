"""A ZeroMQ socket in an asyncio loop, with as little as possible between the two.

A mission in lockstep passes some hundred thousand small messages, and everybody waits for each of
them. So what is there already is taken without asking the loop, and waiting costs one future.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import zmq


class Port:
    """A plain socket that one task of the running loop waits on.

    The socket's descriptor tells only that *something* has changed, once (it is edge-triggered):
    what there is to take is asked of the socket itself, before waiting and whenever woken.
    """

    def __init__(self, socket: zmq.Socket[bytes]) -> None:
        """Watch `socket` in the loop that runs now."""
        self.socket = socket
        self._loop = asyncio.get_running_loop()
        self._waiting: asyncio.Future[bool] | None = None
        self._descriptor = int(socket.getsockopt(zmq.FD))
        self._loop.add_reader(self._descriptor, self._wake)

    def close(self) -> None:
        """Stop watching and close the socket."""
        self._loop.remove_reader(self._descriptor)
        self.socket.close()

    @property
    def ready(self) -> bool:
        """Whether a message is there to be taken."""
        return bool(int(self.socket.getsockopt(zmq.EVENTS)) & zmq.POLLIN)

    async def take(self, timeout: float) -> list[bytes] | None:
        """Return the next message, or None if none comes within `timeout` [s]."""
        if not self.ready and not await self._wait(timeout):
            return None
        return self.socket.recv_multipart()

    def send(self, message: Sequence[bytes]) -> None:
        """Send a message at once.

        Raises:
            zmq.ZMQError: its receiver is gone or takes nothing more.
        """
        self.socket.send_multipart(message, flags=zmq.DONTWAIT)

    async def _wait(self, timeout: float) -> bool:
        """Wait for a message; return whether one came within `timeout` [s]."""
        waiting: asyncio.Future[bool] = self._loop.create_future()
        self._waiting = waiting
        alarm = self._loop.call_later(max(timeout, 0.0), self._settle, False)
        try:
            return await waiting
        finally:
            alarm.cancel()
            self._waiting = None

    def _wake(self) -> None:
        """The socket has changed."""
        if self.ready:
            self._settle(True)

    def _settle(self, came: bool) -> None:
        """Let the waiting task go on."""
        if self._waiting is not None and not self._waiting.done():
            self._waiting.set_result(came)
