"""When a member tells what it holds: seldom when nothing changes, and not if another just did.

The interval doubles while nothing changes and starts anew from the shortest when something does.
Within each a member speaks once, at a random instant of its second half, unless it heard somebody
who holds all that it does itself, and nobody who needs to hear that there is more.

Source: Levis et al. 2004 (Trickle), section 3; RFC 6206, section 4.2, with k = 1.
"""

from __future__ import annotations

import numpy as np

_CONTACT = (0.2, 0.8)  # [s]; how soon a peer that was away is told


class Announcing:
    """The timer.

    Args:
        shortest: interval while something changes [s].
        longest: interval when nothing has changed for long [s].
        rng: for the instants.
        now: mission time [s].

    Attributes:
        due: when the next announcement is due [s].
    """

    def __init__(
        self, shortest: float, longest: float, rng: np.random.Generator, now: float
    ) -> None:
        self._shortest = shortest
        self._longest = longest
        self._rng = rng
        self._covered = False
        self._needed = False
        self._changed = False
        self.due = now
        self._begin(shortest, now)

    def change(self, now: float) -> None:
        """Something new is held, or lacking: this interval is a short one, and so is the next."""
        self._changed = True
        self._shorten(now)

    def contact(self, now: float) -> None:
        """A peer is here that was away: speak soon."""
        self._needed = True
        self.due = min(self.due, now + float(self._rng.uniform(*_CONTACT)))

    def hear(self, covers: bool, lacks: bool, back: bool, now: float) -> None:
        """Somebody announced what it holds.

        Args:
            covers: it holds all that this member would have to speak of.
            lacks: it does not know of something that this member would have to speak of.
            back: it was away.
            now: mission time [s].
        """
        self._covered |= covers
        if not lacks:
            return
        if back:
            self.contact(now)
        self._shorten(now)
        self._needed = True

    def speak(self, now: float) -> bool:
        """Begin the next interval; return whether to announce now."""
        wanted = self._needed or not self._covered
        grown = self._shortest if self._changed else min(2.0 * self._interval, self._longest)
        self._changed = False
        self._begin(grown, max(now, self._end))
        return wanted

    def _shorten(self, now: float) -> None:
        """Begin a short interval in place of a long one, and speak no later than meant before."""
        if self._interval > self._shortest:
            due, needed = self.due, self._needed
            self._begin(self._shortest, now)
            self.due, self._needed = min(self.due, due), needed

    def _begin(self, interval: float, now: float) -> None:
        """Begin an interval."""
        self._interval = interval
        self._end = now + interval
        self.due = now + float(self._rng.uniform(0.5, 1.0)) * interval
        self._covered = self._needed = False
