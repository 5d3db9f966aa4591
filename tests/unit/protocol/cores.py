"""Small cores to test shells with: they do what they are told and remember what came."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from protocol.codec import encode
from protocol.effects import Effect, Event
from protocol.host import Host, Parcel
from protocol.messages import Message
from tests.unit.protocol.samples import header_of

Reaction = Callable[[Event, float], list[Effect]]


def _nothing(_: Event, __: float) -> list[Effect]:
    return []


def _idle(_: float) -> list[Effect]:
    return []


@dataclass
class Scripted:
    """A core that reacts by two functions and has a fixed deadline."""

    react: Reaction = _nothing
    beat: Callable[[float], list[Effect]] = _idle
    deadline: float | None = None
    life: int = 0
    events: list[tuple[float, Event]] = field(default_factory=list)
    ticks: list[float] = field(default_factory=list)

    def handle(self, event: Event, now: float) -> list[Effect]:
        self.events.append((now, event))
        return self.react(event, now)

    def tick(self, now: float) -> list[Effect]:
        self.ticks.append(now)
        return self.beat(now)

    def next_deadline(self) -> float | None:
        return self.deadline


def host_of(name: str, core: Scripted, raw: frozenset[str] = frozenset()) -> Host:
    """A host that carries always the same core."""

    def build(life: int) -> Scripted:
        core.life = life
        return core

    return Host(name, build, raw)


def parcel(channel: str, peer: str, message: Message, source: str | None = None) -> Parcel:
    """A frame from a peer, under its own name unless told otherwise."""
    return Parcel(channel, peer, encode(header_of(message, source=source or peer), message))
