"""A detector of victims: it tells where somebody lies, but not who; sometimes it overlooks one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from mapping.geometry import Floats, Pose2
from protocol import body as description

# No victim is told nearer than this [m], whatever the noise.
_RANGE_MIN = 0.01


class Opaque(Protocol):
    """Anything that one cannot look through."""

    def walls_between(self, x1: float, y1: float, x2: float, y2: float) -> int:
        """Return how many solid things the straight line between two points [m] crosses."""


@dataclass(frozen=True, slots=True)
class DetectorSpec:
    """What a detector can do; it sits at the centre of the body and looks along +x.

    Attributes:
        range_max: reach [m].
        half_view: bearing of the edge of its view, either side [rad].
        miss: probability of overlooking one victim in one look.
        sigma_range: standard deviation of the distance, as a share of it.
        sigma_bearing: standard deviation of the bearing [rad].
    """

    range_max: float
    half_view: float
    miss: float
    sigma_range: float
    sigma_bearing: float


def detector_of(settings: description.VictimDetector) -> DetectorSpec | None:
    """Return the detector of a body's settings, or None where the body has none."""
    if settings.range_m == 0.0:
        return None
    return DetectorSpec(
        settings.range_m,
        0.5 * math.radians(settings.field_of_view_deg),
        settings.miss,
        settings.noise_range,
        math.radians(settings.noise_bearing_deg),
    )


def detect(
    T_world_base: Pose2,
    scene: Opaque,
    victims_world: Floats,
    spec: DetectorSpec,
    rng: np.random.Generator,
) -> npt.NDArray[np.float32]:
    """Return where one look makes out victims, (k, 2) float32 [m], base frame, nearest first.

    A victim is made out within reach and view when no wall is between; other robots hide nobody.
    The same number of random draws is made at every call, whatever is seen.

    Args:
        T_world_base: the body in the world.
        scene: what is solid.
        victims_world: (N, 2) where they lie [m].
        spec: the detector.
        rng: source of noise and oversight.
    """
    places = T_world_base.inverse().apply(victims_world)
    distances = np.hypot(places[:, 0], places[:, 1])
    bearings = np.arctan2(places[:, 1], places[:, 0])
    overlooked = rng.random(len(places)) < spec.miss
    noise = rng.standard_normal((len(places), 2))
    seen = (distances <= spec.range_max) & (np.abs(bearings) <= spec.half_view) & ~overlooked
    for k in np.flatnonzero(seen).tolist():
        x, y = victims_world[k].tolist()
        seen[k] = scene.walls_between(T_world_base.x, T_world_base.y, x, y) == 0
    told = np.maximum(distances * (1.0 + spec.sigma_range * noise[:, 0]), _RANGE_MIN)
    turned = bearings + spec.sigma_bearing * noise[:, 1]
    points = np.column_stack((told * np.cos(turned), told * np.sin(turned)))[seen]
    # The order in which a world file names them must not tell who is who.
    nearest: npt.NDArray[np.float32] = points[np.argsort(told[seen], kind="stable")].astype(
        np.float32
    )
    return nearest
