"""What benchmarks work on: floors, generated and real, and the row of a table."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mapping.bucket_wave import UNREACHED
from mapping.distance_field import truncated_distance
from mapping.grid import CLEAR, OBSTACLE, UNKNOWN
from mapping.path_planning import cost_field, traversal_weights

ROOT = Path(__file__).resolve().parent.parent

Classes = npt.NDArray[np.uint8]

RESOLUTION = 0.05
SENSOR_RANGE = 8.0


@dataclass(frozen=True)
class Case:
    """One row: `run` does `amount` units of work each time it is called."""

    kernel: str
    work: str
    amount: float
    unit: str
    run: Callable[[], object]


@cache
def office(rows: int = 1000, cols: int = 1000) -> Classes:
    """Return a floor of rooms of 5 x 4 m on both sides of corridors 2 m wide, with furniture."""
    classes = np.full((rows, cols), CLEAR, dtype=np.uint8)
    rng = np.random.default_rng(7)
    room, door, corridor = 100, 18, 40
    for iy in range(0, rows, 2 * room + corridor):
        for wall in (iy, iy + room, iy + room + corridor):
            classes[wall : wall + 2, :] = OBSTACLE
        for ix in range(0, cols, 80):
            classes[iy : iy + room, ix : ix + 2] = OBSTACLE
            classes[iy + room + corridor : iy + 2 * room + corridor, ix : ix + 2] = OBSTACLE
            at = ix + int(rng.integers(10, 50))
            for wall in (iy + room, iy + room + corridor):
                classes[wall : wall + 2, at : at + door] = CLEAR
    classes[:, 460:500] = CLEAR  # one way across all corridors
    for _ in range(400):
        fy, fx = int(rng.integers(0, rows - 12)), int(rng.integers(0, cols - 12))
        classes[fy : fy + 8, fx : fx + 12] = OBSTACLE
    classes[[0, -1], :] = classes[:, [0, -1]] = OBSTACLE
    return classes


def data_folder() -> Path | None:
    """Return where real maps are, if anywhere."""
    named = os.environ.get("EXPEDITION_DATA")
    for folder in (Path(named) if named else None, ROOT.parent / "shared" / "data"):
        if folder is not None and (folder / "maps").is_dir():
            return folder
    return None


@cache
def floor(name: str) -> tuple[Classes, float]:
    """Return a real map's classes and resolution [m]; the generated office without the data."""
    folder = data_folder()
    if folder is None:
        return office(), RESOLUTION
    import yaml
    from PIL import Image

    meta = yaml.safe_load((folder / "maps" / f"{name}.yaml").read_text())
    grey = np.asarray(Image.open(folder / "maps" / meta["image"]).convert("L"))[::-1]
    occupied = 1.0 - grey / 255.0
    classes = np.full(grey.shape, UNKNOWN, dtype=np.uint8)
    classes[occupied > meta["occupied_thresh"]] = OBSTACLE
    classes[occupied < meta["free_thresh"]] = CLEAR
    return classes, float(meta["resolution"])


def weights_of(classes: Classes, resolution: float) -> npt.NDArray[np.uint8]:
    """Return traversal weights for a robot of 0.25 m radius."""
    clearance = truncated_distance(classes == OBSTACLE, resolution, 0.6)
    return traversal_weights(classes == CLEAR, clearance, 0.25, 0.6)


def farthest(weights: npt.NDArray[np.uint8], resolution: float) -> tuple[int, int]:
    """Return a cell of the largest free region, at its end: the dearest from the cell tried."""
    free = np.argwhere(weights == 1)
    best, most = (0, 0), 0
    for start in free[:: max(len(free) // 8, 1)]:
        field = cost_field(weights, start, resolution)
        reached = field.units != UNREACHED
        if int(reached.sum()) > most:
            most = int(reached.sum())
            at = int(np.where(reached, field.units, -1).argmax())
            best = (at // weights.shape[1], at % weights.shape[1])
    return best


@cache
def half_known(name: str) -> tuple[Classes, float]:
    """Return a floor of which discs of 6 m around some places are known, and its resolution."""
    truth, resolution = floor(name)
    rng = np.random.default_rng(3)
    free = np.argwhere(weights_of(truth, resolution) == 1)
    iy, ix = np.ogrid[: truth.shape[0], : truth.shape[1]]
    known = np.zeros(truth.shape, dtype=bool)
    for cy, cx in free[rng.integers(0, len(free), 14)]:
        known |= (iy - cy) ** 2 + (ix - cx) ** 2 <= (6.0 / resolution) ** 2
    return np.where(known, truth, UNKNOWN).astype(np.uint8), resolution
