"""What the hypotheses about the next beam learn from what it reads.

Each reading shifts their weights by Bayes' rule, shapes the walls, and is where new ones may begin;
the lightest are forgotten. See `reading_outlook`; here too only + - * / and sqrt in a fixed order.
"""

from __future__ import annotations

from mapping.compiled import compiled
from mapping.geometry import Floats
from mapping.normal_table import share_below
from mapping.polar_line import (
    BEAMS,
    LINE,
    MX,
    MY,
    RANGE,
    SPREAD,
    WEIGHT,
    observe,
    set_line,
    slope_at,
    turned,
)
from mapping.reading_outlook import (
    ANYWHERE,
    BACK,
    BEFORE,
    CLOCK,
    CORNER,
    COUNT,
    DOUBT,
    ENDS,
    IGNORED,
    IGNORES,
    KEPT,
    KNOWN,
    LAST,
    LEAP,
    LEAPS,
    OLD,
    REMEMBERED,
    RETURNED,
    SQUARE,
    TILT,
    UNIFORM,
    VOID,
    VOIDS,
    Outlook,
    Ranging,
    guide_of,
    void_habit,
)

_LIGHTEST = 1e-4  # a lighter line is forgotten
_SPARK = 1e-9  # what is left of a hypothesis that was wrong
_PARALLEL, _CROSSWISE = 0.3, 0.3  # so many walls behind a leap are parallel, or at a right angle
_SETTLED = 4.0  # beams that make a line worth remembering
_SAME_RANGE, _SAME_SLOPE = 0.03, 0.3  # lines that differ by less are one; as shares of 1 / range


@compiled
def learn_reading(outlook: Outlook, ranging: Ranging, rays: Floats, beam: int, cell: int) -> None:
    """Learn that `beam`, for which `look_ahead` was called, reads within `cell`."""
    sizes, book = outlook.sizes, outlook.book
    c, s = rays[beam, 0], rays[beam, 1]
    reading = (cell + 0.5) * ranging.cell
    leapt = _weigh(outlook, ranging, cell)
    slope = (0.0, TILT * TILT)
    if sizes[OLD] > 0:
        # As the walls were before this beam: the likeliest of them is changed by it below.
        slope = slope_at(guide_of(outlook), c, s)
    for k in range(sizes[COUNT]):
        observe(outlook.lines[k], c, s, reading, ranging.variance_coded)
    square = reading * reading
    inverse = (1.0 / reading, ranging.variance_coded / (square * square))
    _begin_walls(outlook, c, s, inverse, slope, leapt)
    _forget(outlook)
    _remember(outlook, c, s, 1.0 / reading)
    _count_kinds(outlook, RETURNED)
    book[LAST] = reading


@compiled
def _weigh(outlook: Outlook, ranging: Ranging, cell: int) -> float:
    """Weigh all hypotheses by how well they foresaw the reading; return the share of the leaps."""
    lines, sizes, book = outlook.lines, outlook.sizes, outlook.book
    count = sizes[COUNT]
    leaps = len(LEAPS) if sizes[OLD] > 0 else 0
    near = cell * ranging.cell
    total = book[UNIFORM] / ranging.cells
    anywhere = total
    for k in range(count + leaps):
        above = share_below((near + ranging.cell - lines[k, RANGE]) / lines[k, SPREAD])
        below = share_below((near - lines[k, RANGE]) / lines[k, SPREAD])
        lines[k, WEIGHT] = lines[k, WEIGHT] * (above - below) + (_SPARK if k < count else 0.0)
        total += lines[k, WEIGHT]
    leapt = anywhere / total
    for k in range(count + leaps):
        lines[k, WEIGHT] /= total
        if k >= count:
            leapt += lines[k, WEIGHT]
    if sizes[OLD] > 0:
        _count_ends(outlook, anywhere / total)
    return float(leapt)


@compiled
def _count_ends(outlook: Outlook, anywhere: float) -> None:
    """Count whether a wall ended, and in which way, each in part."""
    lines, sizes, ways, book = outlook.lines, outlook.sizes, outlook.ways, outlook.book
    first, count = sizes[OLD], sizes[COUNT]
    ended = anywhere + lines[first, WEIGHT] + lines[first + 1, WEIGHT]
    ways[ANYWHERE] += anywhere
    ways[CORNER] += lines[first, WEIGHT]
    ways[SQUARE] += lines[first + 1, WEIGHT]
    for k in range(first + 2, count):
        ways[BACK] += lines[k, WEIGHT]
        ended += lines[k, WEIGHT]
    for a in range(len(LEAPS)):
        ways[LEAP + a] += lines[count + a, WEIGHT]
        ended += lines[count + a, WEIGHT]
    if sizes[BEFORE] != VOID:
        book[ENDS] += ended
        book[ENDS + 1] += 1.0


