"""Pose graphs as text: read with care, written as they came."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from expedition.graph_files.g2o import edge_line, read_g2o, vertex_line, with_poses, write_text
from expedition.team import UsageError

ONE = "VERTEX_SE2 7 0 0 0\n"
TWO = ONE + "VERTEX_SE2 1000000 1 0 0.5\n"
EDGE = "EDGE_SE2 7 1000000 1 0 0.5 4 0.1 0.2 5 0.3 6\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "graph.g2o"
    path.write_text(text)
    return path


def test_a_graph_as_it_is_written(tmp_path: Path) -> None:
    text = "# a comment\n\nFIX 7\n" + EDGE + "VERTEX_SE2 1000000 1 0 0.5 # the later one\n" + ONE
    graph = read_g2o(written(tmp_path, text))
    assert graph.ids == [7, 1_000_000]
    assert graph.poses.tolist() == [[0, 0, 0], [1, 0, 0.5]]
    assert graph.constraints.ends.tolist() == [[0, 1]]
    assert graph.constraints.measured.tolist() == [[1, 0, 0.5]]
    matrix = [[4, 0.1, 0.2], [0.1, 5, 0.3], [0.2, 0.3, 6]]
    assert graph.constraints.information.tolist() == [matrix]
    assert graph.fixed == [0]
    moved = with_poses(graph, np.array([[0, 0, 0], [2, 3, -0.25]]))
    assert moved.splitlines()[:4] == text.splitlines()[:4]
    assert moved.splitlines()[4] == "VERTEX_SE2 1000000 2 3 -0.25"


def test_packed_files(tmp_path: Path) -> None:
    path = tmp_path / "new" / "graph.g2o.gz"
    write_text(path, TWO + EDGE)
    assert gzip.decompress(path.read_bytes()).decode() == TWO + EDGE
    assert read_g2o(path).ids == [7, 1_000_000]
    plain = path.with_suffix("")
    write_text(plain, TWO + EDGE)
    assert plain.read_text() == TWO + EDGE
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(UsageError, match="packing is damaged"):
        read_g2o(path)


@given(st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3), st.integers(0, 10**12))
def test_what_is_written_is_read(tmp_path_factory, pose: list[float], vertex: int) -> None:
    information = np.diag([1.0, 2.0, 3.0])
    text = "\n".join(
        (
            vertex_line(vertex, pose),
            vertex_line(vertex + 5, (0.0, 0.0, 0.0)),
            edge_line(vertex + 5, vertex, np.array(pose), information),
        )
    )
    graph = read_g2o(written(tmp_path_factory.getbasetemp(), text))
    assert graph.ids == [vertex, vertex + 5]
    assert graph.poses[0] == pytest.approx(pose, rel=1e-8)
    assert graph.constraints.ends.tolist() == [[1, 0]]
    assert graph.constraints.measured[0] == pytest.approx(pose, rel=1e-8)
    assert graph.constraints.information[0].tolist() == information.tolist()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no vertices"),
        ("# nothing\n", "no vertices"),
        (TWO, "no edges"),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n", "line 1: 'VERTEX_SE3:QUAT' is none"),
        (ONE + "EDGE_SE2_XY 7 8 1 1 1 0 1\n", "line 2: 'EDGE_SE2_XY' is none"),
        ("\x7fELF\x02 1 2\n", "line 1: "),
        ("<html>\n", "only graphs of poses in the plane"),
        ("VERTEX_SE2 1 0 0\n", "line 1: VERTEX_SE2 has 3 values and needs 4: complete"),
        (TWO + EDGE[:-3] + "\n", "line 3: EDGE_SE2 has 10 values and needs 11"),
        ("VERTEX_SE2 a 0 0 0\n", "line 1: 'a' is no vertex: vertices are whole numbers"),
        ("FIX 1.5\n", "'1.5' is no vertex"),
        ("VERTEX_SE2 1 0 nan 0\n", "'nan' is no number"),
        ("VERTEX_SE2 1 0 inf 0\n", "'inf' is no number"),
        ("VERTEX_SE2 1 0 1e300 0\n", "'1e300' is no number"),
        ("VERTEX_SE2 1 0 one 0\n", "'one' is no number"),
        (TWO + ONE, "line 3: vertex 7 comes twice"),
        (ONE + EDGE, "line 2: the edge names vertex 1000000, which is not there: add its line"),
        (TWO + EDGE + "FIX 8\n", "line 4: FIX names vertex 8"),
        (TWO + "EDGE_SE2 7 7 0 0 0 1 0 0 1 0 1\n", "line 3: an edge from vertex 7 to itself"),
        (TWO + EDGE + EDGE.replace(" 4 ", " -4 "), "line 4: its information matrix is not"),
        (TWO + EDGE.replace("0.1", "9"), "line 3: its information matrix is not positive"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(UsageError) as error:
        read_g2o(written(tmp_path, text))
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert "graph.g2o" in str(error.value)


def test_what_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="there is no such file: give the path"):
        read_g2o(tmp_path / "none.g2o")
    with pytest.raises(UsageError, match="give the path of a g2o file"):
        read_g2o(tmp_path)


def test_an_information_may_be_singular(tmp_path: Path) -> None:
    graph = read_g2o(written(tmp_path, TWO + "EDGE_SE2 7 1000000 1 0 0 1 0 0 1 0 0\n"))
    assert graph.constraints.information[0].tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 0]]
    # One third of everything, in six digits, is a little less than singular.
    rounded = "EDGE_SE2 7 1000000 1 0 0 1 0.333334 0 0.111111 0 1\n"
    graph = read_g2o(written(tmp_path, TWO + rounded))
    strengths = np.linalg.eigvalsh(graph.constraints.information[0])
    assert strengths == pytest.approx([0.0, 1.0, 1.111111], abs=1e-6)
    assert strengths[0] > -1e-12
