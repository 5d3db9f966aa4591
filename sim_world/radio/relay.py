"""The radio relay: carries fleet frames between robots and server as the links let them.

It speaks the fleet protocol without understanding it: it reads headers, counts every byte per
message type and per link, delays, limits, loses or doubles frames, and passes them on byte for
byte.

What a member says at one instant reaches the world at the next; the radio had that instant for
it. So airtime and latency count from the instant at which it was said, and a frame for which there
was time enough arrives as early as over a perfect radio.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from protocol.codec import Frame, Header, frame_bytes
from protocol.messages import EVERYONE, SERVER
from sim_world.radio.airtime import Channel, Transmission
from sim_world.radio.disturbance import Disturbance
from sim_world.radio.ledger import Ledger, Tallies, enter
from sim_world.radio.link_models import LinkModel, link_model
from sim_world.radio.partitions import Cuts, Outage
from sim_world.radio.settings import RadioSettings
from sim_world.radio.shadowing import Place
from sim_world.scene import Scene

_EPSILON = 1e-9  # sums of instants are not exact [s]


class _Flight(NamedTuple):
    """A frame that arrives: when [s], then in the order of sending."""

    arrival: float
    number: int
    key: tuple[str, str, str]
    size: int
    frame: Frame


class Relay:
    """Decides which frames arrive where, and when.

    Call `carry` for each frame that is handed to a radio, `advance` once an instant, and `due` for
    what arrives.

    Args:
        robots: names of all robots that have a radio.
        settings: of all links.
        model: who is in reach of whom.
        rng: source of all chance on the way.
        outages: scripted cuts.

    Attributes:
        ledger: the books.
        server_listens: whether frames to everyone go to the server, too.
    """

    def __init__(
        self,
        robots: Iterable[str],
        settings: RadioSettings,
        model: LinkModel,
        rng: np.random.Generator,
        outages: Iterable[Outage] = (),
    ) -> None:
        self.ledger = Ledger()
        self.server_listens = False
        self.at_once = settings.at_once
        self._robots = tuple(robots)
        self._settings = settings
        self._model = model
        self._cuts = Cuts(outages, settings.partitions, settings.one_way)
        self._channel = Channel(settings.capacity_bit_s, settings.turn_bytes)
        self._disturbance = Disturbance(settings, rng)
        self._flights: list[_Flight] = []
        self._numbered = 0
        self._gone: set[str] = set()
        self._since = 0.0

    def carry(self, sender: str, header: Header, frame: Frame, now: float) -> None:
        """Take a frame that a member handed to its radio.

        A frame for somebody unknown is not sent.

        Args:
            sender: the robot whose radio it is, or `server`.
            header: the frame's header; its `to` is the server, one robot, or everyone.
            frame: the frame itself.
            now: mission time [s].
        """
        receivers = self._receivers(sender, header.to)
        size = frame_bytes(frame)
        on_air = []
        for receiver in receivers:
            key = (sender, receiver, header.type)
            enter(self.ledger.sent, key, size)
            if self._cuts.off(sender, now):
                enter(self.ledger.lost, key, size)
            elif self._wired(sender, receiver):
                self._fly(key, size, frame, now)
            else:
                on_air.append(receiver)
        if not on_air:
            return
        item = Transmission(sender, tuple(on_air), header.type, frame, size, 8.0 * size)
        held = self._channel.held(sender)
        if self.at_once:
            self._transmit(item, now, now, {})
        elif held and held + size > self._settings.queue_max_bytes:
            self._lose([item])
        else:
            self._channel.put(item)

    def advance(self, now: float, places: Mapping[str, Place]) -> None:
        """Let the channel carry what waits, up to `now` [s].

        Args:
            now: mission time.
            places: (x, y) [m] of all robots and of the server's antenna, world frame. Who is in
                reach is decided by the places at the end of the instant.
        """
        for item, through in self._channel.run(self._since, now):
            self._transmit(item, through, now, places)
        self._since = now

    def due(self, now: float) -> list[tuple[str, Frame]]:
        """Return what arrives up to `now` [s]: receivers and frames, in order of arrival."""
        arrived = []
        while self._flights and self._flights[0].arrival <= now + _EPSILON:
            flight = heapq.heappop(self._flights)
            receiver = flight.key[1]
            if receiver in self._gone or self._cuts.off(receiver, now):
                enter(self.ledger.lost, flight.key, flight.size)
            else:
                enter(self.ledger.delivered, flight.key, flight.size)
                arrived.append((receiver, flight.frame))
        return arrived

    def switch_off(self, name: str) -> None:
        """A member's process is gone: what waits at its radio is lost, and what arrives, too.

        What it sent before is on its way and arrives.
        """
        self._gone.add(name)
        self._lose(self._channel.drop(name))

    def switch_on(self, name: str) -> None:
        """A member's process is there again, or for the first time."""
        self._gone.discard(name)
        if name == SERVER:
            self.server_listens = True

    def queued(self) -> Tallies:
        """Return what neither arrived nor was lost yet, by (from, to, message type)."""
        queued: Tallies = {}
        for item in self._channel.waiting():
            for receiver in item.receivers:
                enter(queued, (item.sender, receiver, item.type), item.size)
        for flight in sorted(self._flights):
            enter(queued, flight.key, flight.size)
        return queued

    def _receivers(self, sender: str, to: str) -> list[str]:
        """Return the names a frame is meant for."""
        if to == EVERYONE:
            names = [*self._robots, SERVER] if self.server_listens else self._robots
            return [name for name in names if name != sender]
        return [to] if to == SERVER or to in self._robots else []

    def _wired(self, sender: str, receiver: str) -> bool:
        """Whether a link is that of a server without an antenna."""
        return self._settings.server_place == "wired" and SERVER in (sender, receiver)

    def _transmit(
        self, item: Transmission, through: float, now: float, places: Mapping[str, Place]
    ) -> None:
        """Send a frame that is through the channel on its way to each of its receivers."""
        sender, size = item.sender, item.size
        enter(self.ledger.aired, (sender, item.type), size)
        cut = self._cuts.off(sender, now)
        for receiver in item.receivers:
            key = (sender, receiver, item.type)
            if cut or self._out_of_reach(sender, receiver, now, places) or self._disturbance.lost():
                enter(self.ledger.lost, key, size)
                continue
            first, *copies = self._disturbance.arrivals(sender, receiver, through)
            self._fly(key, size, item.frame, first)
            for arrival in copies:
                enter(self.ledger.duplicated, key, size)
                self._fly(key, size, item.frame, arrival)

    def _out_of_reach(
        self, sender: str, receiver: str, now: float, places: Mapping[str, Place]
    ) -> bool:
        """Whether a receiver cannot hear a sender at this time."""
        if self._cuts.parted(sender, receiver, now):
            return True
        return not self._model.reaches(sender, receiver, places)

    def _fly(self, key: tuple[str, str, str], size: int, frame: Frame, arrival: float) -> None:
        """Let a frame be on its way until it arrives [s]."""
        self._numbered += 1
        heapq.heappush(self._flights, _Flight(arrival, self._numbered, key, size, frame))

    def _lose(self, items: Iterable[Transmission]) -> None:
        """Enter frames that never got on the air as lost."""
        for item in items:
            for receiver in item.receivers:
                enter(self.ledger.lost, (item.sender, receiver, item.type), item.size)


def build_relay(
    robots: Iterable[str],
    settings: RadioSettings,
    scene: Scene,
    rng: np.random.Generator,
    outages: Iterable[Outage] = (),
) -> Relay:
    """Return the relay of a mission; `scene` holds the walls that stand between its members."""
    model = link_model(settings, scene, int(rng.integers(2**62)))
    return Relay(robots, settings, model, rng, outages)
