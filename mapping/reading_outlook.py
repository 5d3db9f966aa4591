"""What the next beam of a scan may read, judged by the beams before it.

All beams so far may end on straight walls; the next one may go on along one of them, may pass a
corner, may come back to a wall seen a while ago (behind the leg of a table), or may leap to
somewhere else. Each of these is a hypothesis with a weight and a normal distribution for the
reading. How often walls end, and in which of these ways, is learnt within the scan.

Only + - * / and sqrt in a fixed order: see `normal_table` for why.

Source: Adams & MacKay 2007 (Bayesian online changepoint detection) with the lines of `polar_line`
as its models; only the likeliest run lengths are kept.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.normal_table import share_below
from mapping.polar_line import (
    BEAMS,
    LINE,
    RANGE,
    SPREAD,
    WEIGHT,
    inverse_at,
    predict,
    set_line,
    slope_at,
    turned,
)

Ints = npt.NDArray[np.int64]

RETURNED, VOID, IGNORED = 0, 1, 2
"""What a beam may be: a reading, one without a return, one to ignore."""

KEPT = 16
"""So many walls are kept as hypotheses."""

REMEMBERED = 8
"""So many walls that ended are remembered."""

TILT = 2.0
"""How steep a wall of which nothing is known yet may be: tangent of the angle of incidence."""

DOUBT = 0.01
"""How well walls are parallel or at right angles [rad]."""

CORNER, SQUARE, BACK, ANYWHERE, LEAP = 0, 1, 2, 3, 4
"""How a wall ends: any corner, a right angle, an old wall, a far leap, or a leap by so much."""

LEAPS = (0.07, 0.2, 0.8, 3.0)
"""Spreads of the leaps, around the last reading [m]."""

# The numbers below, and those above, were chosen on the shipped worlds and two real logs; a change
# of any of them by a third changes the bytes by less than 0.5 %.
_WAYS = (0.7, 1.2, 0.8, 0.9, 0.3, 0.5, 0.5, 0.5)  # how often each was seen, to begin with
_RATE = (3.0, 50.0)  # so many walls ended, of so many beams, to begin with
_STEADY, _YOUNG, _YOUTH = 0.4, 4.0, 5.0  # a wall of n beams ends at rate * (0.4 + 4 / (n + 5))
_AFTER_VOID = 0.6  # how likely it is another wall behind beams without a return
_VOIDS_SEEN = (0.2, 12.0, 8.0, 0.6)  # void or not: after a reading, after a void
_IGNORED_SEEN = (0.02, 30.0, 5.0, 1.0)  # ignored or not: after one that is not, after one that is

# Where `book` and `sizes` keep what.
VOIDS, IGNORES, LAST, ENDS, UNIFORM = 0, 4, 8, 9, 11
COUNT, OLD, ROWS, KNOWN, BEFORE, BEST, CLOCK = 0, 1, 2, 3, 4, 5, 6


class Ranging(NamedTuple):
    """What is known of the sensor.

    Attributes:
        cell: width of a cell of ranges [m].
        cells: how many of them fill the reach.
        variance: of the range noise [m2].
        variance_coded: of noise and rounding to cells together [m2].
    """

    cell: float
    cells: int
    variance: float
    variance_coded: float


class Outlook(NamedTuple):
    """Hypotheses about the next beam; all arrays are changed in place.

    Attributes:
        lines: (rows, LINE), walls first, then leaps.
        remembered: (REMEMBERED, LINE), walls; SPREAD holds at which beam they were seen last.
        ways: (8,), how often walls ended in which way.
        book: (12,), counts of beams without a return and of beams to ignore, the last reading [m],
            how many walls ended and of how many beams, and the weight of a leap to anywhere.
        sizes: (7,) int64, numbers of rows; what the beam before was; which row was likeliest.
    """

    lines: Floats
    remembered: Floats
    ways: Floats
    book: Floats
    sizes: Ints


def new_outlook() -> Outlook:
    """Return the hypotheses before the first beam."""
    return Outlook(
        np.zeros((KEPT + REMEMBERED + len(LEAPS) + 5, LINE)),
        np.zeros((REMEMBERED, LINE)),
        np.array(_WAYS),
        np.array([*_VOIDS_SEEN, *_IGNORED_SEEN, 0.0, *_RATE, 1.0]),
        np.zeros(7, dtype=np.int64),
    )


@compiled
def look_ahead(outlook: Outlook, ranging: Ranging, rays: Floats, beam: int) -> None:
    """Add the ways in which walls may end before `beam`, and predict what it reads.

    Args:
        outlook: changed.
        ranging: the sensor.
        rays: (beams, 2), cosine and sine of the bearings from the first beam on.
        beam: the next one.
    """
    lines, book, sizes = outlook.lines, outlook.book, outlook.sizes
    farthest = farthest_of(ranging)
    sizes[OLD] = sizes[COUNT]
    leaping = 0.0
    if sizes[COUNT] > 0:
        leaping = _end_walls(outlook) / _sum(outlook.ways)
        book[UNIFORM] = leaping * outlook.ways[ANYWHERE]
        _add_turns(outlook, rays[beam - 1, 0], rays[beam - 1, 1], leaping, farthest)
    else:
        book[UNIFORM] = 1.0
    for k in range(sizes[COUNT]):
        predict(lines[k], rays[beam, 0], rays[beam, 1], ranging.variance, farthest)
    sizes[ROWS] = sizes[COUNT]
    if leaping > 0.0:
        for a in range(len(LEAPS)):
            row = sizes[COUNT] + a
            lines[row, WEIGHT] = leaping * outlook.ways[LEAP + a]
            lines[row, RANGE], lines[row, SPREAD] = book[LAST], LEAPS[a]
        sizes[ROWS] += len(LEAPS)


@compiled
def farthest_of(ranging: Ranging) -> float:
    """Return beyond which range [m] all walls are the same: nothing comes back."""
    return 4.0 * ranging.cell * ranging.cells


@compiled
def _sum(values: Floats) -> float:
    """Return the sum, from the first to the last: numpy's has an order of its own."""
    total = 0.0
    for value in values:
        total += value
    return total


