"""What is left to explore on the final map: one entry for each connected frontier, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from mapping.frontiers import find_frontiers
from mapping.grid import GridGeometry
from server.remaining import BELOW_MINIMUM, ENDED_FIRST, GIVEN_UP, UNREACHABLE

# Robots bid for places to stand at, up to a body and a step before the frontier itself [m].
NEAR = 1.0
# Shorter ones are noise in the map: robots do not bid for them either.
MIN_CELLS = 6

# Robots tell of their richest places only.
NOT_TOLD = "no robot bid for it: there was more to gain elsewhere"

# Of several places along one frontier that with the first of these reasons speaks for it.
_FIRST = (ENDED_FIRST, GIVEN_UP, BELOW_MINIMUM, UNREACHABLE)


def frontiers_left(
    classes: npt.NDArray[np.uint8],
    geometry: GridGeometry,
    places: Sequence[Mapping[str, object]],
) -> list[dict[str, object]]:
    """Return every connected frontier of a map, the most to gain first.

    Args:
        classes: (rows, cols) uint8 of `mapping.grid` classes.
        geometry: where they lie, map frame.
        places: what robots know of places along frontiers, see `server.remaining`.

    Returns:
        `x_m`, `y_m` of one place on it, `length_m` along its cells, `gain_m2` (None where no robot
        could tell), `reason`; for one that was given up also `tries`, what each try came to.
    """
    untold = NOT_TOLD if places else ENDED_FIRST
    found = find_frontiers(classes, spacing_cells=1, min_cells=MIN_CELLS)
    if not len(found):
        return []
    cells = geometry.centres_of(found.cells)
    _, first = np.unique(found.component, return_index=True)
    members: list[list[Mapping[str, object]]] = [[] for _ in first]
    for place in places:
        away = np.hypot(*(cells - np.array([place["x_m"], place["y_m"]], dtype=np.float64)).T)
        nearest = int(np.argmin(away))
        if away[nearest] <= NEAR:
            members[found.component[nearest]].append(place)
    left = []
    for row, known in zip(first.tolist(), members, strict=True):
        length = round(float(found.component_size[row]) * geometry.resolution, 2)
        middle = {"x_m": cells[row, 0], "y_m": cells[row, 1], "reason": untold}
        left.append(_entry(known or [middle], length))
    return sorted(left, key=_most_first)


def _entry(known: Sequence[Mapping[str, object]], length: float) -> dict[str, object]:
    """Return the entry of one frontier, which the most telling of its known places speaks for."""
    place = min(known, key=lambda one: (_rank(one), -_gain(one)))
    entry: dict[str, object] = {
        "x_m": _rounded(place["x_m"]),
        "y_m": _rounded(place["y_m"]),
        "length_m": length,
        "gain_m2": _rounded(max((one.get("gain_m2") for one in known), key=_worth)),
        "reason": place["reason"],
    }
    return {**entry, "tries": place["tries"]} if "tries" in place else entry


def _rank(place: Mapping[str, object]) -> int:
    reason = str(place["reason"])
    return next((k for k, begin in enumerate(_FIRST) if reason.startswith(begin)), len(_FIRST))


def _worth(gain: object) -> float:
    return float(gain) if isinstance(gain, int | float) else -1.0


def _gain(place: Mapping[str, object]) -> float:
    return _worth(place.get("gain_m2"))


def _most_first(entry: Mapping[str, object]) -> tuple[float, float]:
    return -_gain(entry), -_worth(entry["length_m"])


def _rounded(value: object) -> float | None:
    return round(float(value), 2) if isinstance(value, int | float) else None
