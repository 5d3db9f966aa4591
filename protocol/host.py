"""A core and its post: decodes what arrives, encodes what leaves, and keeps count.

The same host carries a core in every shell, so that a run over sockets and a run in one process go
through the very same bytes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, runtime_checkable

from protocol.codec import Frame, Header, decode, decode_header, encode_content, encode_header
from protocol.effects import (
    Core,
    Effect,
    Event,
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
from protocol.errors import FrameError, ProtocolError, UnknownTypeError
from protocol.messages import WORLD, Message


class Parcel(NamedTuple):
    """A frame on its way: the channel it leaves by or arrives on, and the peer at the other end."""

    channel: str
    peer: str
    frame: Frame


@dataclass(slots=True)
class Outbox:
    """What a core wants done, in order."""

    parcels: list[Parcel] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    strikes: list[Strike] = field(default_factory=list)
    stop: str | None = None


@runtime_checkable
class Keeping(Protocol):
    """A core that writes down what its next life can go on from."""

    def keep(self) -> bytes:
        """Return what is written down."""
        ...


class Host:
    """Carries one core: events in, encoded frames out.

    Args:
        name: the process's name, the `source` of all it sends.
        build: makes the core; called again when the process restarts.
        raw_channels: channels whose frames are passed on rather than understood.
        rebuild: makes the core of a later life from what the one before wrote down; None if it
            keeps nothing.

    A frame must carry the name of the peer that sent it, unless that peer is the world: its relay
    forwards for others.
    """

    def __init__(
        self,
        name: str,
        build: Callable[[int], Core],
        raw_channels: frozenset[str] = frozenset(),
        rebuild: Callable[[int, bytes], Core] | None = None,
    ) -> None:
        self.name = name
        self._build = build
        self._rebuild = rebuild
        self._raw_channels = raw_channels
        self._sequences: Counter[tuple[str, str]] = Counter()
        self.core = build(0)
        self.rejected: Counter[tuple[str, str]] = Counter()

    def restart(self, incarnation: int) -> None:
        """Throw the core away with all it knew and make a new one, for its next life."""
        self._sequences.clear()
        self.core = self._build(incarnation)

    def reboot(self, incarnation: int) -> None:
        """Make a new core that knows what the one before it wrote down, and nothing else."""
        if self._rebuild is None or not isinstance(self.core, Keeping):
            self.restart(incarnation)
            return
        kept = self.core.keep()
        self._sequences.clear()
        self.core = self._rebuild(incarnation, kept)

    def suffer(self, strike: str | None, incarnation: int) -> None:
        """Let a scripted fault that starts the process anew strike: `restart` or `reboot`."""
        if strike == "restart":
            self.restart(incarnation)
        elif strike == "reboot":
            self.reboot(incarnation)

    @property
    def next_deadline(self) -> float | None:
        """Mission time [s] at which the core wants to be woken, or None."""
        return self.core.next_deadline()

    def advance(self, parcels: Iterable[Parcel], now: float) -> Outbox:
        """Hand the core what arrived and, if it is due, a tick; return what it wants done.

        Args:
            parcels: arrivals, in order; `peer` is who the transport says sent it.
            now: mission time [s].
        """
        outbox = Outbox()
        for parcel in parcels:
            self._carry_out(self.core.handle(self._event(parcel), now), now, outbox)
        deadline = self.core.next_deadline()
        if deadline is not None and deadline <= now:
            self._carry_out(self.core.tick(now), now, outbox)
        return outbox

    def peer_left(self, channel: str, peer: str, now: float) -> Outbox:
        """Tell the core that a peer's connection is gone."""
        outbox = Outbox()
        self._carry_out(self.core.handle(PeerLeft(channel, peer), now), now, outbox)
        return outbox

    def _event(self, parcel: Parcel) -> Event:
        """Turn bytes into an event; what is not valid becomes `Rejected`."""
        try:
            if parcel.channel in self._raw_channels:
                header = decode_header(parcel.frame)
                self._check_source(parcel, header)
                return Passing(parcel.channel, header, parcel.frame)
            header, message = decode(parcel.frame)
            self._check_source(parcel, header)
            return Received(parcel.channel, header, message)
        except ProtocolError as error:
            unknown = isinstance(error, UnknownTypeError)
            kind = "unknown type" if unknown else type(error).__name__
            self.rejected[parcel.peer, kind] += 1
            return Rejected(parcel.channel, _sender(parcel), str(error))

    def _check_source(self, parcel: Parcel, header: Header) -> None:
        """Refuse a frame under somebody else's name."""
        if parcel.peer != WORLD and header.source != parcel.peer:
            raise FrameError(f"{parcel.peer} sent a frame in the name of {header.source}")

    def _carry_out(self, effects: Iterable[Effect], now: float, outbox: Outbox) -> None:
        """Sort effects into the outbox, encoding messages."""
        said: Message | None = None
        content: list[bytes] = []
        for effect in effects:
            if isinstance(effect, Send):
                if effect.message is not said:  # what several peers are told is encoded once
                    said, content = effect.message, encode_content(effect.message)
                self._sequences[effect.channel, effect.to] += 1
                header = Header(
                    effect.message.type,
                    self.name,
                    effect.to,
                    self._sequences[effect.channel, effect.to],
                    now,
                )
                frame = [encode_header(header), *content]
                outbox.parcels.append(Parcel(effect.channel, effect.to, frame))
            elif isinstance(effect, PassOn):
                outbox.parcels.append(Parcel(effect.channel, effect.to, effect.frame))
            elif isinstance(effect, Note):
                outbox.notes.append(effect)
            elif isinstance(effect, Strike):
                outbox.strikes.append(effect)
            elif isinstance(effect, Stop):
                outbox.stop = effect.reason


def _sender(parcel: Parcel) -> str:
    """Return who sent a frame that was refused: behind the world's relay, as its header says.

    The relay lets nobody speak under another's name.
    """
    if parcel.peer != WORLD:
        return parcel.peer
    try:
        return decode_header(parcel.frame).source
    except ProtocolError:
        return parcel.peer
