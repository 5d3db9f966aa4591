"""Only one process of this machine compiles the inner loops; the others wait and then load them."""

from __future__ import annotations

import fcntl
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

_POLL_S = 0.2
WAITING = "another process compiles the inner loops: waiting until it is done"


@contextmanager
def only_one(
    folder: Path, say: Callable[[str], None], keep_going: Callable[[], bool] = lambda: True
) -> Iterator[None]:
    """Hold the lock in `folder` meanwhile; the lock of a process that ends is free.

    Args:
        folder: where compiled loops are kept. If nothing can be written there, there is no lock:
            everybody compiles for himself, as nothing can be kept there either.
        say: is told when somebody else holds the lock.
        keep_going: asked while waiting; when false the wait ends without the lock.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / "compiling.lock").open("w")
    except OSError:
        yield
        return
    with file:
        told = False
        while not _taken(file.fileno()) and keep_going():
            if not told:
                say(WAITING)
                told = True
            time.sleep(_POLL_S)
        yield


def _taken(descriptor: int) -> bool:
    """Whether the lock could be taken now."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
