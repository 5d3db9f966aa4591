"""Victims: whom the team found, and whom it missed, against where they truly lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from expedition.results.record import RunRecord, place_of
from expedition.results.team_frame import transform_to_world
from mapping.geometry import Floats, Pose2

# A victim reported farther than this [m] from everybody who lies there is nobody.
MATCH_WITHIN = 2.0


@dataclass(frozen=True, slots=True)
class VictimMark:
    """A victim on the map.

    Attributes:
        x: [m], map frame.
        y: [m], map frame.
        found: whether the team reported it; else the truth alone knows it.
        text: one line about it.
    """

    x: float
    y: float
    found: bool
    text: str


def victim_section(record: RunRecord) -> dict[str, Any]:
    """Return the summary's `victims` and `victims_missed`; nothing where there were none.

    `victims`: `{x_m, y_m, seen_by, t_s, sightings, error_m, id}`, map frame. Each is laid onto the
    world by the team's one transform and matched with at most one true victim, all distances
    together as small as possible: `id` and `error_m` are that one's name and the distance, null
    where nobody lies within `MATCH_WITHIN`. `victims_missed`: `{id, x_m, y_m}`, world frame; null
    where they cannot be compared.
    """
    reported = _reported(record)
    lying = {} if record.truth is None else record.truth.victims
    if not reported and not lying:
        return {}
    T_world_map = transform_to_world(record)
    unknown = record.truth is None or (bool(reported) and T_world_map is None)
    matches = {} if unknown else _matches(reported, lying, T_world_map)
    victims = []
    for k, victim in enumerate(reported):
        id, error = matches.get(k, (None, None))
        told = {key: victim.get(key) for key in ("x_m", "y_m", "seen_by", "t_s", "sightings")}
        victims.append({**told, "error_m": error, "id": id})
    met = [id for id, _ in matches.values()]
    missed = [
        {"id": id, "x_m": float(place[0]), "y_m": float(place[1])}
        for id, place in sorted(lying.items())
        if id not in met
    ]
    return {"victims": victims, "victims_missed": None if unknown else missed}


def victim_marks(record: RunRecord) -> list[VictimMark]:
    """Return the marks of victims on the map, those that were missed first.

    A missed one has a mark only where the map's place in the world is known.
    """
    section = victim_section(record)
    marks = []
    T_world_map = transform_to_world(record) if section else None
    for victim in section.get("victims_missed") or ():
        if T_world_map is not None:
            x, y = T_world_map.inverse().apply([victim["x_m"], victim["y_m"]]).tolist()
            marks.append(VictimMark(x, y, False, f"victim {victim['id']} missed"))
    for victim in section.get("victims", ()):
        by, seen = victim["seen_by"], victim["sightings"]
        text = f"victim seen first by {by} at {victim['t_s']} s, {seen} times in all"
        marks.append(VictimMark(float(victim["x_m"]), float(victim["y_m"]), True, text))
    return marks


def _reported(record: RunRecord) -> list[dict[str, Any]]:
    """Return the victims that say where they are."""
    return [victim for victim in record.victims if place_of(victim) is not None]


def _matches(
    reported: list[dict[str, Any]], lying: dict[str, Floats], T_world_map: Pose2 | None
) -> dict[int, tuple[str, float]]:
    """Return who is whom: place in `reported` -> id and distance [m] of the true victim."""
    if not reported or not lying or T_world_map is None:
        return {}
    ids = sorted(lying)
    places_map = np.array([place_of(victim) for victim in reported])
    places_world = T_world_map.apply(places_map)
    true_world = np.array([lying[id] for id in ids]).reshape(-1, 2)
    apart = np.linalg.norm(places_world[:, None, :] - true_world[None, :, :], axis=2)
    # Pairs out of reach all cost the same, and so much that any pair within reach is worth more.
    dear = MATCH_WITHIN * (1 + min(apart.shape))
    rows, columns = linear_sum_assignment(np.where(apart <= MATCH_WITHIN, apart, dear))
    return {
        int(row): (ids[column], float(apart[row, column]))
        for row, column in zip(rows, columns, strict=True)
        if apart[row, column] <= MATCH_WITHIN
    }
