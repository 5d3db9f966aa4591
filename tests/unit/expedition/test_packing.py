from pathlib import Path

import numpy as np
import pytest

from expedition.results.packing import UNREADABLE, merge, read_tree, write_tree
from mapping.geometry import Pose2


def test_round_trip(tmp_path: Path) -> None:
    tree = {"a": [np.arange(3), {"b": Pose2(1.0, 2.0, 3.0)}], "c": np.float32(0.5), "d": None}
    write_tree(tmp_path / "x" / "part.npz", tree)
    back = read_tree(tmp_path / "x" / "part.npz")
    assert back["a"][0].tolist() == [0, 1, 2]
    assert back["a"][1] == {"b": {"x": 1.0, "y": 2.0, "theta": 3.0}}
    assert (back["c"], back["d"]) == (0.5, None)


def test_a_file_that_is_no_tree(tmp_path: Path) -> None:
    np.savez(tmp_path / "list.npz", tree=np.frombuffer(b"[1]", dtype=np.uint8))
    for name in ("list.npz", "missing.npz"):
        with pytest.raises(UNREADABLE):
            read_tree(tmp_path / name)


def test_merging() -> None:
    assert merge(None, 1) == 1
    assert merge(1, None) == 1
    assert merge([1], [2]) == [1, 2]
    assert merge([1], []) == [1]
    assert merge({"a": {"b": 1}, "c": 2}, {"a": {"d": 3}}) == {"a": {"b": 1, "d": 3}, "c": 2}
    assert merge({"geometry": 1, "log_odds": 2}, {"geometry": 3}) == {"geometry": 3}