@compiled
def _begin_walls(
    outlook: Outlook,
    c: float,
    s: float,
    inverse: tuple[float, float],
    slope: tuple[float, float],
    leapt: float,
) -> None:
    """Add the walls that may begin at this reading, if the beam has leapt to it."""
    lines, sizes = outlook.lines, outlook.sizes
    row = sizes[COUNT]
    unknown = (0.0, TILT * TILT)
    if sizes[OLD] == 0:
        set_line(lines[row], leapt, c, s, inverse, unknown)
        sizes[COUNT] = row + 1
        return
    set_line(lines[row], leapt * _PARALLEL, c, s, inverse, turned(slope, False, DOUBT))
    set_line(lines[row + 1], leapt * _CROSSWISE, c, s, inverse, turned(slope, True, DOUBT))
    rest = leapt * (1.0 - _PARALLEL - _CROSSWISE)
    set_line(lines[row + 2], rest, c, s, inverse, unknown)
    sizes[COUNT] = row + 3


@compiled
def _forget(outlook: Outlook) -> None:
    """Keep the heaviest lines, in that order."""
    lines, sizes = outlook.lines, outlook.sizes
    count = sizes[COUNT]
    kept = min(count, KEPT)
    for a in range(kept):
        best = a
        for k in range(a + 1, count):
            if lines[k, WEIGHT] > lines[best, WEIGHT]:
                best = k
        for f in range(LINE):
            lines[a, f], lines[best, f] = lines[best, f], lines[a, f]
        if a > 0 and lines[a, WEIGHT] < _LIGHTEST:
            kept = a
            break
    sizes[COUNT] = kept
    _normalise(outlook)


@compiled
def _normalise(outlook: Outlook) -> None:
    """Make the weights of the lines add up to 1."""
    lines, count = outlook.lines, outlook.sizes[COUNT]
    total = 0.0
    for k in range(count):
        total += lines[k, WEIGHT]
    for k in range(count):
        lines[k, WEIGHT] /= total


@compiled
def _remember(outlook: Outlook, c: float, s: float, inverse: float) -> None:
    """Remember the likeliest line in the place of an older state of it, or of the oldest one."""
    line, remembered, sizes = outlook.lines[0], outlook.remembered, outlook.sizes
    sizes[CLOCK] += 1
    if line[BEAMS] < _SETTLED:
        return
    place = -1
    oldest = 0
    for m in range(sizes[KNOWN]):
        dx, dy = remembered[m, MX] - line[MX], remembered[m, MY] - line[MY]
        same_range = abs(c * dx + s * dy) < _SAME_RANGE * inverse
        if same_range and abs(c * dy - s * dx) < _SAME_SLOPE * inverse:
            place = m
            break
        if remembered[m, SPREAD] < remembered[oldest, SPREAD]:
            oldest = m
    if place < 0 and sizes[KNOWN] < REMEMBERED:
        place = sizes[KNOWN]
        sizes[KNOWN] += 1
    elif place < 0:
        place = oldest
    remembered[place] = line
    remembered[place, SPREAD] = sizes[CLOCK]


@compiled
def learn_void(outlook: Outlook, reach: float) -> None:
    """Learn that the beam had no return; walls that are out of `reach` [m] become likelier."""
    lines, sizes = outlook.lines, outlook.sizes
    habit = void_habit(outlook)
    sizes[COUNT] = sizes[OLD]
    for k in range(sizes[COUNT]):
        in_reach = share_below((reach - lines[k, RANGE]) / lines[k, SPREAD])
        lines[k, WEIGHT] *= habit + (1.0 - habit) * (1.0 - in_reach)
    _normalise(outlook)
    _count_kinds(outlook, VOID)


@compiled
def learn_ignored(outlook: Outlook) -> None:
    """Learn that the beam is one to ignore."""
    outlook.sizes[COUNT] = outlook.sizes[OLD]
    _normalise(outlook)
    _count_kinds(outlook, IGNORED)


@compiled
def _count_kinds(outlook: Outlook, kind: int) -> None:
    """Count what the beam was, given what the one before was."""
    book, before = outlook.book, outlook.sizes[BEFORE]
    at = IGNORES + 2 if before == IGNORED else IGNORES
    book[at if kind == IGNORED else at + 1] += 1.0
    if kind != IGNORED:
        at = VOIDS + 2 if before == VOID else VOIDS
        book[at if kind == VOID else at + 1] += 1.0
    outlook.sizes[BEFORE] = kind
