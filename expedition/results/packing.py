"""Trees of plain values, dataclasses and arrays, one file each, and how two trees are merged.

Arrays and the JSON tree that names them lie in one `.npz` file, so that they can never be of two
savings.
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from expedition.results.files import plain, write_atomically

UNREADABLE = (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile, zlib.error)


def write_tree(path: Path, tree: Mapping[str, object]) -> None:
    """Write a tree to `path`, as a whole.

    Raises:
        OSError: the file cannot be written.
    """
    arrays: dict[str, npt.NDArray[Any]] = {}
    text = json.dumps(_pack(tree, arrays), allow_nan=False)
    arrays["tree"] = np.frombuffer(text.encode(), dtype=np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    write_atomically(path, buffer.getvalue())


def read_tree(path: Path) -> dict[str, Any]:
    """Return the tree in `path`, dataclasses as dicts of their fields.

    Raises:
        UNREADABLE: any of these; the file is missing, damaged or not of this kind.
    """
    # Read whole first: numpy leaves a damaged file open.
    with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as stored:
        arrays = {key: stored[key] for key in stored.files if key != "tree"}
        tree = json.loads(stored["tree"].tobytes().decode())
    unpacked = _unpack(tree, arrays)
    if not isinstance(unpacked, dict):
        raise ValueError("not a part of a record")
    return unpacked


def _pack(value: object, arrays: dict[str, npt.NDArray[Any]]) -> object:
    """Return `value` for JSON, arrays taken out into `arrays` and named in their place."""
    if isinstance(value, np.ndarray):
        key = f"a{len(arrays)}"
        arrays[key] = value
        return {"$array": key}
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _pack(getattr(value, f.name), arrays) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _pack(item, arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_pack(item, arrays) for item in value]
    return plain(value)


def _unpack(value: Any, arrays: Mapping[str, npt.NDArray[Any]]) -> Any:
    """Put the arrays back into their places."""
    if isinstance(value, dict):
        if set(value) == {"$array"}:
            return arrays[value["$array"]]
        return {key: _unpack(item, arrays) for key, item in value.items()}
    if isinstance(value, list):
        return [_unpack(item, arrays) for item in value]
    return value


_WHOLE = {"geometry", "log_odds", "solid"}  # a grid comes from one part, never from two


def merge(old: Any, new: Any) -> Any:
    """Return what two parts say together; None says nothing."""
    if new is None or (isinstance(new, list | dict) and not new and old is not None):
        return old
    if isinstance(old, list) and isinstance(new, list):
        return old + new
    if isinstance(old, dict) and isinstance(new, dict) and not _WHOLE & set(new):
        return old | {key: merge(old.get(key), item) for key, item in new.items()}
    return new
