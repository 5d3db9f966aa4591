import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from expedition.results.tracks import as_track, at_stamps, mapped, path_length, thinned
from mapping.geometry import Pose2


def test_rows_that_are_not_finite_are_left_out() -> None:
    assert len(as_track(None)) == 0
    table = as_track(np.array([[0.0, 1.0, 2.0, 3.0], [1.0, np.inf, 0.0, 0.0]]))
    assert table.tolist() == [[0.0, 1.0, 2.0, 3.0]]


def test_path_length() -> None:
    assert path_length(None) == 0.0
    track = np.array([[0, 0, 0, 0], [1, 3, 4, 1], [2, 3, 4, 2]], dtype=float)
    assert path_length(track) == pytest.approx(5.0)


def test_interpolation_holds_the_ends_and_turns_the_short_way() -> None:
    track = np.array([[0.0, 0.0, 0.0, 3.0], [2.0, 2.0, 4.0, -3.0]])
    at = at_stamps(track, np.array([-1.0, 1.0, 5.0]))
    assert at[:, 1].tolist() == [0.0, 1.0, 2.0]
    assert at[:, 2].tolist() == [0.0, 2.0, 4.0]
    assert abs(at[1, 3]) == pytest.approx(math.pi)
    assert at[2, 3] == pytest.approx(-3.0)
    assert len(at_stamps(np.empty((0, 4)), np.array([1.0]))) == 0


def test_mapped() -> None:
    track = mapped(Pose2(1.0, 0.0, math.pi / 2), np.array([[5.0, 1.0, 0.0, 0.0]]))
    assert track[0].tolist() == pytest.approx([5.0, 1.0, 1.0, math.pi / 2])


def test_a_straight_way_needs_two_points() -> None:
    xs = np.linspace(0.0, 5.0, 50)
    line = np.column_stack((xs, xs, np.zeros(50), np.zeros(50)))
    assert len(thinned(line, 0.01)) == 2
    back = np.vstack((line, line[::-1]))
    assert thinned(back, 0.01)[:, 1].tolist() == [0.0, 5.0, 0.0]


def test_standing_still_needs_little() -> None:
    assert len(thinned(np.zeros((100, 4)), 0.01)) == 2
    assert len(thinned(np.zeros((2, 4)), 0.01)) == 2


@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=60),
    st.sampled_from([0.05, 0.5]),
)
def test_no_left_out_point_is_far_from_the_drawn_way(
    points: list[tuple[float, float]], tolerance: float
) -> None:
    track = np.array([(i, x, y, 0.0) for i, (x, y) in enumerate(points)])
    drawn = thinned(track, tolerance)
    assert drawn[0].tolist() == track[0].tolist()
    assert drawn[-1].tolist() == track[-1].tolist()
    for x, y in points:
        near = min(
            _distance(x, y, a, b)
            for a, b in zip(drawn[:, 1:3], [*drawn[1:, 1:3], drawn[-1, 1:3]], strict=True)
        )
        assert near <= 4.0 * tolerance


def _distance(x: float, y: float, a: np.ndarray, b: np.ndarray) -> float:
    along = b - a
    square = float(along @ along)
    point = np.array([x, y])
    t = 0.0 if square == 0.0 else min(max(float((point - a) @ along) / square, 0.0), 1.0)
    return float(np.hypot(*(point - a - t * along)))
