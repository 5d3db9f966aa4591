"""A laser scan in few bytes: rounded below its noise, foretold beam by beam, entropy-coded.

Ranges are rounded to cells of almost twice the error bound, so every range comes back within the
bound. What a beam may read is foretold from the beams before it (`reading_outlook`), and a range
coder spends on each cell what its probability asks for (`entropy_coding`). Every scan is coded
alone: frames get lost, and come in any order.

The bytes are: numbers of layout and noise (4 bits each); one byte with the number of a usual bound
and reach (4 bits), whether the beams come last to first (whichever is shorter), and whether the
stamp is negative; bound in 0.1 mm and reach in mm if they are not usual, and the stamp in ms, each
7 bits a byte, lowest first; a layout that is not in the table, in full; then the beams.

Source: Pfingsthorn et al. 2007, section 5, name compressed scans as their next step.
"""

from __future__ import annotations

from dataclasses import dataclass

from mapping.beam_coding import (
    decode_beams,
    encode_beams,
    nearest_noise,
    ranging,
    rays_of,
    shown_noise,
)
from mapping.range_cells import RangeCells, cells_for
from mapping.scan import LaserScan
from mapping.scan_layout import (
    IN_FULL,
    KNOWN_LAYOUTS,
    SensorLayout,
    layout_of,
    number_of,
    pack_layout,
    unpack_layout,
)

_STAMP_MOST = 1 << 45  # ms: a thousand years
# Error bounds [0.1 mm] and reaches [mm] that have a number, up to 15 of them.
_USUAL = ((100, 20_000), (100, 8_000), (100, 10_000), (100, 12_000), (100, 30_000), (100, 5_600))
_UNUSUAL = 15
_TURNED, _NEGATIVE = 1, 2  # flags in the second byte, whose high half is a number of these
_LONGEST = 7  # bytes of a number


class DamagedScanError(ValueError):
    """The bytes are no scan."""


@dataclass(frozen=True, slots=True)
class ScanCodingSettings:
    """How scans become bytes.

    Attributes:
        error_bound_m: no range comes back farther off than this; counts in whole 0.1 mm.
        noise_m: standard deviation of the range noise; 0 if not known: then as each scan shows it.
        layouts: lasers that bytes name by their number here, at most 15; the reader needs the same.

    Raises:
        ValueError: more layouts than numbers.
    """

    error_bound_m: float = 0.01
    noise_m: float = 0.0
    layouts: tuple[SensorLayout, ...] = KNOWN_LAYOUTS

    def __post_init__(self) -> None:
        if len(self.layouts) > IN_FULL:
            raise ValueError(f"{len(self.layouts)} layouts; at most {IN_FULL} have a number")


_DEFAULTS = ScanCodingSettings()


def encode_scan(scan: LaserScan, settings: ScanCodingSettings = _DEFAULTS) -> bytes:
    """Return a scan as bytes that `decode_scan` reads.

    A range comes back within the error bound; one of `range_max` or more as no return, one of 0 or
    less, or none, as one to ignore. The stamp is rounded to milliseconds, `range_max` up to whole
    millimetres.

    Raises:
        ValueError: no laser makes such a scan, or the error bound is too fine for its reach.
    """
    layout = layout_of(scan)
    number = number_of(layout, settings.layouts)
    if number != IN_FULL:
        layout = settings.layouts[number]
    grid = cells_for(scan, settings.error_bound_m)
    cells = grid.cells_of(scan)
    known = settings.noise_m > 0.0
    noise = nearest_noise(settings.noise_m, grid.width) if known else shown_noise(cells)
    sensor = ranging(grid.width, grid.count, noise)
    rays = rays_of(layout.beams, layout.bearing_step)
    forwards = encode_beams(cells, sensor, rays)
    backwards = encode_beams(cells[::-1].copy(), sensor, rays)
    turned = len(backwards) < len(forwards)
    milliseconds = _milliseconds(scan.stamp)
    limits = (grid.bound, grid.reach)
    usual = _USUAL.index(limits) if limits in _USUAL else _UNUSUAL
    flags = _TURNED * turned | _NEGATIVE * (milliseconds < 0)
    head = bytes([number << 4 | noise, usual << 4 | flags])
    if usual == _UNUSUAL:
        head += _number(grid.bound) + _number(grid.reach)
    head += _number(abs(milliseconds))
    if number == IN_FULL:
        head += pack_layout(layout)
    return head + (backwards if turned else forwards)


def decode_scan(data: bytes, layouts: tuple[SensorLayout, ...] = KNOWN_LAYOUTS) -> LaserScan:
    """Return the scan in bytes from `encode_scan`.

    Args:
        data: may be anything; some damaged bytes are some other scan.
        layouts: as when it was encoded.

    Raises:
        DamagedScanError: the bytes are no scan.
    """
    if len(data) < 2:
        raise DamagedScanError("no head")
    number, noise = data[0] >> 4, data[0] & 15
    usual, flags = data[1] >> 4, data[1] & 15
    (bound, reach), at = _read_limits(data, usual)
    stamp, at = _read_number(data, at)
    try:
        grid = RangeCells(bound, reach)
        if number == IN_FULL:
            layout, at = unpack_layout(data, at)
        elif number < len(layouts):
            layout = layouts[number]
        else:
            raise ValueError(f"no laser has the number {number}")
    except ValueError as error:
        raise DamagedScanError(str(error)) from None
    sensor = ranging(grid.width, grid.count, noise)
    cells, asked = decode_beams(data[at:], sensor, rays_of(layout.beams, layout.bearing_step))
    if asked < len(data) - at:
        raise DamagedScanError(f"{len(data) - at - asked} bytes are left after the last beam")
    return LaserScan(
        grid.ranges_of(cells[::-1] if flags & _TURNED else cells),
        layout.bearing_start,
        layout.bearing_step,
        grid.range_max,
        (-stamp if flags & _NEGATIVE else stamp) / 1000.0,
        layout.T_base_laser,
    )


def _milliseconds(stamp: float) -> int:
    """Return a stamp [s] in ms.

    Raises:
        ValueError: it is no time.
    """
    if not abs(stamp) * 1000.0 < _STAMP_MOST:
        raise ValueError(f"{stamp} s is no time of a scan")
    return round(stamp * 1000.0)


def _read_limits(data: bytes, usual: int) -> tuple[tuple[int, int], int]:
    """Return error bound [0.1 mm] and reach [mm], and where what follows begins.

    Raises:
        DamagedScanError: nothing has this number, or the bytes end.
    """
    if usual == _UNUSUAL:
        bound, at = _read_number(data, 2)
        reach, at = _read_number(data, at)
        return (bound, reach), at
    if usual >= len(_USUAL):
        raise DamagedScanError(f"no error bound and reach have the number {usual}")
    return _USUAL[usual], 2


def _number(value: int) -> bytes:
    """Return a number >= 0, 7 bits a byte, lowest first; only the last byte is below 128."""
    parts = bytearray()
    while value > 0x7F:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    parts.append(value)
    return bytes(parts)


def _read_number(data: bytes, at: int) -> tuple[int, int]:
    """Return the number that begins at a place, and where it ends.

    Raises:
        DamagedScanError: it does not end.
    """
    value = 0
    for place, byte in enumerate(data[at : at + _LONGEST]):
        value |= (byte & 0x7F) << (7 * place)
        if byte < 0x80:
            return value, at + place + 1
    raise DamagedScanError("the bytes end within a number, or it is too long")
