"""Who is who among robots that see discs of each other's size.

Each pair of sightings that may be two robots seeing each other is a guess. Guesses exclude each
other, and the team as a whole is explained by those that together explain the most: a pair counts
one, and one more for each other disc that both see in the same place. All combinations are weighed,
which takes long if there are many guesses; see `crowd` for those.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mapping.geometry import Pose2


@dataclass(frozen=True, slots=True)
class SightingPair:
    """Two robots that may have seen each other.

    Attributes:
        a: one.
        i: which of its discs is b.
        b: the other.
        j: which of its discs is a.
        T_a_b: how their local maps lie to each other then.
        apart: how far apart they stand [m].
        common: how many other discs both see in the same place.
    """

    a: str
    i: int
    b: str
    j: int
    T_a_b: Pose2
    apart: float
    common: int = 0

    def excludes(self, other: SightingPair) -> bool:
        """Whether both cannot be true: they share a sighting, or the robots."""
        mine, theirs = (
            {(self.a, self.i), (self.b, self.j)},
            {(other.a, other.i), (other.b, other.j)},
        )
        return bool(mine & theirs) or (self.a, self.b) == (other.a, other.b)


def sure_pairs(pairs: Sequence[SightingPair]) -> list[SightingPair]:
    """Return the pairs without which the team is not explained as well."""
    best = _best_choices(list(pairs), frozenset())
    return [pair for pair in pairs if all(pair in choice for choice in best)]


def _best_choices(
    pairs: Sequence[SightingPair], chosen: frozenset[SightingPair]
) -> list[frozenset[SightingPair]]:
    """Return all sets of pairs that can be true together and explain most, `chosen` in them."""
    if not pairs:
        return [chosen]
    first, rest = pairs[0], pairs[1:]
    found = _best_choices([p for p in rest if not p.excludes(first)], chosen | {first})
    if any(pair.excludes(first) for pair in rest):
        found = found + _best_choices(rest, chosen)
    most = max(_explained(choice) for choice in found)
    return [choice for choice in found if _explained(choice) == most]


def _explained(choice: frozenset[SightingPair]) -> int:
    """Return how much a set of pairs explains."""
    return sum(1 + pair.common for pair in choice)
