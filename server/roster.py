"""Who belongs to the team, who is there, who fell silent, and where everybody was last."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mapping.geometry import IDENTITY
from protocol.body import Body
from protocol.codec import Header
from protocol.messages import Hello
from protocol.session import Session
from server.teammates import Whereabouts


class Roster:
    """The team as the server knows it.

    Attributes:
        robots: names that belong to the team; others are refused.
        states: what became of each robot, in words for people.
        bodies: of the robots that ever said hello, in the order of their coming.
        where: their last known places.
        observers: peers that want to hear everything that is published.
    """

    def __init__(self, robots: Sequence[str], silence: float) -> None:
        """Start with nobody there; a robot is silent after `silence` seconds."""
        self.robots = tuple(robots)
        self.states: dict[str, str] = dict.fromkeys(robots, "never seen")
        self.bodies: dict[str, Body] = {}
        self.where: dict[str, Whereabouts] = {}
        self.observers: list[str] = []
        self._silence = silence
        self._sessions: dict[str, Session] = {}

    def refusal(self, name: str, hello: Hello) -> str | None:
        """Return why a peer is not taken in, or None."""
        if hello.role == "robot" and name not in self.robots:
            known = ", ".join(self.robots)
            return f"no robot named {name!r} in this team; its robots are {known}"
        if hello.role != "robot" and name in self.robots:
            return f"{name!r} is a robot's name"
        return None

    def admit(self, name: str, hello: Hello, now: float) -> bool:
        """Take a peer in; return whether this is a new life of it."""
        silence = self._silence if hello.role == "robot" else math.inf
        session = self._sessions.setdefault(name, Session(name, silence))
        if hello.role == "observer" and name not in self.observers:
            self.observers.append(name)
        return session.hello(hello.incarnation, now)

    def enter(self, name: str, body: Body, now: float) -> bool:
        """Enter a robot's new life; return whether it was here before."""
        again = name in self.bodies
        self.bodies[name] = body
        self.where[name] = Whereabouts(body.radius_m, IDENTITY, now)
        self.states[name] = "at work"
        return again

    def accept(self, header: Header, now: float) -> bool:
        """Note a frame; return whether its peer was taken in and the frame is new."""
        session = self._sessions.get(header.source)
        return session is not None and session.accept(header, now)

    def find_silent(self, now: float) -> list[str]:
        """Return the robots that have just been silent for too long."""
        silent = [
            name
            for name in self.robots
            if name in self._sessions and self._sessions[name].check(now)
        ]
        for name in silent:
            self.states[name] = f"lost at {now:.1f} s"
        return silent

    def find_back(self, name: str) -> bool:
        """Note a sign of life; return whether a robot was lost and is back by it."""
        if not self.states.get(name, "").startswith("lost"):
            return False
        self.states[name] = "at work"
        return True

    def finish(self) -> None:
        """The mission is over: whoever was at work has finished."""
        for name, state in self.states.items():
            if state == "at work":
                self.states[name] = "finished"

    def deadlines(self) -> list[float]:
        """Return when robots could be found silent [s]."""
        due = [self._sessions[n].deadline for n in self.robots if n in self._sessions]
        return [deadline for deadline in due if deadline is not None]

    def present(self) -> list[str]:
        """Return the robots in contact, in the team's order."""
        return [
            name
            for name in self.robots
            if name in self._sessions and self._sessions[name].state == "open"
        ]

    def audience(self) -> list[str]:
        """Return everybody who hears what is published: robots in contact, then observers."""
        return [*self.present(), *self.observers]
