"""The server's own socket: peers that connect directly, without a simulated radio in between.

Operators, observers and robots in the field connect here. Every frame is hostile until the host has
validated it; here only its size and its sender's name are looked at.
"""

from __future__ import annotations

import zmq
import zmq.asyncio

from protocol.codec import MAX_FRAME_BYTES, MAX_PARTS
from protocol.host import Parcel

MAX_PEERS = 1000
MAX_FRAMES_PER_INSTANT = 1000  # a flood is taken in portions, so that the mission goes on


class DirectPeers:
    """A bound ROUTER socket and the peers that spoke on it.

    Args:
        socket: the bound socket.
        reserved: names that only ever speak through the world and are refused here.
    """

    def __init__(self, socket: zmq.asyncio.Socket, reserved: frozenset[str]) -> None:
        self._socket = socket
        self._reserved = reserved
        self._routes: dict[str, bytes] = {}
        self.dropped = 0

    async def arrivals(self) -> list[Parcel]:
        """Return the frames that came since the last call, without waiting."""
        parcels: list[Parcel] = []
        while len(parcels) < MAX_FRAMES_PER_INSTANT and await self._socket.poll(0):
            message = await self._socket.recv_multipart()
            identity, frame = message[0], message[1:]
            name = identity.split(b"#")[0].decode("utf-8", "replace")[:32]
            size = sum(len(part) for part in frame)
            if (
                name in self._reserved
                or not frame
                or len(frame) > MAX_PARTS
                or size > MAX_FRAME_BYTES
                or (name not in self._routes and len(self._routes) >= MAX_PEERS)
            ):
                self.dropped += 1
                continue
            self._routes[name] = identity
            parcels.append(Parcel("fleet", name, frame))
        return parcels

    async def send(self, parcel: Parcel) -> bool:
        """Send a frame if its receiver is connected here; return whether it is."""
        identity = self._routes.get(parcel.peer)
        if identity is None or parcel.channel != "fleet":
            return False
        try:
            await self._socket.send_multipart([identity, *parcel.frame], flags=zmq.DONTWAIT)
        except zmq.ZMQError:
            del self._routes[parcel.peer]
        return True
