"""Leases: a robot keeps a task as long as it gets on with it and is heard.

A robot that is stuck, hung or out of reach must not hold a place that another could explore.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class LeaseTerms:
    """What keeps a lease.

    Attributes:
        patience: longest time without progress [s].
        silence: longest time without any contact [s].
        step: by how much the way left must shrink to count as progress [m]; jitter of the
            estimate does not.
        arrived: with this little way left [m] no further progress is due: a robot that waits at
            its place. 0 for a task that ends at its goal.
        detours: how often the way left may grow. A closed door makes a way longer, and getting on
            along the longer way is progress too; but a robot that runs to and fro between two
            ways must lose its lease in the end.
        detour: by how much the way left must grow to be taken for a detour [m].
    """

    patience: float
    silence: float
    step: float = 0.1
    arrived: float = 0.0
    detours: int = 4
    detour: float = 1.0


@dataclass(slots=True)
class Lease:
    """One lease, kept by progress and contact.

    Attributes:
        terms: what keeps it.
        started: when it was given [s].
    """

    terms: LeaseTerms
    started: float
    _shortest: float = field(default=math.inf)
    _progressed: float = field(init=False)
    _heard: float = field(init=False)
    _detours: int = field(default=0)

    def __post_init__(self) -> None:
        self._progressed = self.started
        self._heard = self.started

    def contact(self, now: float) -> None:
        """Note that the robot was heard at `now` [s]."""
        self._heard = max(self._heard, now)

    def renew(self, now: float) -> None:
        """Let the lease run on as if it were given at `now` [s]."""
        self._progressed = max(self._progressed, now)

    def progress(self, remaining: float, now: float) -> bool:
        """Note the way left, `remaining` [m], at `now` [s].

        Returns:
            Whether the way has really become shorter; a first report only says that it began.
        """
        self.contact(now)
        if remaining <= 0.0 and self.terms.arrived <= 0.0:
            return False  # at its goal it would have ended the task: it must know of no way
        if remaining <= self._shortest - self.terms.step:
            first = math.isinf(self._shortest)
            self._shortest = remaining
            self.renew(now)
            return not first
        longer = remaining > self._shortest + self.terms.detour
        if longer and self._detours < self.terms.detours:
            self._detours += 1
            self._shortest = remaining
        return False

    @property
    def deadline(self) -> float:
        """When the lease ends [s] if nothing more is heard."""
        silent = self._heard + self.terms.silence
        if self._shortest <= self.terms.arrived:
            return silent
        return min(silent, self._progressed + self.terms.patience)

    def violation(self, now: float) -> str | None:
        """Return why the lease has ended by `now` [s], or None while it lasts."""
        if now < self.deadline:
            return None
        if now >= self._heard + self.terms.silence:
            return f"silent for {now - self._heard:.0f} s"
        return f"no progress for {now - self._progressed:.0f} s"
