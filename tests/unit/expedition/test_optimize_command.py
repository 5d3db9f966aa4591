"""`expedition optimize`: what it prints, writes and refuses."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from expedition.cli import main
from expedition.graph_files.g2o import edge_line, read_g2o, vertex_line
from tests.unit.mapping.looped_walk import looped_walk

Call = Callable[..., tuple[int, str, str]]
FIRST, STEP = 100, 10  # ids need not be consecutive


@pytest.fixture
def cli(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    def call(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["expedition", *words])
        monkeypatch.setattr("expedition.cli.keep_freed_memory", lambda: None)
        monkeypatch.setattr("expedition.cli.collect_seldom", lambda: None)
        with pytest.raises(SystemExit) as ended:
            main()
        captured = capsys.readouterr()
        return int(ended.value.code or 0), captured.out, captured.err

    return call


@pytest.fixture
def graph(tmp_path: Path) -> Path:
    """A walk with many loops, and a last one that is wrong."""
    _, way, constraints = looped_walk(60)
    lines = [vertex_line(FIRST + STEP * k, pose) for k, pose in enumerate(way)]
    lines += [
        edge_line(FIRST + STEP * int(i), FIRST + STEP * int(j), measured, information)
        for (i, j), measured, information in zip(
            constraints.ends, constraints.measured, constraints.information, strict=True
        )
    ]
    wrong = edge_line(FIRST, FIRST + STEP * 50, np.array([40.0, 3.0, 1.0]), 2500.0 * np.eye(3))
    path = tmp_path / "walk.g2o"
    path.write_text("\n".join([*lines, wrong, f"FIX {FIRST}"]) + "\n")
    return path


def test_one_json_object(cli: Call, graph: Path) -> None:
    status, out, err = cli("optimize", str(graph), "--json")
    assert (status, err) == (0, "")
    result = json.loads(out)
    assert list(result) == [
        "chi2_before", "chi2_after", "iterations", "seconds", "vertices", "edges", "rejected",
    ]  # fmt: skip
    assert result["chi2_after"] < result["chi2_before"]
    assert (result["vertices"], result["rejected"]) == (60, 1)
    assert 0.0 < result["seconds"] < 60.0
    plain = json.loads(cli("optimize", str(graph), "--json", "--no-robust")[1])
    assert plain["rejected"] == 0
    assert plain["chi2_after"] > 10.0 * result["chi2_after"]


def test_the_file_written_is_the_one_read_at_its_optimum(cli: Call, graph: Path) -> None:
    out = graph.parent / "results" / "best.g2o.gz"
    status, said, _ = cli("optimize", str(graph), "--out", str(out))
    assert status == 0
    assert "60 poses" in said
    assert "1 edge contradicts the rest" in said
    assert "best.g2o.gz" in said
    before, after = read_g2o(graph), read_g2o(out)
    assert after.ids == before.ids
    assert after.lines[60:] == before.lines[60:]
    assert np.array_equal(after.poses[0], before.poses[0])
    again = json.loads(cli("optimize", str(out), "--json")[1])
    assert again["chi2_before"] == pytest.approx(again["chi2_after"], rel=1e-5)


def test_without_out_the_paragraph_says_how_to_keep_it(cli: Call, graph: Path) -> None:
    _, said, _ = cli("optimize", str(graph), "--no-robust")
    assert "all edges count" in said
    assert "--out" in said


def test_help_reads_well(cli: Call) -> None:
    status, said, _ = cli("optimize", "--help")
    assert status == 0
    for word in ("GRAPH.g2o", "--out", "--robust", "--no-robust", "--json"):
        assert word in said


@pytest.mark.parametrize("text", [None, "", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n", "no graph\n"])
def test_bad_input_is_one_line_and_status_2(cli: Call, tmp_path: Path, text: str | None) -> None:
    path = tmp_path / "bad.g2o"
    if text is not None:
        path.write_text(text)
    status, out, err = cli("optimize", str(path), "--json")
    assert (status, out) == (2, "")
    assert err.startswith("expedition: ")
    assert err.count("\n") == 1
    assert "bad.g2o" in err


def test_a_place_that_cannot_be_written_is_one_line(cli: Call, graph: Path) -> None:
    status, _, err = cli("optimize", str(graph), "--out", str(graph / "below" / "a.g2o"))
    assert status == 2
    assert err.count("\n") == 1
