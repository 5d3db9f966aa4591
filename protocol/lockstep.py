"""Mission time in lockstep: the world moves on when every live process is done with an instant.

At instant k the world takes what the members sent at instant k-1 (by member name, then in the
order of sending), steps, and sends each member one bundle. A member handles its bundle, ticks, and
answers with one bundle. Every frame of a simulated team travels in these bundles, so the order in
which a core sees its events depends on nothing but the mission: the same over sockets
(`protocol.conduct`) and in one process (`protocol.in_process`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.effects import Note, Strike
from protocol.host import Host, Outbox, Parcel
from protocol.messages import WORLD

# What a channel is called at the other end.
FAR_END = {"body": "body", "clock": "clock", "radio": "radio", "fleet": "uplink", "uplink": "fleet"}


@dataclass(slots=True)
class Member:
    """A process in lockstep, as the world sees it.

    Attributes:
        deadline: mission time [s] at which it wants to be woken; None for only by messages.
        frozen: it is not given any instants; what is sent to it waits.
        dead: a scripted fault ended it; what is sent to it is lost, until it is restarted.
        waiting: parcels that are to go with its next bundle.
        sent: parcels it sent at the instant that is running.
        strike: a scripted fault for its next bundle: `kill`, `restart` or `reboot`.
        incarnation: which life of the process this is, from 0.
    """

    deadline: float | None = 0.0
    frozen: bool = False
    dead: bool = False
    waiting: list[Parcel] = field(default_factory=list)
    sent: list[Parcel] = field(default_factory=list)
    strike: str | None = None
    incarnation: int = 0


class Bundle(NamedTuple):
    """All that one member gets at one instant."""

    member: str
    now: float
    parcels: list[Parcel]
    strike: str | None = None
    incarnation: int = 0


class Conductor:
    """The world's side of lockstep, without sockets.

    Call `begin` for the bundles of the next instant, `done` for each member's answer (or `left`),
    and when `awaited` is empty `begin` again, until `stopped` is set.
    """

    def __init__(self, world: Host, step: float) -> None:
        self.world = world
        self.step = step
        self.instant = 0
        self.members: dict[str, Member] = {}
        self.awaited: set[str] = set()
        self.notes: list[Note] = []
        self.stopped: str | None = None
        self._departed: dict[str, list[Parcel]] = {}
        self._lives: Counter[str] = Counter()

    @property
    def now(self) -> float:
        """Mission time of the instant that is running [s]."""
        return self.instant * self.step

    def join(self, name: str) -> int:
        """Take a process in, from the next instant on; return which life of it this is."""
        incarnation = self._lives[name]
        self._lives[name] += 1
        if self.instant == 0:
            self._departed.pop(name, None)  # the mission has not begun: nobody missed it
        self.members[name] = Member(incarnation=incarnation)
        return incarnation

    def left(self, name: str) -> None:
        """A process is gone; the world hears of it, after its last words, at the next instant."""
        member = self.members.pop(name, None)
        if member is not None:
            self.awaited.discard(name)
            self._departed[name] = member.sent

    def begin(self) -> list[Bundle]:
        """Move the world to the next instant; return the bundles of all members that are due."""
        self.instant += 1
        now = self.now
        sent = {name: member.sent for name, member in self.members.items()} | self._departed
        arrivals = [parcel for name in sorted(sent) for parcel in sent[name]]
        for member in self.members.values():
            member.sent = []
        departed, self._departed = sorted(self._departed), {}
        self._send(self.world.advance(arrivals, now))
        for name in departed:
            self._send(self.world.peer_left("body", name, now))
        bundles = [bundle for name in sorted(self.members) if (bundle := self._bundle(name, now))]
        self.awaited = {bundle.member for bundle in bundles if bundle.strike != "kill"}
        return bundles

    def done(self, name: str, parcels: Iterable[Parcel], deadline: float | None) -> None:
        """A member is done with the instant; `parcels` name the channels at the member's end."""
        member = self.members.get(name)
        self.awaited.discard(name)
        if member is None:
            return
        member.deadline = deadline
        member.sent += [Parcel(FAR_END[p.channel], name, p.frame) for p in parcels]

    def _bundle(self, name: str, now: float) -> Bundle | None:
        """Return a member's bundle, or None when it has nothing to do at this instant."""
        member = self.members[name]
        due = member.deadline is not None and member.deadline <= now
        if member.strike is None and (member.frozen or member.dead or not (due or member.waiting)):
            return None
        parcels, member.waiting = member.waiting, []
        strike, member.strike = member.strike, None
        return Bundle(name, now, parcels, strike, member.incarnation)

    def _send(self, outbox: Outbox) -> None:
        """Sort what the world wants done to the members it concerns."""
        for parcel in outbox.parcels:
            member = self.members.get(parcel.peer)
            if member is not None and not member.dead:
                member.waiting.append(Parcel(FAR_END[parcel.channel], WORLD, parcel.frame))
        for strike in outbox.strikes:
            self._strike(strike)
        self.notes += outbox.notes
        if outbox.stop is not None:
            self.stopped = outbox.stop

    def _strike(self, strike: Strike) -> None:
        """Let a scripted fault hit a member."""
        member = self.members.get(strike.peer)
        if member is None:
            return
        if strike.kind in ("freeze", "thaw"):
            member.frozen = strike.kind == "freeze"
        else:
            member.strike = strike.kind
            if strike.kind in ("restart", "reboot"):
                member.incarnation = self._lives[strike.peer]
                self._lives[strike.peer] += 1
            member.dead = strike.kind == "kill"
            member.frozen = False
            member.waiting.clear()
            member.sent.clear()
