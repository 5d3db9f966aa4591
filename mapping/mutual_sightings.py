"""Who saw whom at the start: relative poses of robots that see each other.

Robots begin in view of one another (Simmons et al. 2000, section "Coordinated Mapping"). Each
turns once on the spot and tells where it saw discs of a teammate's size. Where A sees B and B sees
A, the two places fix how their local maps lie to each other: B stands where A sees it, and the
directions in which they see each other differ by half a turn. Who is who follows from what they
were told: their distance must be the same from both sides, and their headings as told, within the
errors; with the wrong teammate they come out wrong by a large angle. Of three in a row the outer
two both see the one between them, and could take it for each other: so each sighting counts once,
and the team as a whole is explained as well as can be: by as many pairs, and by as many others whom
both of a pair see in the same place (see `sighting_pairs`). A pair that can be explained in two
ways is left to what the walls tell.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mapping.crowd import SAME, View, lay_together
from mapping.geometry import Floats, Pose2, fit_rigid, wrap_angle
from mapping.sighting_pairs import SightingPair, sure_pairs

# A robot that moved farther than this [m] from where it looked around no longer counts.
STANDING = 0.1
# A disc must have been seen so often.
_SEEN_LEAST = 2
# More discs than these are no teammates: who sees that much stands among posts, or talks nonsense.
_DISCS_MOST = 32
# So many guesses of who saw whom are weighed against each other in all combinations.
_WEIGHED_MOST = 24
# Error of a sighted place [m], most of it across the line of sight.
_SIGMA = 0.02


@dataclass(slots=True)
class Lookout:
    """What one robot saw from where it stood first.

    Attributes:
        place_odom: where it stood (2,) [m], odom frame.
        turn_variance: of its heading by now [rad^2], odom frame: without walls it drifts.
        sums: (k, 3) sums of x, y [m] and number of the sightings of each disc, odom frame.
    """

    place_odom: Floats
    turn_variance: float = 0.0
    sums: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def discs(self) -> Floats:
        """Where discs were seen often enough, (k, 2) [m], odom frame."""
        often = self.sums[self.sums[:, 2] >= _SEEN_LEAST]
        places: Floats = often[:, :2] / often[:, 2:]
        return places


@dataclass(frozen=True, slots=True)
class Relation:
    """How two local maps lie to each other; each began where its robot stood.

    Attributes:
        T_a_b: pose of b's odom frame in a's.
        covariance: (3, 3) of it, in a's frame.
    """

    T_a_b: Pose2
    covariance: Floats


class MutualSightings:
    """What all robots saw of each other from where they started."""

    def __init__(self) -> None:
        self._lookouts: dict[str, Lookout] = {}

    def forget(self, robot: str) -> None:
        """A robot starts anew."""
        self._lookouts.pop(robot, None)

    def lookout(self, robot: str) -> Lookout | None:
        """Return what a robot saw so far, None if it told nothing."""
        return self._lookouts.get(robot)

    def put(self, robot: str, place_odom: Floats, turn_variance: float, discs: Floats) -> None:
        """Take over all that a robot saw, from its own `Lookout`.

        Args:
            robot: its name.
            place_odom: where it stood (2,) [m], odom frame.
            turn_variance: of its heading [rad^2].
            discs: (k, 2) [m] where it saw discs often enough, odom frame.
        """
        often = np.full((len(discs), 1), float(_SEEN_LEAST))
        sums = np.hstack((discs * often, often))[:_DISCS_MOST]
        self._lookouts[robot] = Lookout(place_odom, turn_variance, sums)

    def add(
        self, robot: str, T_odom_base: Pose2, covariance: Floats, sightings_odom: Floats
    ) -> None:
        """Take in what a robot saw.

        Args:
            robot: its name.
            T_odom_base: where it is.
            covariance: (3, 3) of that, odom frame.
            sightings_odom: (k, 2) [m] where it saw discs.
        """
        here = np.array([T_odom_base.x, T_odom_base.y])
        lookout = self._lookouts.setdefault(robot, Lookout(here))
        if float(np.hypot(*(here - lookout.place_odom))) > STANDING:
            return
        lookout.turn_variance = float(covariance[2, 2])
        for place in np.asarray(sightings_odom, dtype=np.float64):
            row = np.array([[place[0], place[1], 1.0]])
            if len(lookout.sums):
                means = lookout.sums[:, :2] / lookout.sums[:, 2:]
                off = np.hypot(means[:, 0] - place[0], means[:, 1] - place[1])
                k = int(off.argmin())
                if off[k] <= SAME:
                    lookout.sums[k] += row[0]
                    continue
            if len(lookout.sums) < _DISCS_MOST:
                lookout.sums = np.concatenate((lookout.sums, row))

    def relations(
        self, told: Mapping[str, Pose2], sigma: float, turn_sigma: float
    ) -> dict[tuple[str, str], Relation]:
        """Return how local maps lie to each other, for each pair that surely saw each other.

        Args:
            told: where each robot's local map lies as far as it was told, `T_map_odom` by name.
            sigma: the largest error between two of them in x and in y [m].
            turn_sigma: and in heading [rad].

        Returns:
            By the names (a, b) of a pair, in both orders.
        """
        names = sorted(name for name in self._lookouts if name in told)
        pairs: list[SightingPair] = []
        for k, a in enumerate(names):
            for b in names[k + 1 :]:
                T_a_b_told = told[a].inverse() @ told[b]
                pairs += self._pairs(a, b, T_a_b_told, sigma, turn_sigma)
        if len(pairs) <= _WEIGHED_MOST:
            sure = sure_pairs(pairs)
        else:
            views = {name: View(at.place_odom, at.discs) for name, at in self._lookouts.items()}
            sure = lay_together(pairs, {name: views[name] for name in names})
        found = {}
        for pair in sure:
            one, other = self._lookouts[pair.a], self._lookouts[pair.b]
            turn = 2.0 * (_SIGMA / pair.apart) ** 2 + one.turn_variance + other.turn_variance
            for near, key, T in (
                (one, (pair.a, pair.b), pair.T_a_b),
                (other, (pair.b, pair.a), pair.T_a_b.inverse()),
            ):
                place = _SIGMA**2 + pair.apart**2 * near.turn_variance
                found[key] = Relation(T, np.diag([place, place, turn]))
        return found

    def _pairs(
        self, a: str, b: str, T_a_b_told: Pose2, sigma: float, turn_sigma: float
    ) -> list[SightingPair]:
        """Return all ways in which two robots may have seen each other."""
        one, other = self._lookouts[a], self._lookouts[b]
        pairs = []
        for i, seen_b in enumerate(one.discs):
            for j, seen_a in enumerate(other.discs):
                places_a = np.stack((one.place_odom, seen_b))
                places_b = np.stack((seen_a, other.place_odom))
                apart = float(np.hypot(*(places_a[1] - places_a[0])))
                if abs(apart - float(np.hypot(*(places_b[1] - places_b[0])))) > 0.5 * SAME:
                    continue
                T_a_b = fit_rigid(places_a, places_b)
                reach = sigma + apart * turn_sigma + 0.1
                if (
                    apart > SAME
                    and abs(wrap_angle(T_a_b.theta - T_a_b_told.theta)) <= turn_sigma + 0.05
                    and abs(T_a_b.x - T_a_b_told.x) <= reach
                    and abs(T_a_b.y - T_a_b_told.y) <= reach
                ):
                    common = _in_common(one.discs, other.discs, T_a_b, i, j)
                    pairs.append(SightingPair(a, i, b, j, T_a_b, apart, common))
        return pairs


def _in_common(discs_a: Floats, discs_b: Floats, T_a_b: Pose2, i: int, j: int) -> int:
    """Return how many discs both robots see in the same place, besides each other.

    Args:
        discs_a: (k, 2) [m], where a sees discs, its odom frame; number i is b.
        discs_b: (m, 2) [m], likewise; number j is a.
        T_a_b: pose of b's frame in a's.
        i: see above.
        j: see above.
    """
    theirs = T_a_b.apply(np.delete(discs_b, j, axis=0))
    mine = np.delete(discs_a, i, axis=0)
    off = np.hypot(*(mine[:, None, :] - theirs[None, :, :]).transpose(2, 0, 1))
    near: int = int((off.min(axis=1, initial=np.inf) <= SAME).sum())
    return near
