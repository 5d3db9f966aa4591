from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from expedition.recordings.carmen import parse
from expedition.recordings.recording import RecordingError
from expedition.recordings.relations import Relation, parse_relations, relation_errors
from mapping.geometry import Pose2

finite = st.floats(-50.0, 50.0)
poses = st.builds(Pose2, finite, finite, st.floats(-math.pi, math.pi))


def test_lines() -> None:
    relations = parse_relations(["# truth\n", "\n", "10 12.5 1 2 0 0 0 4.0 # one\n"])
    assert relations == [Relation(10.0, 12.5, Pose2(1.0, 2.0, 4.0 - 2 * math.pi))]


@pytest.mark.parametrize("line", ["1 2 3", "1 2 3 4 5 6 7 x", "1 2 nan 4 5 6 7 8", "1 " * 9])
def test_a_damaged_line_is_named(line: str) -> None:
    with pytest.raises(RecordingError, match=r"line 2: .*yaw"):
        parse_relations(["1 2 3 4 5 6 7 8", line])


def test_no_relations() -> None:
    with pytest.raises(RecordingError, match="no relations"):
        parse_relations(["# nothing"])


def test_errors_of_a_known_trajectory() -> None:
    stamps = [10.0, 11.0, 12.0]
    trajectory = [[0, 0, math.pi / 2], [0, 1, math.pi / 2], [0, 2, math.pi]]
    relations = [
        Relation(10.0004, 11.0, Pose2(1.0, 0.0, 0.0)),  # exactly so
        Relation(10.0, 12.0, Pose2(2.3, 0.4, math.pi)),  # 0.5 m and 90 degrees off
        Relation(10.0, 12.5, Pose2(0.0, 0.0, 0.0)),
    ]
    errors = relation_errors(stamps, trajectory, relations)
    np.testing.assert_allclose(errors.translational, [0.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(errors.rotational, [0.0, math.pi / 2], atol=1e-12)
    assert errors.missing == 1
    assert errors.translational_mean == pytest.approx(0.25)
    assert errors.translational_std == pytest.approx(0.25)
    assert errors.rotational_mean == pytest.approx(math.pi / 4)
    assert errors.rotational_std == pytest.approx(math.pi / 4)


def test_of_equal_stamps_the_first_counts_and_order_does_not() -> None:
    stamps = [12.0, 10.0, 12.0, 10.0]
    trajectory = [[5, 0, 0], [4, 0, 0], [70, 0, 0], [70, 0, 0]]
    errors = relation_errors(stamps, trajectory, [Relation(10.0, 12.0, Pose2(1.0, 0.0, 0.0))])
    assert errors.translational.tolist() == [0.0]


@pytest.mark.parametrize("stamps", [[], [1.0, 2.0]])
def test_relations_of_another_log(stamps: list[float]) -> None:
    with pytest.raises(RecordingError, match="this log"):
        relation_errors(stamps, np.zeros((len(stamps), 3)), [Relation(5.0, 6.0, Pose2(0, 0, 0))])


@given(st.lists(poses, min_size=2, max_size=8), poses)
def test_true_relations_have_no_error_in_any_frame(truth: list[Pose2], T_a_map: Pose2) -> None:
    relations = [
        Relation(float(k), float(k + 1), truth[k].inverse() @ truth[k + 1])
        for k in range(len(truth) - 1)
    ]
    moved = np.array([(T_a_map @ T_map_base).as_tuple() for T_map_base in truth])
    errors = relation_errors(np.arange(len(truth)), moved, relations)
    assert errors.translational.max() < 1e-9
    assert errors.rotational.max() < 1e-9


@pytest.mark.data
def test_all_relations_of_a_real_log_are_found(data_dir: Path) -> None:
    with gzip.open(data_dir / "logs" / "intel.clf.gz", "rt") as lines:
        readings = parse(lines).readings
    relations = parse_relations((data_dir / "logs" / "intel.relations").read_text().splitlines())
    stamps = [reading.scan.stamp for reading in readings]
    wheels = [reading.T_wheel_base.as_tuple() for reading in readings]
    errors = relation_errors(stamps, wheels, relations)
    assert len(relations) == 2984
    assert errors.missing == 0
    assert errors.translational_mean > 0.1  # wheels alone lose their way
