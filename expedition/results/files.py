"""Writing result files so that nobody ever sees half of one."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from pathlib import Path

import numpy as np


def write_atomically(path: Path, content: bytes | str) -> None:
    """Write `content` to `path`: the whole file appears at once, or the old one stays.

    Folders that are missing are made. Text is written as UTF-8.

    Raises:
        OSError: the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def file_stem(name: str) -> str:
    """Return `name` fit to be a file's name: letters, digits, `-`, `_` and `.` stay, not leading.

    A robot's name cannot lead out of the folder that its file belongs into.
    """
    kept = "".join(c if c.isalnum() or c in "-_." else "_" for c in name).lstrip(".")
    return kept or "_"


def plain(value: object) -> object:
    """Return `value` made of what JSON knows: dict, list, str, int, float, bool and None.

    Numbers that JSON cannot say (NaN, infinities) become None; arrays become lists.
    """
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    return str(value)


def as_json(value: object, indent: int | None = None) -> str:
    """Return `value` as strict JSON text (see `plain`)."""
    return json.dumps(plain(value), indent=indent, allow_nan=False, ensure_ascii=False)
