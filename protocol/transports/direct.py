"""The server's own socket: peers that connect directly, without a simulated radio in between.

Operators, observers and robots in the field connect here. Every frame is hostile until the host has
validated it; here only its sender's name is looked at.
"""

from __future__ import annotations

import zmq

from protocol.fields import is_name
from protocol.host import Parcel

STRANGER = "?"  # no name: the host refuses every frame from it, whatever name it carries
MAX_PEERS = 1000  # one more, and who was silent longest is forgotten until it speaks again
MAX_FRAMES_PER_INSTANT = 1000  # a flood is taken in portions, so that the mission goes on


class DirectPeers:
    """A bound ROUTER socket and the peers that spoke on it.

    Whoever may not speak here (under a name that belongs to the simulated team, or under none at
    all) is heard as a stranger: the host then refuses and counts what it sends.

    Args:
        socket: the bound socket.
        reserved: names that only ever speak through the world and are refused here.
    """

    def __init__(self, socket: zmq.Socket[bytes], reserved: frozenset[str]) -> None:
        self._socket = socket
        self._reserved = reserved
        self._routes: dict[str, bytes] = {}  # who was silent longest comes first

    def arrivals(self) -> list[Parcel]:
        """Return the frames that came since the last call, without waiting."""
        parcels: list[Parcel] = []
        while len(parcels) < MAX_FRAMES_PER_INSTANT and self._waiting():
            message = self._socket.recv_multipart()
            identity, frame = message[0], message[1:]
            name = identity.split(b"#")[0].decode("utf-8", "replace")
            if is_name(name) and name not in self._reserved:
                self._remember(name, identity)
            else:
                name = STRANGER
            parcels.append(Parcel("fleet", name, frame))
        return parcels

    def _remember(self, name: str, identity: bytes) -> None:
        """Note where a peer that has just spoken can be reached."""
        self._routes.pop(name, None)
        if len(self._routes) >= MAX_PEERS:
            del self._routes[next(iter(self._routes))]
        self._routes[name] = identity

    def _waiting(self) -> bool:
        """Whether a frame is there to be taken."""
        return bool(int(self._socket.getsockopt(zmq.EVENTS)) & zmq.POLLIN)

    def send(self, parcel: Parcel) -> bool:
        """Send a frame if its receiver is connected here; return whether it is."""
        identity = self._routes.get(parcel.peer)
        if identity is None or parcel.channel != "fleet":
            return False
        try:
            self._socket.send_multipart([identity, *parcel.frame], flags=zmq.DONTWAIT)
        except zmq.ZMQError:
            del self._routes[parcel.peer]
        return True
