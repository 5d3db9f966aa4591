"""People who lie in the building: where they are, and a check that they can be there.

They are not solid: a laser looks over them, and robots may drive past.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapping.geometry import Floats
from protocol.fields import Name
from sim_world.errors import WorldError
from sim_world.scene import Scene

_Metres = Annotated[float, Field(allow_inf_nan=False)]
# A victim lies on free floor when nothing solid is this near to the middle of it [m].
_ELBOW_ROOM = 0.1


class Victim(BaseModel):
    """Somebody who lies at x, y [m] of the world."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: Name
    x: _Metres
    y: _Metres


def places_of(victims: Sequence[Victim]) -> Floats:
    """Return where victims lie, (N, 2) [m], world frame."""
    return np.array([(victim.x, victim.y) for victim in victims]).reshape(-1, 2)


def check_victims(scene: Scene, victims: Sequence[Victim]) -> None:
    """Refuse victims where nobody can lie, and two of one name.

    Raises:
        WorldError: names the victim and the place.
    """
    x_min, y_min, x_max, y_max = scene.extent
    for i, victim in enumerate(victims):
        if any(victim.id == other.id for other in victims[:i]):
            raise WorldError(f"two victims are named '{victim.id}'; give each its own id")
        where = f"victim '{victim.id}' cannot lie at ({victim.x:g}, {victim.y:g})"
        if not (x_min <= victim.x <= x_max and y_min <= victim.y <= y_max):
            raise WorldError(
                f"{where}: that is outside the world, which reaches from "
                f"({x_min:.2f}, {y_min:.2f}) to ({x_max:.2f}, {y_max:.2f}); move it inside"
            )
        if scene.collides(victim.x, victim.y, _ELBOW_ROOM):
            raise WorldError(f"{where}: something solid is there; move it onto free floor")
