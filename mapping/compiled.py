"""The one place where loops over cells, beams and particles are handed to the compiler.

`@compiled` marks a function that numba translates to machine code at its first call and keeps in a
cache on disk. The cache folder is keyed by a hash of every source file that may hold such a
function: numba itself does not notice when a compiled helper in *another* file changes.

Settings, read once at import from the environment:
    NUMBA_DISABLE_JIT=1: run everything as plain Python (branch coverage, debugging).
    NUMBA_CACHE_DIR: use this cache folder instead of our own.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

_Function = TypeVar("_Function", bound=Callable[..., object])


def _source_digest() -> str:
    """Return a short hash over all modules of ours that hold compiled functions."""
    root = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for package in ("mapping", "coordination", "robot_agent", "sim_world"):
        for path in sorted((root / package).rglob("*.py")):
            source = path.read_bytes()
            if b"@compiled" in source:
                digest.update(path.name.encode())
                digest.update(source)
    return digest.hexdigest()[:16]


def _cache_directory() -> str:
    """Return the folder for machine code of exactly these sources."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return str(Path(base) / "expedition" / f"compiled-{_source_digest()}")


os.environ.setdefault("NUMBA_CACHE_DIR", _cache_directory())

import numba  # noqa: E402  (the cache folder must be known before numba is imported)


def compiled(function: _Function) -> _Function:
    """Compile `function` at its first call; keep the machine code on disk.

    No bounds are checked in compiled code: callers validate indices, and one test run with
    NUMBA_DISABLE_JIT=1 executes every loop as plain Python, where numpy does check.
    """
    return cast(_Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def cache_is_cold() -> bool:
    """Whether nothing of these sources was compiled on this machine yet."""
    return not any(Path(os.environ["NUMBA_CACHE_DIR"]).glob("**/*.nbi"))
