"""The server's own socket: peers that connect directly, without a simulated radio in between.

Operators, observers and robots in the field connect here. Every frame is hostile until the host has
validated it; here only its sender's name is looked at.
"""

from __future__ import annotations

import zmq
import zmq.asyncio

from protocol.fields import is_name
from protocol.host import Parcel

STRANGER = "?"  # no name: the host refuses every frame from it, whatever name it carries
MAX_PEERS = 1000
MAX_FRAMES_PER_INSTANT = 1000  # a flood is taken in portions, so that the mission goes on


class DirectPeers:
    """A bound ROUTER socket and the peers that spoke on it.

    Whoever may not speak here (under a name that belongs to the simulated team, under none at all,
    or as one too many) is heard as a stranger: the host then refuses and counts what it sends.

    Args:
        socket: the bound socket.
        reserved: names that only ever speak through the world and are refused here.
    """

    def __init__(self, socket: zmq.asyncio.Socket, reserved: frozenset[str]) -> None:
        self._socket = socket
        self._reserved = reserved
        self._routes: dict[str, bytes] = {}

    async def arrivals(self) -> list[Parcel]:
        """Return the frames that came since the last call, without waiting."""
        parcels: list[Parcel] = []
        while len(parcels) < MAX_FRAMES_PER_INSTANT and await self._socket.poll(0):
            message = await self._socket.recv_multipart()
            identity, frame = message[0], message[1:]
            name = identity.split(b"#")[0].decode("utf-8", "replace")
            if self._may_speak(name):
                self._routes[name] = identity
            else:
                name = STRANGER
            parcels.append(Parcel("fleet", name, frame))
        return parcels

    def _may_speak(self, name: str) -> bool:
        """Whether a peer of this name is heard under its name."""
        if name in self._routes:
            return True
        return is_name(name) and name not in self._reserved and len(self._routes) < MAX_PEERS

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
