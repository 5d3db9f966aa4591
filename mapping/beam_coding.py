"""The beams of a scan as bytes: what is expected of each, and the range coder, come together here.

Writer and reader do the same sums in the same order for every beam; only then does the reader find
the share that the writer gave it. See `normal_table` for why they can.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.entropy_coding import (
    AT,
    TOTAL,
    Bytes,
    finish,
    new_reader,
    new_writer,
    place_of_next,
    room_for,
    take_share,
    write_share,
)
from mapping.geometry import Floats
from mapping.outlook_learning import learn_ignored, learn_reading, learn_void
from mapping.range_cells import NO_RETURN, TO_IGNORE, Cells
from mapping.reading_outlook import (
    Outlook,
    Ranging,
    ignored_chance,
    look_ahead,
    new_outlook,
    void_chance,
    weight_below,
)

Ints = npt.NDArray[np.int64]

NOISES = 16
"""The noise of a scan is one of so many."""

_FIRST_NOISE, _NOISE_STEP = 0.2, 1.25  # in cells; each next one is larger by a quarter
_LIKELIEST = 0.995  # no special reading is surer than this
# Of a normal distribution this share lies within 0.524 of its spread, and the second difference of
# three readings with noise sigma scatters by sqrt(6) sigma; a tenth less, as corners bend, too.
_STRAIGHTEST = 0.4
_NOISE_OF_BENDS = 0.9 / (0.524 * 6.0**0.5)


def ranging(width: float, count: int, noise: int) -> Ranging:
    """Return what is known of a sensor: width [m] and number of cells, number of the noise."""
    sigma = _FIRST_NOISE * width
    for _ in range(noise):
        sigma = sigma * _NOISE_STEP
    return Ranging(width, count, sigma * sigma, sigma * sigma + width * width / 12.0)


def nearest_noise(sigma: float, width: float) -> int:
    """Return the number of the noise next to `sigma` [m], for cells of a width [m]."""
    number, rung = 0, _FIRST_NOISE * width
    while number < NOISES - 1 and rung * _NOISE_STEP**0.5 < sigma:
        number, rung = number + 1, rung * _NOISE_STEP
    return number


def shown_noise(cells: Cells) -> int:
    """Return the number of the noise that the readings of a scan show, 0 .. NOISES - 1."""
    values = cells.astype(np.float64)
    bends = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    bends = bends[(cells[2:] >= 0) & (cells[1:-1] >= 0) & (cells[:-2] >= 0)]
    if not len(bends):
        return NOISES // 2
    # Bends are whole numbers of cells: those in a cell are taken to be spread evenly in it.
    at = float(np.quantile(bends, _STRAIGHTEST, method="inverted_cdf"))
    below, within = float((bends < at).mean()), float((bends == at).mean())
    near, width = (at - 0.5, 1.0) if at > 0.0 else (0.0, 0.5)
    quantile = near + width * (_STRAIGHTEST - below) / within
    return nearest_noise(quantile * _NOISE_OF_BENDS, 1.0)


@lru_cache(maxsize=64)
def rays_of(beams: int, step: float) -> Floats:
    """Return cosine and sine of 0, 1, 2 ... times a step [rad], (beams, 2), read-only.

    By series and by turning: `math.cos` differs in its last bits between machines.
    """
    cosine, sine, term = 1.0, 0.0, 1.0
    for n in range(1, 60):
        term = term * step / n
        if n % 2:
            sine = sine + (term if n % 4 == 1 else -term)
        else:
            cosine = cosine + (term if n % 4 == 0 else -term)
    rays = np.empty((beams, 2))
    c, s = 1.0, 0.0
    for i in range(beams):
        rays[i] = c, s
        c, s = c * cosine - s * sine, s * cosine + c * sine
    rays.flags.writeable = False
    return rays


def encode_beams(cells: Cells, sensor: Ranging, rays: Floats) -> bytes:
    """Return the cells (beams,) of a scan as bytes that `decode_beams` reads."""
    out = np.zeros(room_for(len(cells)), dtype=np.uint8)
    length = _encode(cells, sensor, rays, new_outlook(), new_writer(), out)
    return out[:length].tobytes()


@compiled
def _encode(
    cells: Cells, sensor: Ranging, rays: Floats, outlook: Outlook, state: Ints, out: Bytes
) -> int:
    reach = sensor.cell * sensor.cells
    for beam in range(len(cells)):
        look_ahead(outlook, sensor, rays, beam)
        lowest = weight_below(outlook, 0.0, reach)
        whole = weight_below(outlook, reach, reach) - lowest
        ignored, void = _special_shares(outlook, sensor, whole)
        cell = cells[beam]
        if cell == TO_IGNORE:
            write_share(state, out, 0, ignored)
        elif cell == NO_RETURN:
            write_share(state, out, ignored, void)
        else:
            first = _share_before(outlook, sensor, cell, ignored + void, lowest, whole)
            end = _share_before(outlook, sensor, cell + 1, ignored + void, lowest, whole)
            write_share(state, out, first, end - first)
        _learn(outlook, sensor, rays, beam, cell)
    return finish(state, out)


def decode_beams(data: bytes, sensor: Ranging, rays: Floats) -> tuple[Cells, int]:
    """Return the cells (beams,) of a scan, and how many of the bytes were asked for.

    Damaged bytes give cells, too; fewer bytes asked for than there are is a sign of it.

    Args:
        data: from `encode_beams`.
        sensor: as then.
        rays: as then; one for each beam.
    """
    cells = np.empty(len(rays), dtype=np.int32)
    asked = _decode(np.frombuffer(data, dtype=np.uint8), sensor, rays, new_outlook(), cells)
    return cells, asked


@compiled
def _decode(data: Bytes, sensor: Ranging, rays: Floats, outlook: Outlook, cells: Cells) -> int:
    state = new_reader(data)
    reach = sensor.cell * sensor.cells
    for beam in range(len(cells)):
        look_ahead(outlook, sensor, rays, beam)
        lowest = weight_below(outlook, 0.0, reach)
        whole = weight_below(outlook, reach, reach) - lowest
        ignored, void = _special_shares(outlook, sensor, whole)
        place = place_of_next(state)
        if place < ignored:
            cell = TO_IGNORE
            take_share(state, data, 0, ignored)
        elif place < ignored + void:
            cell = NO_RETURN
            take_share(state, data, ignored, void)
        else:
            cell, first, end = _find(outlook, sensor, place, ignored + void, lowest, whole)
            take_share(state, data, first, end - first)
        cells[beam] = cell
        _learn(outlook, sensor, rays, beam, cell)
    return int(state[AT])


@compiled
def _special_shares(outlook: Outlook, sensor: Ranging, whole: float) -> tuple[int, int]:
    """Return the widths of the shares of a beam to ignore, and of one without a return."""
    ignored = 1 + int(min(ignored_chance(outlook), _LIKELIEST) * (TOTAL - sensor.cells - 4))
    chance = min(void_chance(outlook, whole), _LIKELIEST)
    void = 1 + int(max(chance, 0.0) * (TOTAL - sensor.cells - 4 - ignored))
    return ignored, void


@compiled
def _share_before(
    outlook: Outlook, sensor: Ranging, cell: int, special: int, lowest: float, whole: float
) -> int:
    """Return where the share of a cell begins; each cell has one of at least 1."""
    if cell <= 0:
        return special
    if cell >= sensor.cells:
        return TOTAL
    edge = sensor.cell * cell
    below = weight_below(outlook, edge, sensor.cell * sensor.cells) - lowest
    part = min(max(below / whole, 0.0), 1.0)
    return special + cell + int(part * (TOTAL - special - sensor.cells))


@compiled
def _find(
    outlook: Outlook, sensor: Ranging, place: int, special: int, lowest: float, whole: float
) -> tuple[int, int, int]:
    """Return the cell whose share holds a place, where that begins, and where it ends."""
    near, far = 0, sensor.cells
    first, end = special, TOTAL
    while far - near > 1:
        middle = (near + far) >> 1
        before = _share_before(outlook, sensor, middle, special, lowest, whole)
        if before <= place:
            near, first = middle, before
        else:
            far, end = middle, before
    return near, first, end


@compiled
def _learn(outlook: Outlook, sensor: Ranging, rays: Floats, beam: int, cell: int) -> None:
    if cell == TO_IGNORE:
        learn_ignored(outlook)
    elif cell == NO_RETURN:
        learn_void(outlook, sensor.cell * sensor.cells)
    else:
        learn_reading(outlook, sensor, rays, beam, cell)
