import numpy as np

from mapping.distance_field import truncated_distance
from mapping.path_escape import ESCAPE_WEIGHT, with_escape
from mapping.path_planning import cost_field, traversal_weights

RESOLUTION = 0.1
BODY = 0.25


def planned(obstacle: np.ndarray, clear: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    clearance = truncated_distance(obstacle, RESOLUTION, 1.0)
    return traversal_weights(clear, clearance, BODY, 0.5), clearance


def room() -> np.ndarray:
    obstacle = np.zeros((20, 20), dtype=bool)
    obstacle[[0, -1], :] = obstacle[:, [0, -1]] = True
    return obstacle


def test_a_start_in_the_open_needs_nothing() -> None:
    obstacle = room()
    weights, clearance = planned(obstacle, ~obstacle)
    assert with_escape(weights, ~obstacle, clearance, (10, 10), RESOLUTION, 0.5) is weights
    assert with_escape(weights, ~obstacle, clearance, (-1, 10), RESOLUTION, 0.5) is weights


def test_leaves_a_wall() -> None:
    obstacle = room()
    weights, clearance = planned(obstacle, ~obstacle)
    assert not cost_field(weights, (1, 10), RESOLUTION).reaches(10, 10)
    opened = with_escape(weights, ~obstacle, clearance, (1, 10), RESOLUTION, 0.5)
    assert (opened == ESCAPE_WEIGHT).any()
    assert cost_field(opened, (1, 10), RESOLUTION).reaches(10, 10)
    assert (weights[opened != weights] == 0).all()


def test_does_not_open_a_gap_too_narrow_for_the_body() -> None:
    obstacle = room()
    obstacle[10, :] = True
    obstacle[10, 9:12] = False  # 0.3 m wide: the robot's body needs 0.5 m
    weights, clearance = planned(obstacle, ~obstacle)
    opened = with_escape(weights, ~obstacle, clearance, (8, 10), RESOLUTION, 1.0)
    field = cost_field(opened, (8, 10), RESOLUTION)
    assert field.reaches(5, 10)
    assert not field.reaches(15, 10)


def test_squeezes_out_where_clearance_must_fall() -> None:
    obstacle = room()
    obstacle[4, 1:9] = obstacle[1:4, 8] = True  # a niche in the corner ...
    obstacle[4, 3:6] = False  # ... with a narrow door
    clear = ~obstacle
    weights, clearance = planned(obstacle, clear)
    start = (2, 2)
    assert weights[start] == 0
    opened = with_escape(weights, clear, clearance, start, RESOLUTION, 0.8)
    assert cost_field(opened, start, RESOLUTION).reaches(12, 12)


def test_what_lies_under_the_body_counts_as_clear() -> None:
    obstacle = room()
    clear = ~obstacle
    clear[9:12, 9:12] = False
    weights, clearance = planned(obstacle, clear)
    shut = with_escape(weights, clear, clearance, (10, 10), RESOLUTION, 0.5)
    assert shut is weights
    opened = with_escape(weights, clear, clearance, (10, 10), RESOLUTION, 0.5, BODY)
    assert cost_field(opened, (10, 10), RESOLUTION).reaches(5, 5)


def test_walled_in_stays_walled_in() -> None:
    obstacle = np.ones((9, 9), dtype=bool)
    obstacle[4, 4] = False
    weights, clearance = planned(obstacle, ~obstacle)
    assert with_escape(weights, ~obstacle, clearance, (4, 4), RESOLUTION, 2.0) is weights
    corner = with_escape(weights, ~obstacle, clearance, (0, 0), RESOLUTION, 2.0)
    assert corner is weights
