"""Pose graphs in the plane as text: the lines of g2o, read with care and written.

    VERTEX_SE2 id x y theta
    EDGE_SE2 i j x y theta  I11 I12 I13 I22 I23 I33
    FIX id ...

An edge tells the measured pose of vertex j in the frame of vertex i, and the upper half of the
information matrix of its error. Metres and radians.

Source: Kuemmerle, Grisetti, Strasdat, Konolige & Burgard 2011, "g2o: a general framework for graph
optimization".
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from expedition.team import UsageError
from mapping.constraints import Constraints
from mapping.geometry import Floats
from mapping.pose_graph import positive_part

_COUNTS = {"VERTEX_SE2": 4, "EDGE_SE2": 11}
_ONLY = "only graphs of poses in the plane can be read (VERTEX_SE2, EDGE_SE2, FIX)"
_LARGEST = 1e12
_UPPER = np.triu_indices(3)
_GZIP = b"\x1f\x8b"


@dataclass(frozen=True, slots=True)
class GraphFile:
    """A pose graph as a file has it.

    Attributes:
        lines: of the file, without their ends.
        ids: (N) of the vertices, rising.
        poses: (N, 3) poses (x, y, theta) of the vertices in this order.
        constraints: between vertices by their places in this order, as the file has them.
        fixed: the places of the vertices that shall not move.
    """

    lines: list[str]
    ids: list[int]
    poses: Floats
    constraints: Constraints
    fixed: list[int]


def vertex_line(vertex: int, pose: Sequence[float] | Floats) -> str:
    """Return the line of a vertex at a pose (x, y, theta) [m, m, rad]."""
    return f"VERTEX_SE2 {vertex} {_numbers(pose)}"


def edge_line(i: int, j: int, measured: Floats, information: Floats) -> str:
    """Return the line of an edge: the pose (3,) of j in i, and the information (3, 3)."""
    return f"EDGE_SE2 {i} {j} {_numbers(measured)} {_numbers(information[_UPPER])}"


def with_poses(graph: GraphFile, poses: Floats) -> str:
    """Return a file's text with other poses (N, 3) of its vertices, all else as it was."""
    place_of = {vertex: place for place, vertex in enumerate(graph.ids)}
    lines = []
    for line in graph.lines:
        words = line.split()
        if words and words[0] == "VERTEX_SE2":
            line = vertex_line(int(words[1]), poses[place_of[int(words[1])]])
        lines.append(line + "\n")
    return "".join(lines)


def write_text(path: Path, text: str) -> None:
    """Write a text file, packed if its name ends in .gz; its folder is made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    content = text.encode()
    path.write_bytes(gzip.compress(content, mtime=0) if path.suffix == ".gz" else content)


def read_g2o(path: Path) -> GraphFile:
    """Read a pose graph, packed by gzip or not.

    Raises:
        UsageError: there is no such file, it is damaged, or it holds something else; the text names
            the line and the mend.
    """
    lines = _lines_of(path)
    reading = _Reading(str(path))
    for number, line in enumerate(lines, 1):
        words = line.split("#", 1)[0].split()
        if words:
            reading.take(number, words)
    return reading.graph(lines)


def _lines_of(path: Path) -> list[str]:
    """Return the lines of a file, unpacked."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise UsageError(f"{path}: there is no such file: give the path of a g2o file") from None
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}: give the path of a g2o file") from None
    if content.startswith(_GZIP):
        try:
            content = gzip.decompress(content)
        except (OSError, EOFError, zlib.error):
            raise UsageError(f"{path}: its gzip packing is damaged: get the file anew") from None
    return content.decode(errors="replace").splitlines()


