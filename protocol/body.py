"""What a robot is made of: its body, its wheels and its lidar.

Both sides need it: the world plays this body, the robot's own software plans with it.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    WrapSerializer,
)

from protocol.fields import NotNegative, Positive


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Lidar(_Part):
    """A scanning laser range finder at the centre of the body, looking along +x.

    The defaults are those of a SICK-like scanner: half a turn, one beam a degree.
    """

    field_of_view_deg: Annotated[float, Field(gt=0.0, le=360.0)] = 180.0
    beams: Annotated[int, Field(ge=2, le=4096)] = 180
    range_max_m: Annotated[float, Field(gt=0.1, le=200.0)] = 8.0
    noise_m: NotNegative = 0.03
    period_s: Positive = 0.2

    @property
    def bearing_step(self) -> float:
        """Angle from one beam to the next [rad]; a full turn does not repeat its first beam."""
        view = math.radians(self.field_of_view_deg)
        return view / (self.beams if self.field_of_view_deg >= 360.0 else self.beams - 1)

    @property
    def bearing_start(self) -> float:
        """Bearing of the first beam [rad], counter-clockwise from +x."""
        return -0.5 * math.radians(self.field_of_view_deg)


class Drive(_Part):
    """A differential drive and how far its odometry can be trusted.

    Odometry noise grows with the motion: over one metre the distance is off by
    `noise_distance` metres and the heading by `noise_heading_deg_m` degrees, over one radian turned
    by `noise_turn` radians, one sigma each; variances add up, so the step length does not matter.
    """

    speed_max_m_s: Positive = 0.5
    turn_rate_max_rad_s: Positive = 1.2
    acceleration_max_m_s2: Positive = 1.0
    turn_acceleration_max_rad_s2: Positive = 4.0
    noise_distance: NotNegative = 0.05
    noise_turn: NotNegative = 0.05
    noise_heading_deg_m: NotNegative = 2.0


class VictimDetector(_Part):
    """Makes out people who lie in the building, at each sweep of the lidar; `range_m` 0 is none.

    It sits at the centre of the body, looks along +x and not through walls. A look overlooks
    somebody with the probability `miss`; distances are off by the share `noise_range` of them and
    bearings by `noise_bearing_deg`, one sigma each. It tells places, not who lies there.
    """

    range_m: Annotated[float, Field(ge=0.0, le=200.0)] = 0.0
    field_of_view_deg: Annotated[float, Field(gt=0.0, le=360.0)] = 90.0
    miss: Annotated[float, Field(ge=0.0, le=1.0)] = 0.2
    noise_range: NotNegative = 0.05
    noise_bearing_deg: NotNegative = 2.0


class Body(_Part):
    """A round robot."""

    radius_m: Annotated[float, Field(gt=0.01, le=5.0)] = 0.25
    lidar: Lidar = Lidar()
    drive: Drive = Drive()
    victim_detector: VictimDetector = VictimDetector()


def _known(model: Any, value: Any) -> Any:
    """Return a table with only the keys that `model` has, also in the tables within."""
    if not isinstance(value, dict):
        return value
    kept = {}
    for key, field in model.model_fields.items():
        if key in value:
            nested = isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)
            kept[key] = _known(field.annotation, value[key]) if nested else value[key]
    return kept


def _told(body: Body, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
    """Return a body's table; where nothing is said of a victim detector, there is none."""
    table: dict[str, Any] = dump(body)
    if body.victim_detector == VictimDetector():
        del table["victim_detector"]
    return table


# In a settings file an unknown key is a slip of the pen; on the wire it is a newer minor version.
WireBody = Annotated[
    Body, BeforeValidator(lambda value: _known(Body, value)), WrapSerializer(_told)
]
