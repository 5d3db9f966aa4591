"""What a robot may learn at a frontier: the unknown cells it could come to see from there.

A flood runs from the frontier cell over unknown cells that hang together across edges, and ends
at clear and obstacle cells and at the sensor's range. It counts the cells and records their
extent, whose rectangle tells how much two such regions overlap.

Floods at full resolution are dear: `mapping.coarse_gain` runs them over blocks of cells.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.grid import CLEAR, UNKNOWN, Cells

Gains = tuple[Floats, Cells]

NO_WEIGHT = np.empty((0, 0), dtype=np.float32)  # every unknown cell counts 1
CLOSED = np.iinfo(np.int32).max  # in the array of visits: not an unknown cell


def entropy_weight(log_odds: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return how unknown each cell is: the entropy of its occupancy [bit], any shape, float32.

    1 for a cell never seen, towards 0 the surer the map is of it.

    Source: Simmons et al. 2000, section "Constructing Bids", where it is named as an improvement
    "to bias the count by the occupancy probability of the cells"; entropy is Shannon's (1948).
    """
    return _entropy(np.ascontiguousarray(log_odds).reshape(-1)).reshape(log_odds.shape)


@compiled
def _entropy(log_odds: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Compiled body of `entropy_weight`; (N,)."""
    bits = np.ones(len(log_odds), dtype=np.float32)
    for k in range(len(log_odds)):
        if log_odds[k] != 0.0:
            surety = abs(float(log_odds[k]))
            doubt = math.exp(-surety)
            bits[k] = (math.log1p(doubt) + surety * doubt / (1.0 + doubt)) / math.log(2.0)
    return bits


def information_gains(
    classes: npt.NDArray[np.uint8],
    weight: npt.NDArray[np.float32] | None,
    frontier_cells: npt.ArrayLike,
    range_cells: float,
) -> Gains:
    """Return the expected information gain of visiting each frontier cell, and its extent.

    Args:
        classes: (rows, cols) uint8 of `mapping.grid` classes.
        weight: (rows, cols) float32, what each unknown cell counts; None counts cells.
        frontier_cells: (N, 2), inside the grid.
        range_cells: nominal range of the sensor [cells].

    Returns:
        gains (N,) in cells, or the sums of their weights; and boxes (N, 4) int64 as half open
        (iy0, ix0, iy1, ix1) around the unknown cells counted; an empty box at the frontier cell
        where there are none.

    Source: Simmons et al. 2000, section "Constructing Bids" and Figure 4.
    """
    cells = np.asarray(frontier_cells, dtype=np.int64).reshape(-1, 2)
    weights = NO_WEIGHT if weight is None else np.ascontiguousarray(weight)
    return _gains(unvisited(np.ascontiguousarray(classes)), weights, cells, range_cells)


def gain_region(
    classes: npt.NDArray[np.uint8], cell: tuple[int, int], range_cells: float
) -> npt.NDArray[np.int64]:
    """Return the flat indices, ascending, of the unknown cells one frontier cell would gain.

    What two regions truly share is the size of `np.intersect1d` of them, to be held against the
    overlap of their boxes. See `information_gains` for the arguments.
    """
    visits = unvisited(np.ascontiguousarray(classes))
    _gains(visits, NO_WEIGHT, np.asarray(cell, dtype=np.int64).reshape(1, 2), range_cells)
    return np.flatnonzero(visits[1:-1, 1:-1] == 1)


@compiled
def roomy_classes(
    classes: npt.NDArray[np.uint8], clearance: npt.NDArray[np.float32], body_radius: float
) -> npt.NDArray[np.uint8]:
    """Return the classes with unknown cells too near to obstacles for a body as clear ones.

    Floods then end at gaps that the body cannot pass: a hole in a wall not fully seen, or a slot
    between two cupboards, opens on all the unknown behind, but nobody can go there to see it.

    Args:
        classes: (rows, cols) uint8 of `mapping.grid` classes.
        clearance: (rows, cols) float32 [m], distance to the nearest obstacle.
        body_radius: [m].
    """
    roomy = classes.copy()
    for iy in range(classes.shape[0]):
        for ix in range(classes.shape[1]):
            if classes[iy, ix] == UNKNOWN and clearance[iy, ix] < body_radius:
                roomy[iy, ix] = CLEAR
    return roomy


@compiled
def unvisited(classes: npt.NDArray[np.uint8]) -> npt.NDArray[np.int32]:
    """Return the array floods mark: 0 where unknown, `CLOSED` elsewhere and on a border around."""
    rows, cols = classes.shape
    visits = np.full((rows + 2, cols + 2), CLOSED, dtype=np.int32)
    for iy in range(rows):
        line, marks = classes[iy], visits[iy + 1, 1:]
        for ix in range(cols):
            marks[ix] = 0 if line[ix] == UNKNOWN else CLOSED
    return visits


@compiled
def _gains(
    visits: npt.NDArray[np.int32],
    weight: npt.NDArray[np.float32],
    cells: Cells,
    range_cells: float,
) -> Gains:
    """Flood from each of `cells`; the k-th flood leaves k + 1 in `visits` where it has been."""
    gains = np.zeros(len(cells))
    boxes = np.empty((len(cells), 4), dtype=np.int64)
    stack, circle = flood_space(range_cells)
    for k in range(len(cells)):
        iy, ix = cells[k, 0], cells[k, 1]
        gains[k] = flood_from(visits, weight, stack, circle, iy, ix, range_cells, k + 1, boxes[k])
        if boxes[k, 2] == 0:
            boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3] = iy, ix, iy, ix
    return gains, boxes


@compiled
def flood_from(
    visits: npt.NDArray[np.int32],
    weight: npt.NDArray[np.float32],
    stack: Cells,
    circle: Cells,
    iy: int,
    ix: int,
    reach: float,
    epoch: int,
    box: npt.NDArray[np.int64],
) -> float:
    """Flood from the unknown neighbours of one cell, given in the indices of `weight`."""
    top = circle_rows(circle, iy + 1.0, ix + 1.0, reach)
    seeds = 0
    for dy, dx in ((-1, 0), (0, -1), (0, 1), (1, 0)):
        stack[0, seeds], stack[1, seeds] = iy + 1 + dy, ix + 1 + dx
        seeds += 1
    return flood(visits, weight, stack, seeds, circle, top, epoch, box)


@compiled
def flood_space(reach: float) -> tuple[Cells, Cells]:
    """Return the arrays a flood needs for its stack and its circle, for a range of `reach`.

    A cell is put on the stack at most twice, from above and from below.
    """
    side = 2 * math.ceil(reach) + 7
    return np.empty((2, 2 * side * side), dtype=np.int64), np.empty((2, side), dtype=np.int64)


@compiled
def circle_rows(circle: Cells, centre_y: float, centre_x: float, reach: float) -> int:
    """Write the first and last column in reach of a centre, for each row; return the first row.

    All in the indices of `visits`; rows out of reach get a last column before the first.
    """
    top = math.ceil(centre_y - reach) - 2  # a flood looks beyond its start, too
    for k in range(circle.shape[1]):
        away = top + k - centre_y
        wide = math.sqrt(reach * reach - away * away) if abs(away) <= reach else -1.0
        circle[0, k] = math.ceil(centre_x - wide)
        circle[1, k] = math.floor(centre_x + wide)
    return top


@compiled
def flood(
    visits: npt.NDArray[np.int32],
    weight: npt.NDArray[np.float32],
    stack: Cells,
    seeds: int,
    circle: Cells,
    top: int,
    epoch: int,
    box: npt.NDArray[np.int64],
) -> float:
    """Return the gain of the region around the seeds, and write its box (4,), 0s if empty.

    Fills whole runs of a row at a time; a cell is open while its mark is older than `epoch`. The
    box has the indices of `weight`, the stack and the circle those of `visits`.
    """
    gain, y0, x0, y1, x1 = 0.0, visits.shape[0], visits.shape[1], 0, 0
    stride = visits.shape[1]
    marks, values = visits.reshape(-1), weight.reshape(-1)
    count = seeds
    while count > 0:
        count -= 1
        y, x = stack[0, count], stack[1, count]
        base = y * stride
        low, high = base + circle[0, y - top], base + circle[1, y - top]
        first = last = base + x
        if first < low or first > high or marks[np.uint64(first)] >= epoch:
            continue
        while first > low and marks[np.uint64(first - 1)] < epoch:
            first -= 1
        while last < high and marks[np.uint64(last + 1)] < epoch:
            last += 1
        for at in range(first, last + 1):
            marks[np.uint64(at)] = epoch
        if len(values) > 0:
            shift = base + 1 - (y - 1) * (stride - 2)  # from padded to unpadded indices
            for at in range(first - shift, last - shift + 1):
                gain += values[np.uint64(at)]
        else:
            gain += last + 1 - first
        y0, x0 = min(y0, y), min(x0, first - base)
        y1, x1 = max(y1, y + 1), max(x1, last - base + 1)
        for next_y in (y - 1, y + 1):
            beyond, row = next_y * stride, next_y - top
            from_x, to_x = max(first - base, circle[0, row]), min(last - base, circle[1, row])
            shut = True
            for at in range(beyond + from_x, beyond + to_x + 1):
                is_open = marks[np.uint64(at)] < epoch
                if is_open and shut:
                    stack[0, count], stack[1, count] = next_y, at - beyond
                    count += 1
                shut = not is_open
    if y1 > 0:
        box[0], box[1], box[2], box[3] = y0 - 1, x0 - 1, y1 - 1, x1 - 1
    else:
        box[:] = 0
    return gain
