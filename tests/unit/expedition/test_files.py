import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from expedition.results.files import as_json, file_stem, plain, write_atomically


@dataclass
class _Point:
    x: float


def test_write_makes_folders_and_replaces(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b.txt"
    write_atomically(path, "first")
    write_atomically(path, b"\x00second")
    assert path.read_bytes() == b"\x00second"
    assert [p.name for p in path.parent.iterdir()] == ["b.txt"]


def test_a_failed_write_leaves_nothing_behind(tmp_path: Path) -> None:
    target = tmp_path / "folder"
    (target / "inside").mkdir(parents=True)
    with pytest.raises(OSError):
        write_atomically(target, "text")
    assert [p.name for p in tmp_path.iterdir()] == ["folder"]


@given(st.text())
def test_a_stem_never_leads_out_of_its_folder(name: str) -> None:
    stem = file_stem(name)
    assert stem and "/" not in stem and "\\" not in stem and not stem.startswith(".")
    assert stem not in ("..", ".") and "\0" not in stem


def test_plain_values() -> None:
    value = {
        1: np.float32(0.5),
        "a": (np.int64(2), float("nan"), float("inf"), None, True),
        "b": np.array([[1.0, np.nan]]),
        "c": _Point(np.float64(2.0)),
        "d": Path("x"),
    }
    assert plain(value) == {
        "1": 0.5,
        "a": [2, None, None, None, True],
        "b": [[1.0, None]],
        "c": {"x": 2.0},
        "d": "x",
    }
    assert json.loads(as_json(value))["a"][0] == 2
