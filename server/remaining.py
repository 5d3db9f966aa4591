"""The places that robots bid for and that are left, and why; see also `server.frontiers_left`."""

from __future__ import annotations

import numpy as np

from coordination.bid import RobotBid, near
from coordination.tried_places import TriedPlaces
from mapping.geometry import Floats
from server.pool import Pool

# Frontier places of different bids closer than this are one [m].
SAME_PLACE = 0.3

# Why a place was left; the first of them goes on with how often it was tried.
GIVEN_UP = "given up after"
UNREACHABLE = "unreachable for this body"
BELOW_MINIMUM = "below the minimum gain"
ENDED_FIRST = "not visited: mission ended first"


def frontiers(pool: Pool) -> tuple[Floats, Floats, Floats]:
    """Return the frontiers that the robots' bids on the newest map speak of.

    Older bids speak of places that have been explored meanwhile.

    Returns:
        places (n, 2) [m] that some robot can get to, the most any of them expects there (n,) [m2],
        and places (k, 2) [m] that none of them can get to.
    """
    newest = _newest_bids(pool)
    places = np.concatenate([bid.places for bid in newest] or [np.empty((0, 2))])
    gains = np.concatenate([bid.gains for bid in newest] or [np.empty(0)])
    best_first = np.argsort(-gains, kind="stable")
    kept = _distinct(places[best_first])
    reachable, worth = places[best_first][kept], gains[best_first][kept]
    closed = np.concatenate([bid.unreachable for bid in newest] or [np.empty((0, 2))])
    closed = closed[~near(closed, reachable, SAME_PLACE)]
    return reachable, worth, closed[_distinct(closed)]


def remaining(pool: Pool, tried: TriedPlaces, min_gain: float) -> list[dict[str, object]]:
    """Return every place of a bid that is left, with the reason.

    Args:
        pool: the robots with their newest bids.
        tried: what was tried in vain.
        min_gain: the least gain worth a trip [m2].

    Returns:
        x_m, y_m, gain_m2 (None where no robot can tell), reason; for a place that was given up also
        `tries`, what each try came to.
    """
    places, gains, closed = frontiers(pool)
    rows = [(place, float(gain)) for place, gain in zip(places, gains, strict=True)]
    left = [place_left(place, gain, tried, min_gain) for place, gain in rows]
    return left + [place_left(place, None, tried, min_gain) for place in closed]


def place_left(
    place: Floats, gain: float | None, tried: TriedPlaces, min_gain: float
) -> dict[str, object]:
    """Return why a place (2,) [m] was left; the arguments are those of `remaining`."""
    x, y = float(place[0]), float(place[1])
    entry: dict[str, object] = {"x_m": x, "y_m": y, "gain_m2": gain}
    given_up = tried.given_up_at((x, y))
    if given_up is not None:
        reason = f"{GIVEN_UP} {given_up.tries} tries"
        return {**entry, "reason": reason, "tries": list(given_up.reasons)}
    if gain is None:
        return {**entry, "reason": UNREACHABLE}
    if gain < min_gain:
        return {**entry, "reason": BELOW_MINIMUM}
    return {**entry, "reason": ENDED_FIRST}


def _newest_bids(pool: Pool) -> list[RobotBid]:
    bids = [member.bid for member in pool if member.bid is not None]
    newest = max((bid.map_number for bid in bids), default=0)
    return [bid for bid in bids if bid.map_number == newest]


def _distinct(places: Floats) -> list[int]:
    """Return rows of `places` (n, 2) no two of which are the same place, first come first kept."""
    kept: list[int] = []
    for row in range(len(places)):
        if not near(places[row : row + 1], places[kept], SAME_PLACE)[0]:
            kept.append(row)
    return kept
