"""Where a robot's local map lies in the team's, by what robots saw of each other.

Those between it and a robot that is tied to the team's map need not be tied themselves yet.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mapping.geometry import Floats, Pose2
from mapping.mutual_sightings import MutualSightings, Relation
from mapping.pose_graph import carried_covariance, turned_covariance


class LocalFrame(Protocol):
    """What is known of where a robot's local map lies in the team's."""

    @property
    def T_map_odom(self) -> Pose2:  # noqa: N802
        """Where it lies, as known or as told."""
        ...

    @property
    def told(self) -> tuple[float, float]:
        """Largest errors of the start that the robot was told [m], [rad]."""
        ...

    @property
    def aligned(self) -> bool:
        """Whether that is known; else it was only told."""
        ...


@dataclass(frozen=True, slots=True)
class Guess:
    """Where a robot's local map may lie in the team's.

    Attributes:
        T_map_odom: there.
        covariance: (3, 3) of it, map frame.
        seen: whether teammates saw the robot there; else it was told.
    """

    T_map_odom: Pose2
    covariance: Floats
    seen: bool

    @property
    def sigmas(self) -> tuple[float, float]:
        """One standard deviation along the worse axis [m], and of the heading [rad]."""
        place = math.sqrt(max(self.covariance[0, 0], self.covariance[1, 1]))
        return place, math.sqrt(self.covariance[2, 2])


def seen_by_others(
    name: str, frames: Mapping[str, LocalFrame], sightings: MutualSightings
) -> Relation | None:
    """Return where a robot's local map lies in the team's by what robots saw of each other.

    Args:
        name: the robot; it is not tied to the team's map.
        frames: of all robots, by name.
        sightings: what they saw from where they started.

    Returns:
        None if no chain of sightings leads to it from a robot that is tied.
    """
    told = {other: frame.T_map_odom for other, frame in frames.items()}
    sigma = max(frame.told[0] for frame in frames.values())
    turn_sigma = max(frame.told[1] for frame in frames.values())
    # One frame was turned by its own error; so the offset's error may be longer than two.
    relations = sightings.relations(told, 3.0 * sigma, 2.0 * turn_sigma)
    found = {
        other: Relation(known.T_map_odom, np.zeros((3, 3)))
        for other, known in frames.items()
        if known.aligned
    }
    while name not in found:
        step = _surest_step(found, relations)
        if step is None:
            return None
        found[step[0]] = step[1]
    return found[name]


def _surest_step(
    found: Mapping[str, Relation], relations: Mapping[tuple[str, str], Relation]
) -> tuple[str, Relation] | None:
    """Return the robot whose heading is known best by those whose maps lie in the team's already.

    Args:
        found: how local maps lie in the team's, by robot, and the covariance of that, map frame.
        relations: between local maps, see `MutualSightings.relations`.

    Returns:
        Its name, and how its local map lies in the team's; None if nobody found saw another.
    """
    best = None
    for (one, other), relation in relations.items():
        if one not in found or other in found:
            continue
        T_map_one, known = found[one].T_a_b, found[one].covariance
        T_map_other = T_map_one @ relation.T_a_b
        dx, dy = T_map_other.x - T_map_one.x, T_map_other.y - T_map_one.y
        covariance = carried_covariance(known, dx, dy)
        covariance += turned_covariance(relation.covariance, -T_map_one.theta)
        if best is None or covariance[2, 2] < best[1].covariance[2, 2]:
            best = other, Relation(T_map_other, covariance)
    return best
