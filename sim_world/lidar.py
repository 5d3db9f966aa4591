"""A laser range finder: exact rays through the scene and past other robots, and noise on top."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
import numpy.typing as npt

from mapping.geometry import IDENTITY, Floats, Pose2
from sim_world.raycast import cast_discs

# A sensor reports no range below this [m], whatever the noise.
RANGE_MIN = 0.01


class Castable(Protocol):
    """Anything that stops rays."""

    def cast(self, T_world_laser: Pose2, bearings: Floats, range_max: float) -> Floats:
        """Return the range (beams,) [m] along each bearing (beams,) [rad] from the laser's +x."""


@dataclass(frozen=True, slots=True)
class LaserSpec:
    """A laser range finder; the default is a 360 degree one with a beam per degree.

    Attributes:
        beams: number of beams in a sweep.
        bearing_start: bearing of the first beam [rad], counter-clockwise from laser +x.
        bearing_step: bearing from one beam to the next [rad].
        range_max: reach [m].
        sigma: standard deviation of the range noise [m].
        T_base_laser: where the laser sits on the robot.
    """

    beams: int = 360
    bearing_start: float = -math.pi
    bearing_step: float = 2.0 * math.pi / 360.0
    range_max: float = 10.0
    sigma: float = 0.03
    T_base_laser: Pose2 = IDENTITY

    @property
    def bearings(self) -> Floats:
        """Bearings of all beams, (beams,) [rad], read-only."""
        return _bearings(self.beams, self.bearing_start, self.bearing_step)


@lru_cache(maxsize=64)
def _bearings(beams: int, start: float, step: float) -> Floats:
    """Return `beams` bearings [rad] from `start` on, read-only."""
    bearings: Floats = start + step * np.arange(beams, dtype=np.float64)
    bearings.flags.writeable = False
    return bearings


def measure(
    T_world_laser: Pose2,
    scene: Castable,
    other_discs: npt.ArrayLike,
    spec: LaserSpec,
    rng: np.random.Generator,
) -> npt.NDArray[np.float32]:
    """Return what the laser reads, (beams,) float32 [m]: exact ranges plus Gaussian noise.

    Only beams that return carry noise, and noise never turns a return into a beam without one, nor
    takes it below `RANGE_MIN`. Beams without a return read exactly `range_max`. The same number of
    random draws is made at every call, whatever the laser sees.

    Args:
        T_world_laser: the laser in the world.
        scene: what is solid.
        other_discs: (D, 3) as centre x, y and radius [m] of the other robots, world frame.
        spec: the laser.
        rng: source of the noise.
    """
    bearings = spec.bearings
    exact = scene.cast(T_world_laser, bearings, spec.range_max)
    discs = np.asarray(other_discs, dtype=np.float64).reshape(-1, 3)
    if len(discs):
        exact = np.minimum(exact, cast_discs(discs, T_world_laser, bearings, spec.range_max))
    noise = spec.sigma * rng.standard_normal(spec.beams)
    reach = np.float32(spec.range_max)
    just_below = np.nextafter(reach, np.float32(0.0))
    noisy = np.clip((exact + noise).astype(np.float32), np.float32(RANGE_MIN), just_below)
    return np.where(exact < spec.range_max, noisy, reach)
