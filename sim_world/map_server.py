"""Reading maps in the ROS map_server format: a YAML file beside an image."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import numpy as np
import yaml
from PIL import Image, UnidentifiedImageError
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mapping.grid import GridGeometry
from sim_world.errors import WorldError
from sim_world.floor_plan import Length, Number
from sim_world.scene import Solid
from sim_world.schema import one_line

_Pixels = np.ndarray[tuple[int, int], np.dtype[np.float64]]

# Larger images are more likely a mistake than a building: 400 million cells.
_CELLS_MAX = 20_000 * 20_000


class MapYaml(BaseModel):
    """The keys of a map_server YAML file; further ones that some tools write are ignored."""

    model_config = ConfigDict(frozen=True)

    image: str
    resolution: Length
    origin: tuple[Number, Number, Number]
    negate: Literal[0, 1] = 0
    occupied_thresh: float = Field(0.65, ge=0.0, le=1.0)
    free_thresh: float = Field(0.196, ge=0.0, le=1.0)
    mode: Literal["trinary"] = "trinary"


def read_map(path: Path) -> tuple[Solid, GridGeometry]:
    """Return the solid cells of a map: everything that is not free, unknown included.

    A pixel is free when its occupancy, black 1 and white 0 (or the other way round with `negate`),
    is below `free_thresh`.

    Raises:
        WorldError: the file or its image cannot be used.
    """
    meta = _read_yaml(path)
    if abs(math.remainder(meta.origin[2], 2.0 * math.pi)) > 1e-9:
        raise WorldError(
            f"{path.name}: origin has a yaw of {meta.origin[2]:g} rad, which is not supported; "
            "turn the image instead and set the third number to 0"
        )
    values = _read_image(path, path.parent / meta.image)
    occupancy = values if meta.negate else 255.0 - values
    # Rows of an image run downwards, rows of a grid upwards.
    free = np.flipud(occupancy / 255.0 < meta.free_thresh)
    geometry = GridGeometry(meta.resolution, meta.origin[0], meta.origin[1], *free.shape)
    return np.ascontiguousarray(~free), geometry


def _read_yaml(path: Path) -> MapYaml:
    """Return the checked content of the YAML file."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise WorldError(f"{path.name}: cannot be read as YAML: {reason}") from error
    if not isinstance(content, dict):
        raise WorldError(f"{path.name}: holds no map; it needs image, resolution and origin")
    try:
        return MapYaml.model_validate(content)
    except ValidationError as error:
        raise WorldError(one_line(path.name, error)) from error


def _read_image(path: Path, image_path: Path) -> _Pixels:
    """Return the grey values (rows, cols), 0 black to 255 white, first row on top."""
    if not image_path.is_file():
        raise WorldError(f"{path.name}: image {image_path} does not exist; correct the key 'image'")
    try:
        with Image.open(image_path) as image:
            if image.width * image.height > _CELLS_MAX:
                raise WorldError(f"{path.name}: image {image_path.name} is too large")
            values = _grey(image)
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError) as error:
        raise WorldError(
            f"{path.name}: image {image_path.name} cannot be read; save it as PNG or PGM"
        ) from error
    return values


def _grey(image: Image.Image) -> _Pixels:
    """Return the grey values (rows, cols) from 0 to 255; transparency is left out."""
    if image.mode.startswith("I"):
        # Sixteen bits a pixel.
        return np.asarray(image, dtype=np.float64) / 257.0
    grey = image if image.mode in ("L", "1") else image.convert("RGB")
    return np.asarray(grey.convert("L"), dtype=np.float64)
