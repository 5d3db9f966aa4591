"""Map cells as they travel: log-odds in steps of 1/20, one byte a cell, compressed.

A snapshot and a delta of the team's map carry the same kind of bytes; the server packs them, robots
and observers unpack them.
"""

from __future__ import annotations

import hashlib
import struct

import numpy as np
import numpy.typing as npt
import zstandard

from mapping.cell_box import box_of
from mapping.grid import GridGeometry

# One step of the wire is 0.05 in log-odds: +-6.35 is p = 0.998, beyond which nobody decides anew.
STEPS_PER_LOG_ODD = 20.0
LARGEST_STEP = 127
# A floor of 350 m x 350 m at 5 cm; a peer that claims more is not believed.
LARGEST_CELLS = 50_000_000
# Level 1 is within a few percent of the higher ones on maps, and several times faster.
COMPRESSION_LEVEL = 1


def quantise(log_odds: npt.NDArray[np.float32]) -> npt.NDArray[np.int8]:
    """Return log-odds as steps of 1/20, clipped to +-127, int8 of the same shape."""
    steps = log_odds * np.float32(STEPS_PER_LOG_ODD)
    np.rint(steps, out=steps)
    np.clip(steps, -LARGEST_STEP, LARGEST_STEP, out=steps)
    cells: npt.NDArray[np.int8] = steps.astype(np.int8)
    return cells


def dequantise(cells: npt.NDArray[np.int8]) -> npt.NDArray[np.float32]:
    """Return the log-odds float32 that `cells` stand for, of the same shape."""
    log_odds: npt.NDArray[np.float32] = cells.astype(np.float32) / np.float32(STEPS_PER_LOG_ODD)
    return log_odds


def map_digest(cells: npt.NDArray[np.int8], geometry: GridGeometry) -> str:
    """Return the fingerprint of a map, SHA-256 in hexadecimal; empty where nothing is known.

    Two members that know the same cells have the same one, however much room for more each keeps:
    hashed are the resolution (float64), the smallest box of the lattice through (0, 0) that holds
    all known cells (row, column, rows, columns; int64), and its cells; all little-endian.

    Args:
        cells: (rows, cols) int8, log-odds in steps of 1/20; 0 means unknown.
        geometry: where they lie, map frame.
    """
    box = box_of(cells)
    if box.empty:
        return ""
    known = cells[box.slices]
    row, col = geometry.lattice
    head = struct.pack("<dqqqq", geometry.resolution, row + box.iy0, col + box.ix0, *known.shape)
    return hashlib.sha256(head + np.ascontiguousarray(known).tobytes()).hexdigest()


def pack_cells(log_odds: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Return the wire bytes (n,) uint8 of a map or a part of it.

    Args:
        log_odds: (rows, cols) float32; 0.0 means unknown.
    """
    compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
    return np.frombuffer(compressor.compress(quantise(log_odds).tobytes()), dtype=np.uint8)


def unpack_cells(packed: npt.NDArray[np.uint8], rows: int, cols: int) -> npt.NDArray[np.int8]:
    """Return the cells (rows, cols) int8, read-only, that `packed` holds.

    Args:
        packed: (n,) uint8, from `pack_cells`, possibly damaged or forged on its way.
        rows: number of rows that were announced.
        cols: number of columns that were announced.

    Raises:
        ValueError: the size is beyond all reason, or the bytes do not hold exactly that many cells.
            No more than the announced size is ever allocated.
    """
    expected = rows * cols
    if not 0 < expected <= LARGEST_CELLS or rows < 0:
        raise ValueError(f"a map of {rows} x {cols} cells; at most {LARGEST_CELLS} are accepted")
    data = np.ascontiguousarray(packed).tobytes()
    try:
        size = zstandard.frame_content_size(data)
        if size != expected:
            raise ValueError(f"map bytes announce {size} cells, want {rows} x {cols} = {expected}")
        raw = zstandard.ZstdDecompressor().decompress(
            data, max_output_size=expected, allow_extra_data=False
        )
    except zstandard.ZstdError as error:
        raise ValueError(f"map bytes cannot be decompressed: {error}") from None
    if len(raw) != expected:
        raise ValueError(f"map bytes hold {len(raw)} cells, want {expected}")
    return np.frombuffer(raw, dtype=np.int8).reshape(rows, cols)
