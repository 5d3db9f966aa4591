"""Numbers in the text of a log, which may be damaged anywhere."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mapping.geometry import Pose2, wrap_angle

FARTHEST = 1e5
"""No robot's odometry and no laser's reading goes beyond this [m]."""

MOST_READINGS = 100_000
"""No laser has more beams."""

REMEMBERED = 100_000


class DamagedError(ValueError):
    """A line that cannot be used; the text says why in a few words."""


def number(text: str) -> float:
    """Return a finite number.

    Raises:
        DamagedError: it is none, or not finite.
    """
    try:
        value = float(text)
    except ValueError:
        raise DamagedError(f"{_shown(text)} is not a number") from None
    if not math.isfinite(value):
        raise DamagedError(f"{_shown(text)} is not finite")
    if "_" in text or not text.isascii():  # Python reads 1_0 as ten: in a log it is damage
        raise DamagedError(f"{_shown(text)} is not a number")
    return value


def count(text: str) -> int:
    """Return how many values follow.

    Raises:
        DamagedError: it is no such count.
    """
    if not (text.isascii() and text.isdecimal() and len(text) <= 9):
        raise DamagedError(f"{_shown(text)} is not a count")
    value = int(text)
    if value > MOST_READINGS:
        raise DamagedError(f"{value} readings are more than any laser has")
    return value


def pose(texts: Sequence[str]) -> Pose2:
    """Return the pose for texts x, y [m], theta [rad].

    Raises:
        DamagedError: one of them is no number, or absurdly large.
    """
    x, y, theta = (number(text) for text in texts)
    if max(abs(x), abs(y), abs(theta)) > FARTHEST:
        raise DamagedError("a pose is absurdly far away")
    return Pose2(x, y, wrap_angle(theta))


class Ranges(dict[str, float]):
    """Ranges [m] by their text, which is checked and converted once.

    Lasers count in centimetres or millimetres: a log of millions of readings has a few thousand
    different ones, so that looking them up is twice as fast as converting them.

    Raises:
        DamagedError: when a text is looked up that is no range.
    """

    def __missing__(self, text: str) -> float:
        value = number(text)
        if not 0.0 <= value <= FARTHEST:
            raise DamagedError(f"{_shown(text)} is not a range")
        if len(self) < REMEMBERED:
            self[text] = value
        return value


def _shown(text: str) -> str:
    """Return a text as a message quotes it: damage may be long."""
    return repr(text if len(text) <= 20 else text[:20] + "...")
