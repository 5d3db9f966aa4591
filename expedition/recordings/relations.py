"""How far a trajectory is from relative poses that are known to be true.

Source: Kuemmerle, Steder, Dornhege, Ruhnke, Grisetti, Stachniss, Kleiner 2009, "On measuring the
accuracy of SLAM algorithms", Autonomous Robots, eq. 3: the absolute errors of relations.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from expedition.recordings.fields import DamagedError, number
from expedition.recordings.recording import RecordingError
from mapping.geometry import Floats, Pose2, wrap_angle

SAME_STAMP = 1e-3
"""A relation's stamp and a reading's are the same when they differ by no more than this [s]."""


@dataclass(frozen=True, slots=True)
class Relation:
    """Where the robot was at one time, seen from where it was at another.

    Attributes:
        stamp_1: the log's own time [s] of the first pose.
        stamp_2: of the second.
        T_1_2: the second pose in the frame of the first.
    """

    stamp_1: float
    stamp_2: float
    T_1_2: Pose2


@dataclass(frozen=True, slots=True)
class RelationErrors:
    """The errors of a trajectory over the relations whose stamps it has.

    Attributes:
        translational: (m,) [m], none of them negative.
        rotational: (m,) [rad], none of them negative.
        missing: number of relations with a stamp that the trajectory has not.
    """

    translational: Floats
    rotational: Floats
    missing: int

    @property
    def translational_mean(self) -> float:
        """Mean translational error [m]."""
        return float(self.translational.mean())

    @property
    def translational_std(self) -> float:
        """Standard deviation of the translational error [m]."""
        return float(self.translational.std())

    @property
    def rotational_mean(self) -> float:
        """Mean rotational error [rad]."""
        return float(self.rotational.mean())

    @property
    def rotational_std(self) -> float:
        """Standard deviation of the rotational error [rad]."""
        return float(self.rotational.std())


def read_relations(path: Path) -> list[Relation]:
    """Return the relations in a file.

    Raises:
        RecordingError: it cannot be read, or is none; one line that says what to do.
    """
    try:
        return parse_relations(path.read_text(encoding="latin-1").splitlines())
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror or error}: give a relations file") from None


def parse_relations(lines: Iterable[str]) -> list[Relation]:
    """Return the relations in lines `t1 t2 x y z roll pitch yaw` [s, m, rad].

    Empty lines and comments (#) are passed over.

    Raises:
        RecordingError: a line is none; says which. Or there is none at all.
    """
    relations = []
    for line_number, line in enumerate(lines, 1):
        fields = line.split("#", 1)[0].split()
        if not fields:
            continue
        try:
            relations.append(_relation(fields))
        except DamagedError as damage:
            raise RecordingError(
                f"line {line_number}: {damage}; write each relation as 't1 t2 x y z roll pitch yaw'"
            ) from None
    if not relations:
        raise RecordingError("no relations in it; write each as 't1 t2 x y z roll pitch yaw'")
    return relations


def relation_errors(
    stamps: npt.ArrayLike, poses: npt.ArrayLike, relations: Sequence[Relation]
) -> RelationErrors:
    """Return how far a trajectory's relative poses are from the relations.

    Args:
        stamps: (n,) [s], the readings' own, in any order; of equal ones the first counts.
        poses: (n, 3), x, y [m] and theta [rad] in any one frame.
        relations: the truth.

    Raises:
        RecordingError: the trajectory has the stamps of no relation.
    """
    trajectory = np.asarray(poses, dtype=np.float64).reshape(-1, 3)
    index_1 = _indices(stamps, np.array([relation.stamp_1 for relation in relations]))
    index_2 = _indices(stamps, np.array([relation.stamp_2 for relation in relations]))
    known = (index_1 >= 0) & (index_2 >= 0)
    if not known.any():
        raise RecordingError(
            f"none of {len(relations)} relations has its two stamps in the log: "
            "give the relations of this log, in the log's own times"
        )
    truth = np.array([relation.T_1_2.as_tuple() for relation in relations])[known]
    error = _between(truth, _between(trajectory[index_1[known]], trajectory[index_2[known]]))
    return RelationErrors(
        translational=np.hypot(error[:, 0], error[:, 1]),
        rotational=np.abs(_wrapped(error[:, 2])),
        missing=int(np.count_nonzero(~known)),
    )


def _relation(fields: Sequence[str]) -> Relation:
    if len(fields) != 8:
        raise DamagedError(f"{len(fields)} fields")
    stamp_1, stamp_2, x, y, _, _, _, yaw = (number(text) for text in fields)
    return Relation(stamp_1, stamp_2, Pose2(x, y, wrap_angle(yaw)))


def _indices(stamps: npt.ArrayLike, wanted: Floats) -> npt.NDArray[np.intp]:
    """Return the index of the nearest stamp for each wanted one, (m,); -1 where none is near."""
    # `unique` gives of equal stamps the index of the first.
    known, first = np.unique(np.asarray(stamps, dtype=np.float64), return_index=True)
    if not len(known):
        return np.full(len(wanted), -1, dtype=np.intp)
    after = np.clip(np.searchsorted(known, wanted), 0, len(known) - 1)
    before = np.maximum(after - 1, 0)
    to_before, to_after = np.abs(known[before] - wanted), np.abs(known[after] - wanted)
    nearest = np.where(to_before <= to_after, before, after)
    found: npt.NDArray[np.intp] = np.where(
        np.minimum(to_before, to_after) <= SAME_STAMP, first[nearest], -1
    )
    return found


def _between(poses_1: Floats, poses_2: Floats) -> Floats:
    """Return `T_a_1^-1 T_a_2` for poses (m, 3), row by row."""
    c, s = np.cos(poses_1[:, 2]), np.sin(poses_1[:, 2])
    dx, dy = (poses_2 - poses_1)[:, :2].T
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, poses_2[:, 2] - poses_1[:, 2]))


def _wrapped(angles: Floats) -> Floats:
    """Return angles [rad] wrapped to [-pi, pi)."""
    wrapped: Floats = np.remainder(angles + math.pi, 2.0 * math.pi) - math.pi
    return wrapped
