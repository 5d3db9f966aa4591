"""The one place where loops over cells, beams and particles are handed to the compiler.

`@compiled` marks a function that numba translates to machine code at its first call and keeps in a
cache on disk. Each file has a cache folder of its own, keyed by a hash of the file and of all files
of ours that it imports: numba does not notice when a compiled helper, or a constant, in *another*
file changes. So an edit compiles again what depends on it, and nothing else.

Settings, read once at import from the environment:
    NUMBA_DISABLE_JIT=1: run everything as plain Python (branch coverage, debugging).
    NUMBA_CACHE_DIR: use this cache folder instead of our own.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., object])

_ROOT = Path(__file__).parent.parent
_OURS = re.compile(
    r"^from ((?:mapping|coordination|robot_agent|sim_world)[\w.]*) import", re.MULTILINE
)


def cache_base() -> Path:
    """Return the folder that holds all machine code of ours."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "expedition" / "compiled"


@cache
def _sources_of(path: Path) -> tuple[Path, ...]:
    """Return a source file and all files of ours that it imports, directly or not, sorted."""
    found: dict[Path, None] = {}
    waiting = [path]
    while waiting:
        source = waiting.pop()
        if source in found or not source.is_file():
            continue
        found[source] = None
        for module in _OURS.findall(source.read_text(encoding="utf-8")):
            waiting.append(_ROOT / (module.replace(".", "/") + ".py"))
    return tuple(sorted(found))


@cache
def _cache_directory(path: Path) -> Path:
    """Return the folder for machine code of a file, keyed by all that its loops may depend on."""
    digest = hashlib.sha256()
    for source in _sources_of(path):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return cache_base() / f"{path.stem}-{digest.hexdigest()[:16]}"


_directories: dict[Path, None] = {}  # those used so far, in order


def compiled(function: _Function) -> _Function:
    """Compile `function` at its first call; keep the machine code on disk.

    No bounds are checked in compiled code: callers validate indices, and one test run with
    NUMBA_DISABLE_JIT=1 executes every loop as plain Python, where numpy does check.
    """
    directory = _cache_directory(Path(function.__code__.co_filename))
    _directories[directory] = None
    numba.config.CACHE_DIR = str(directory)  # type: ignore[attr-defined]
    return cast(_Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def cache_is_cold() -> bool:
    """Whether most of the loops loaded so far were never compiled on this machine."""
    empty = sum(not any(directory.glob("**/*.nbi")) for directory in _directories)
    return 2 * empty > len(_directories)
