"""The shell of a member: one asyncio loop that carries any core over ZeroMQ.

The member connects out to the world, takes bundles, lets its core live through each instant, and
answers. A server also has a socket of its own, where operators and observers connect directly.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress

import msgpack
import zmq

from protocol.effects import Note
from protocol.errors import RefusedError
from protocol.host import Host, Outbox, Parcel
from protocol.lockstep import Bundle
from protocol.transports.bundles import (
    DONE,
    INSTANT,
    JOIN,
    OVER,
    REFUSE,
    WELCOME,
    pack_parcels,
    unpack_bundle,
)
from protocol.transports.direct import DirectPeers
from protocol.transports.port import Port

JOIN_PERIOD = 1.0
WORLD_SILENCE = 60.0  # the world pings all the time: a minute of nothing means it is gone
PATIENCE = 5.0  # a person who waits for the world longer than this is told so
JOIN_TIMEOUT_S = 120.0  # long enough to start a team by hand, one terminal after the other


class Runner:
    """Carries one core as a member of a simulated team.

    Args:
        host: the core's host.
        world: the world's endpoint, `tcp://host:port`.
        on_note: is told each line that the core logs.
        direct: the server's own socket for peers that connect directly; None for robots.
        keep_going: asked at every instant; when false the process leaves the team.
        join_timeout: how long to knock at the world's door [s].
    """

    def __init__(
        self,
        host: Host,
        world: str,
        on_note: Callable[[Note], None],
        direct: DirectPeers | None = None,
        keep_going: Callable[[], bool] = lambda: True,
        join_timeout: float = JOIN_TIMEOUT_S,
    ) -> None:
        self._host = host
        self._endpoint = world
        self._on_note = on_note
        self._direct = direct
        self._keep_going = keep_going
        self._join_timeout = join_timeout

    async def run(self, context: zmq.Context[zmq.Socket[bytes]]) -> str:
        """Take part until the mission is over; return why it ended for this process.

        Raises:
            RefusedError: the world does not take this process in.
            TimeoutError: there is no world there, or it fell silent.
        """
        socket = context.socket(zmq.DEALER)
        socket.setsockopt(zmq.IDENTITY, f"{self._host.name}#{os.getpid():x}".encode())
        socket.setsockopt(zmq.LINGER, 500)
        socket.setsockopt(zmq.HEARTBEAT_IVL, 1000)
        socket.connect(self._endpoint)
        port = Port(socket)
        try:
            return await self._take_part(port)
        finally:
            port.close()

    async def _take_part(self, port: Port) -> str:
        """Join, then live through instants until it is over."""
        joined, quiet, began = False, 0.0, time.monotonic()
        self._knock(port)
        while self._keep_going():
            message = await port.take(JOIN_PERIOD)
            if message is None:
                quiet += JOIN_PERIOD
                if not joined:
                    self._check_patience(time.monotonic() - began)
                    self._knock(port)
                    if quiet == PATIENCE:
                        self._on_note(Note("info", f"waiting for the world at {self._endpoint}"))
                elif quiet >= WORLD_SILENCE:
                    raise TimeoutError(f"the world at {self._endpoint} fell silent")
                continue
            quiet = 0.0
            if message[0] == WELCOME and not joined:
                joined = True
                self._host.restart(int(msgpack.unpackb(message[1])))
            elif message[0] == REFUSE and not joined:
                raise RefusedError(str(msgpack.unpackb(message[1])))
            elif message[0] == OVER:
                return "over"
            elif message[0] == INSTANT:
                reason = self._live(port, unpack_bundle(self._host.name, message))
                if reason is not None:
                    return reason
        return "broken off"

    def _knock(self, port: Port) -> None:
        """Ask the world to be taken in."""
        with suppress(zmq.Again):  # nobody is there, and has not been for very long
            port.send([JOIN])

    def _check_patience(self, waited: float) -> None:
        """Give up after a while.

        Raises:
            TimeoutError: the world has not answered for too long.
        """
        if waited > self._join_timeout:
            raise TimeoutError(
                f"no world answered at {self._endpoint} within {self._join_timeout:g} s: start it "
                "with `expedition world`, or give its address with --world-endpoint"
            )

    def _live(self, port: Port, bundle: Bundle) -> str | None:
        """Live through one instant and answer; return why the core stopped, or None."""
        if bundle.strike == "kill":
            return None
        self._host.suffer(bundle.strike, bundle.incarnation)
        parcels = bundle.parcels
        if self._direct is not None:
            parcels = parcels + self._direct.arrivals()
        outbox = self._host.advance(parcels, bundle.now)
        self._answer(port, outbox)
        return outbox.stop

    def _answer(self, port: Port, outbox: Outbox) -> None:
        """Send what the core wants sent: to direct peers directly, the rest with the answer."""
        through_world: list[Parcel] = []
        for parcel in outbox.parcels:
            if self._direct is None or not self._direct.send(parcel):
                through_world.append(parcel)
        meta = [self._host.next_deadline, outbox.stop]
        port.send(pack_parcels(DONE, meta, through_world))
        for note in outbox.notes:
            self._on_note(note)
