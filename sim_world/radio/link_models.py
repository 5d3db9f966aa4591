"""Who is in reach of whom: one class for each model of a radio link.

A new model is one class here and a row in `LINK_MODELS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Protocol

from sim_world.radio.settings import RadioSettings
from sim_world.radio.shadowing import Place, shadowing
from sim_world.scene import Scene

# Walls between two members are counted anew when one of them has moved by more than this [m].
_MOVED = 0.1


class LinkModel(Protocol):
    """A model of the link between two members."""

    def reaches(self, sender: str, receiver: str, places: Mapping[str, Place]) -> bool:
        """Whether `receiver` gets a frame that `sender` sends.

        Args:
            sender: name of a member.
            receiver: likewise.
            places: (x, y) [m] of every member, world frame.
        """


class Perfect:
    """Everybody is in reach."""

    def __init__(self, settings: RadioSettings, scene: Scene, seed: int) -> None:
        del settings, scene, seed

    def reaches(self, sender: str, receiver: str, places: Mapping[str, Place]) -> bool:
        """Whether `receiver` gets a frame that `sender` sends: it does, wherever they are."""
        return True


class Disc:
    """Whoever is within a range is in reach, walls or not."""

    def __init__(self, settings: RadioSettings, scene: Scene, seed: int) -> None:
        del scene, seed
        self._range = settings.range_m

    def reaches(self, sender: str, receiver: str, places: Mapping[str, Place]) -> bool:
        """Whether the two are within the range of each other."""
        return math.dist(places[sender], places[receiver]) <= self._range


class PathLoss:
    """Whoever receives a strong enough signal is in reach.

    The signal loses strength with the logarithm of the distance, with each wall on the straight
    line, and by fading that is fixed for each pair of places.

    Source: Rappaport 2002, eq. 4.69 (log-distance path loss with log-normal shadowing); Bahl &
    Padmanabhan 2000, wall attenuation factor (so much for each wall, up to a number of walls).
    """

    def __init__(self, settings: RadioSettings, scene: Scene, seed: int) -> None:
        self._settings = settings
        self._scene = scene
        self._seed = seed
        self._counted: dict[tuple[str, str], tuple[Place, Place, int]] = {}

    def reaches(self, sender: str, receiver: str, places: Mapping[str, Place]) -> bool:
        """Whether the signal is not below the receiver's floor where it arrives."""
        strength = self.strength(sender, receiver, places[sender], places[receiver])
        return strength >= self._settings.receiver_floor_dbm

    def strength(self, sender: str, receiver: str, a: Place, b: Place) -> float:
        """Return how strong a signal from (x, y) `a` is at `b` [dBm], the same both ways.

        Closer than a metre it loses as much as over a metre.
        """
        s = self._settings
        distance = max(math.dist(a, b), 1.0)
        loss = s.reference_loss_db + 10.0 * s.path_loss_exponent * math.log10(distance)
        if s.wall_loss_db > 0.0 and s.walls_max > 0:
            loss += s.wall_loss_db * min(self._walls(sender, receiver, a, b), s.walls_max)
        if s.fading_sigma_db > 0.0:
            loss += s.fading_sigma_db * shadowing(self._seed, a, b, s.fading_cell_m)
        return s.tx_power_dbm - loss

    def _walls(self, sender: str, receiver: str, a: Place, b: Place) -> int:
        """Return how many walls lie between, counted anew when one of the two has moved."""
        if sender > receiver:
            sender, receiver, a, b = receiver, sender, b, a
        known = self._counted.get((sender, receiver))
        if known and math.dist(known[0], a) <= _MOVED and math.dist(known[1], b) <= _MOVED:
            return known[2]
        count = self._scene.walls_between(*a, *b)
        self._counted[sender, receiver] = a, b, count
        return count


LINK_MODELS: dict[str, Callable[[RadioSettings, Scene, int], LinkModel]] = {
    "perfect": Perfect,
    "disc": Disc,
    "path_loss": PathLoss,
}


def link_model(settings: RadioSettings, scene: Scene, seed: int) -> LinkModel:
    """Return the model that the settings name; `seed` fixes its fading."""
    return LINK_MODELS[settings.model](settings, scene, seed)