class _Reading:
    """What was read of a file so far."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._vertices: dict[int, list[float]] = {}
        self._edges: list[tuple[int, int, int, list[float]]] = []  # line, i, j, numbers
        self._fixed: list[tuple[int, int]] = []  # line, vertex

    def take(self, number: int, words: list[str]) -> None:
        """Take in the words of a line."""
        tag, *rest = words
        if tag == "FIX":
            self._fixed += [(number, self._id(number, word)) for word in rest]
            return
        if tag not in _COUNTS:
            shown = tag[:16].encode("ascii", "replace").decode()
            raise self._wrong(number, f"{shown!r} is none of a 2D pose graph", f"{_ONLY}")
        if len(rest) != _COUNTS[tag]:
            raise self._wrong(
                number, f"{tag} has {len(rest)} values and needs {_COUNTS[tag]}",
                "complete the line or leave it out",
            )  # fmt: skip
        if tag == "VERTEX_SE2":
            vertex = self._id(number, rest[0])
            if vertex in self._vertices:
                raise self._wrong(number, f"vertex {vertex} comes twice", "leave one of them out")
            self._vertices[vertex] = self._floats(number, rest[1:])
        else:
            i, j = self._id(number, rest[0]), self._id(number, rest[1])
            self._edges.append((number, i, j, self._floats(number, rest[2:])))

    def graph(self, lines: list[str]) -> GraphFile:
        """Return the graph, now that all lines are read."""
        if not self._vertices or not self._edges:
            missing = "edges (EDGE_SE2)" if self._vertices else "vertices (VERTEX_SE2)"
            raise UsageError(f"{self._path}: no {missing} in it: give a g2o file of a pose graph")
        ids = sorted(self._vertices)
        place_of = {vertex: place for place, vertex in enumerate(ids)}
        for number, vertex in self._fixed:
            self._known(number, vertex, "FIX")
        for number, i, j, _ in self._edges:
            self._known(number, i, "the edge")
            self._known(number, j, "the edge")
            if i == j:
                raise self._wrong(number, f"an edge from vertex {i} to itself", "leave it out")
        numbers = np.array([edge[3] for edge in self._edges])
        return GraphFile(
            lines,
            ids,
            np.array([self._vertices[vertex] for vertex in ids]),
            Constraints(
                np.array([(place_of[i], place_of[j]) for _, i, j, _ in self._edges]),
                np.ascontiguousarray(numbers[:, :3]),
                self._information(numbers[:, 3:]),
            ),
            sorted({place_of[vertex] for _, vertex in self._fixed}),
        )

    def _information(self, upper: Floats) -> Floats:
        """Return information matrices (E, 3, 3) of their upper halves (E, 6).

        Written digits are few: what is a little below zero for that is made zero.
        """
        information = np.ascontiguousarray(upper[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]]).reshape(-1, 3, 3)
        strengths = np.linalg.eigvalsh(information)
        bad = strengths[:, 0] < -1e-6 * np.maximum(strengths[:, 2], 1e-6)
        if bad.any():
            number = self._edges[int(bad.argmax())][0]
            raise self._wrong(
                number, "its information matrix is not positive semidefinite",
                "give the upper half of an inverse covariance: I11 I12 I13 I22 I23 I33",
            )  # fmt: skip
        for k in np.flatnonzero(strengths[:, 0] < 0.0):
            information[k] = positive_part(information[k])
        return information

    def _known(self, number: int, vertex: int, what: str) -> None:
        """See to it that there is such a vertex."""
        if vertex not in self._vertices:
            mend = f"add its line VERTEX_SE2 {vertex} x y theta, or leave this one out"
            raise self._wrong(number, f"{what} names vertex {vertex}, which is not there", mend)

    def _id(self, number: int, word: str) -> int:
        try:
            return int(word)
        except ValueError:
            raise self._wrong(
                number, f"{word[:24]!r} is no vertex", "vertices are whole numbers"
            ) from None

    def _floats(self, number: int, words: list[str]) -> list[float]:
        for word in words:
            try:
                sound = math.isfinite(value := float(word)) and abs(value) <= _LARGEST
            except ValueError:
                sound = False
            if not sound:
                raise self._wrong(
                    number, f"{word[:24]!r} is no number that can be worked with",
                    "mend it or leave the line out",
                )  # fmt: skip
        return [float(word) for word in words]

    def _wrong(self, number: int, what: str, mend: str) -> UsageError:
        return UsageError(f"{self._path}, line {number}: {what}: {mend}")


def _numbers(values: Sequence[float] | Floats) -> str:
    return " ".join(f"{float(value):.9g}" for value in values)
