"""What this process does with memory that it has freed.

Maps are arrays of megabytes that come and go with every plan. By default the C library hands such
blocks back to the system at once, and the next array costs a page fault for every 4 kB: more than
the work that is done on it. So freed memory is kept, up to a limit, and used again.

Python's collector of reference cycles looks through everything that lives whenever some hundred
more objects do. Missions make messages and poses by the million and hardly a cycle: it may look
much less often.
"""

from __future__ import annotations

import ctypes
import gc

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # M_* of mallopt(3)
_KEPT = 32 << 20  # [bytes]; free memory at the end of the heap that is not handed back
_LARGE = 32 << 20  # [bytes]; larger arrays than this still come straight from the system
_YOUNG, _MIDDLE = 100_000, 50  # objects, and collections of younger ones, between two looks


def keep_freed_memory() -> bool:
    """Keep freed memory for the next array; return whether the C library takes such wishes."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # not the GNU C library
        return False
    return bool(mallopt(_TRIM_THRESHOLD, _KEPT) and mallopt(_MMAP_THRESHOLD, _LARGE))


def collect_seldom() -> None:
    """Let the collector of reference cycles work less often; processes forked later do the same."""
    gc.set_threshold(_YOUNG, _MIDDLE, _MIDDLE)
