"""Field types of messages: arrays with a declared shape, poses, names, finite numbers.

Everything from outside is hostile until validated here: dtype, number of dimensions, number of
elements and finiteness of arrays; finiteness and range of numbers; characters of names.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, BeforeValidator, Field, GetCoreSchemaHandler, PlainSerializer
from pydantic_core import core_schema

from mapping.geometry import Pose2, wrap_angle

LARGEST_COORDINATE = 1.0e5  # [m]; a pose farther out than 100 km is a fault, not a place
LARGEST_EDGE = 20_000  # rows or columns of a map that can be said at all


@dataclass(frozen=True, slots=True)
class ArrayField:
    """What an array in a message must look like.

    Attributes:
        dtype: numpy name of the element type, little-endian on the wire.
        shape: one entry per dimension; None leaves it free.
        max_elements: the most elements it may hold.
        finite: whether NaN and infinities are refused.
        omit_empty: whether a frame leaves it out when it is empty; its default must be empty, too.
    """

    dtype: str
    shape: tuple[int | None, ...]
    max_elements: int
    finite: bool = True
    omit_empty: bool = False

    def check(self, value: object) -> npt.NDArray[Any]:
        """Return `value` as a read-only contiguous array of the declared kind.

        Raises:
            ValueError: it is not such an array.
        """
        if not isinstance(value, np.ndarray):
            raise ValueError("not an array")
        if value.dtype != self.dtype:
            raise ValueError(f"dtype {value.dtype}, want {self.dtype}")
        if value.ndim != len(self.shape):
            raise ValueError(f"{value.ndim} dimensions, want {len(self.shape)}")
        for have, want in zip(value.shape, self.shape, strict=True):
            if want is not None and have != want:
                raise ValueError(f"shape {value.shape}, want {self.shape}")
        if value.size > self.max_elements:
            raise ValueError(f"{value.size} elements, at most {self.max_elements}")
        if self.finite and value.dtype.kind == "f" and not _all_finite(value):
            raise ValueError("not all finite")
        if value.flags.c_contiguous and not value.flags.writeable:
            return value
        array = np.ascontiguousarray(value).view()
        array.flags.writeable = False
        return array

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Let pydantic call `check` wherever this annotation stands."""
        return core_schema.no_info_plain_validator_function(self.check)


def _all_finite(array: npt.NDArray[Any]) -> bool:
    """Whether an array of floats holds neither NaN nor infinity."""
    return not array.size or bool(np.logical_and.reduce(np.isfinite(array), axis=None))


Ranges = Annotated[npt.NDArray[np.float32], ArrayField("float32", (None,), 4096)]
Bytes = Annotated[npt.NDArray[np.uint8], ArrayField("uint8", (None,), 8_000_000)]
Track = Annotated[npt.NDArray[np.float64], ArrayField("float64", (None, 4), 4 * 4096)]
Covariance = Annotated[npt.NDArray[np.float64], ArrayField("float64", (3, 3), 9)]
Points = Annotated[npt.NDArray[np.float32], ArrayField("float32", (None, 2), 2 * 4096)]
Detections = Annotated[
    npt.NDArray[np.float32], ArrayField("float32", (None, 2), 2 * 256, omit_empty=True)
]
Numbers = Annotated[npt.NDArray[np.float32], ArrayField("float32", (None,), 4096)]
NO_NUMBERS: npt.NDArray[np.float32] = np.zeros(0, dtype=np.float32)
NO_POINTS: npt.NDArray[np.float32] = np.zeros((0, 2), dtype=np.float32)
Rectangles = Annotated[npt.NDArray[np.float32], ArrayField("float32", (None, 4), 4 * 4096)]


def _pose(value: object) -> Pose2:
    """Read a pose from the wire's [x, y, theta] or take one as it is."""
    if isinstance(value, Pose2):
        x, y, theta = value.x, value.y, value.theta
    elif isinstance(value, list | tuple) and len(value) == 3:
        if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in value):
            raise ValueError("a pose is three numbers: x, y, theta")
        x, y, theta = (float(v) for v in value)
    else:
        raise ValueError("a pose is three numbers: x, y, theta")
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(theta)):
        raise ValueError("a pose must be finite")
    if max(abs(x), abs(y)) > LARGEST_COORDINATE or abs(theta) > 1.0e3:
        raise ValueError("a pose beyond all reach")
    return value if isinstance(value, Pose2) else Pose2(x, y, wrap_angle(theta))


PoseField = Annotated[
    Pose2,
    BeforeValidator(_pose),
    PlainSerializer(lambda pose: [pose.x, pose.y, pose.theta], return_type=list[float]),
]


_NAME = re.compile(r"[A-Za-z0-9_.-]{1,32}")


@lru_cache(maxsize=1024)
def is_name(text: str) -> bool:
    """Whether a text can be the name of a process, and is safe to print."""
    return _NAME.fullmatch(text) is not None


def _name(value: str) -> str:
    """Check a process's name."""
    if not is_name(value):
        raise ValueError("a name is 1 to 32 letters, digits, '-', '_' or '.'")
    return value


Name = Annotated[str, AfterValidator(_name)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Coordinate = Annotated[
    float, Field(ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE, allow_inf_nan=False)
]
StartSigma = Annotated[float, Field(ge=0.0, le=1.0e3, allow_inf_nan=False)]
RangeMax = Annotated[float, Field(gt=0.0, le=1.0e3, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, le=2**53)]
Text = Annotated[str, Field(max_length=2000)]
