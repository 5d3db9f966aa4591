"""What happens to frames on their way: delay, loss, duplicates, overtaking; all by chance."""

from __future__ import annotations

import numpy as np

from sim_world.radio.settings import RadioSettings


class Disturbance:
    """Draws what the air does to each frame.

    Nothing is drawn for what is switched off, so that a setting of nought is no setting.

    Args:
        settings: probabilities and times.
        rng: source of all chance.
    """

    def __init__(self, settings: RadioSettings, rng: np.random.Generator) -> None:
        self._settings = settings
        self._rng = rng
        self._latest: dict[tuple[str, str], float] = {}

    def lost(self) -> bool:
        """Whether a receiver does not get the frame."""
        return self._happens(self._settings.loss)

    def arrivals(self, sender: str, receiver: str, through: float) -> list[float]:
        """Return when a frame arrives [s], and when its duplicate, if there is one.

        A frame that is not held back arrives no earlier than those before it on the same link.

        Args:
            sender: one end of the link.
            receiver: the other one.
            through: when the frame was through the channel [s].
        """
        settings, link = self._settings, (sender, receiver)
        arrival = through + self._delay()
        if self._happens(settings.reordering):
            arrival += settings.reordering_delay_s * float(self._rng.random())
        elif settings.jitter_s > 0.0:
            arrival = self._latest[link] = max(arrival, self._latest.get(link, 0.0))
        if not self._happens(settings.duplication):
            return [arrival]
        return [arrival, arrival + settings.jitter_s * float(self._rng.random())]

    def _delay(self) -> float:
        """Return latency and jitter of one frame [s]."""
        jitter = self._settings.jitter_s
        return self._settings.latency_s + (jitter * float(self._rng.random()) if jitter else 0.0)

    def _happens(self, probability: float) -> bool:
        """Draw an event of this probability."""
        return probability > 0.0 and float(self._rng.random()) < probability