@compiled
def _end_walls(outlook: Outlook) -> float:
    """Take from each wall the chance that it ends here; return the sum, and find the likeliest."""
    lines, sizes = outlook.lines, outlook.sizes
    rate = outlook.book[ENDS] / outlook.book[ENDS + 1]
    ending = 0.0
    best = 0
    for k in range(sizes[COUNT]):
        if lines[k, WEIGHT] > lines[best, WEIGHT]:
            best = k
        chance = _AFTER_VOID
        if sizes[BEFORE] != VOID:
            chance = min(rate * (_STEADY + _YOUNG / (lines[k, BEAMS] + _YOUTH)), 0.9)
        ending += lines[k, WEIGHT] * chance
        lines[k, WEIGHT] *= 1.0 - chance
    sizes[BEST] = best
    return ending


@compiled
def _add_turns(outlook: Outlook, c: float, s: float, ending: float, farthest: float) -> None:
    """Add what begins where the likeliest wall was last met, and the walls of before."""
    lines, ways, sizes = outlook.lines, outlook.ways, outlook.sizes
    best = lines[sizes[BEST]]
    inverse = inverse_at(best, c, s, farthest)
    row = sizes[COUNT]
    set_line(lines[row], ending * ways[CORNER], c, s, inverse, (0.0, TILT * TILT))
    square = turned(slope_at(guide_of(outlook), c, s), True, DOUBT)
    set_line(lines[row + 1], ending * ways[SQUARE], c, s, inverse, square)
    known = sizes[KNOWN]
    for m in range(known):
        lines[row + 2 + m] = outlook.remembered[m]
        lines[row + 2 + m, WEIGHT] = ending * ways[BACK] / known
    if known == 0:
        outlook.book[UNIFORM] += ending * ways[BACK]
    sizes[COUNT] = row + 2 + known


@compiled
def guide_of(outlook: Outlook) -> Floats:
    """Return the wall, the likeliest or a remembered one, that shows best how the walls lie."""
    guide: Floats = outlook.lines[outlook.sizes[BEST]]
    for m in range(outlook.sizes[KNOWN]):
        if outlook.remembered[m, BEAMS] > guide[BEAMS]:
            guide = outlook.remembered[m]
    return guide


@compiled
def weight_below(outlook: Outlook, edge: float, reach: float) -> float:
    """Return the weight of all readings below `edge` [m]; never falls as the edge moves on.

    Args:
        outlook: after `look_ahead`.
        edge: 0 .. `reach`.
        reach: the sensor's [m].
    """
    lines = outlook.lines
    total = outlook.book[UNIFORM] * (edge / reach)
    for k in range(outlook.sizes[ROWS]):
        total += lines[k, WEIGHT] * share_below((edge - lines[k, RANGE]) / lines[k, SPREAD])
    return float(total)


@compiled
def void_chance(outlook: Outlook, in_reach: float) -> float:
    """Return how likely the beam has no return: out of habit, or as the wall is out of reach.

    Args:
        outlook: after `look_ahead`.
        in_reach: weight of all readings that the sensor can make.
    """
    habit = void_habit(outlook)
    whole = outlook.book[UNIFORM]
    for k in range(outlook.sizes[ROWS]):
        whole += outlook.lines[k, WEIGHT]
    return float(habit + (1.0 - habit) * (1.0 - in_reach / whole))


@compiled
def void_habit(outlook: Outlook) -> float:
    """Return how many beams like this one had no return so far."""
    at = VOIDS + 2 if outlook.sizes[BEFORE] == VOID else VOIDS
    return float(outlook.book[at] / (outlook.book[at] + outlook.book[at + 1]))


@compiled
def ignored_chance(outlook: Outlook) -> float:
    """Return how likely the beam is one to ignore."""
    at = IGNORES + 2 if outlook.sizes[BEFORE] == IGNORED else IGNORES
    return float(outlook.book[at] / (outlook.book[at] + outlook.book[at + 1]))
