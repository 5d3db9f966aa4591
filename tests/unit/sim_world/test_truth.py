import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry import IDENTITY, Pose2
from mapping.grid import CLEAR, OBSTACLE, UNKNOWN, GridGeometry
from sim_world.map_server import read_map
from sim_world.truth import (
    CoverageJudge,
    body_places,
    coverage,
    fit_team,
    occupancy_scores,
    overlap,
    reachable_area,
    reachable_places,
    trajectory_rmse,
)

GEOMETRY = GridGeometry(0.1, 0.0, 0.0, 30, 60)


@pytest.fixture
def two_rooms():
    """Two rooms of 3 x 3 m with a wall between them, and a slit of 0.4 m in it."""
    solid = np.zeros(GEOMETRY.shape, dtype=bool)
    solid[:, 29:31] = True
    solid[13:17, 29:31] = False
    return solid


def _as_map(solid, reachable):
    classes = np.full(solid.shape, UNKNOWN, dtype=np.uint8)
    classes[reachable] = CLEAR
    classes[solid] = OBSTACLE
    return classes


def test_a_body_fits_where_half_its_width_is_free(two_rooms):
    places = body_places(two_rooms, GEOMETRY, 0.25)
    assert not places[:2].any() and not places[:, :2].any()
    assert places[15, 2] and not places[15, 1]
    assert not places[:, 29:31].any()
    assert body_places(two_rooms, GEOMETRY, 0.15)[14, 30]


def test_reach_depends_on_the_body(two_rooms):
    slim = reachable_area(two_rooms, GEOMETRY, [[1.0, 1.0]], 0.15)
    stout = reachable_area(two_rooms, GEOMETRY, [[1.0, 1.0, 0.0]], 0.25)
    assert slim[15, 45] and slim[15, 15]
    assert not stout[15, 45] and stout[15, 15]
    assert not stout[:, 31:].any()
    assert stout[1, 15] and stout[0, 15]
    assert not stout[0, 0]
    assert not (slim & two_rooms).any()
    both = reachable_area(two_rooms, GEOMETRY, [[1.0, 1.0], [5.0, 1.0]], 0.25)
    assert both[15, 45]


def test_a_start_close_to_a_wall_counts_for_the_place_beside_it(two_rooms):
    places = body_places(two_rooms, GEOMETRY, 0.25)
    assert reachable_places(
        places,
        GEOMETRY,
        [[0.05, 1.0]],
    ).any()
    assert not reachable_places(places, GEOMETRY, [[-4.0, 90.0]]).any()
    assert not reachable_area(two_rooms, GEOMETRY, [[-4.0, 90.0]], 0.25).any()


def test_a_perfect_map(two_rooms):
    reachable = reachable_area(two_rooms, GEOMETRY, [[1.0, 1.0]], 0.25)
    classes = _as_map(two_rooms, reachable)
    assert coverage(reachable, GEOMETRY, classes, GEOMETRY, IDENTITY) == 1.0
    scores = occupancy_scores(two_rooms, reachable, GEOMETRY, classes, GEOMETRY, IDENTITY)
    assert (scores.precision_occupied, scores.recall_occupied, scores.free_error) == (1, 1, 0)


def test_half_a_map(two_rooms):
    reachable = reachable_area(two_rooms, GEOMETRY, [[1.0, 1.0]], 0.25)
    classes = _as_map(two_rooms, reachable)
    classes[:15] = UNKNOWN
    judge = CoverageJudge.for_starts(two_rooms, GEOMETRY, [[1.0, 1.0]], 0.25)
    assert judge.coverage(classes, GEOMETRY, IDENTITY) == pytest.approx(0.5, abs=0.01)
    assert judge.area == pytest.approx(np.count_nonzero(reachable) * 0.01)
    scores = judge.scores(classes, GEOMETRY, IDENTITY)
    assert scores.precision_occupied == 1.0
    assert 0.4 < scores.recall_occupied < 0.7


def test_an_empty_map(two_rooms):
    judge = CoverageJudge.for_starts(two_rooms, GEOMETRY, [[1.0, 1.0]], 0.25)
    classes = np.zeros((4, 5), dtype=np.uint8)
    geometry = GridGeometry(0.15, 0.0, 0.0, 4, 5)
    assert judge.coverage(classes, geometry, IDENTITY) == 0.0
    scores = judge.scores(classes, geometry, IDENTITY)
    assert (scores.precision_occupied, scores.recall_occupied, scores.free_error) == (1, 0, 0)
    nothing = CoverageJudge(two_rooms, GEOMETRY, np.zeros_like(two_rooms))
    assert nothing.coverage(classes, geometry, IDENTITY) == 0.0
    assert nothing.scores(classes, geometry, IDENTITY).recall_occupied == 1.0


def test_wrong_cells_count_beyond_the_tolerance():
    solid = np.zeros(GEOMETRY.shape, dtype=bool)
    solid[:, 30:] = True
    reachable = ~solid
    classes = np.zeros(GEOMETRY.shape, dtype=np.uint8)
    # 0.1 and 0.2 m before the wall; 0.2 m inside it is nearer than 0.25 m to free space
    classes[10, 29], classes[10, 28] = OBSTACLE, OBSTACLE
    classes[12, 30], classes[12, 31], classes[12, 32] = CLEAR, CLEAR, CLEAR
    scores = occupancy_scores(solid, reachable, GEOMETRY, classes, GEOMETRY, IDENTITY)
    assert scores.precision_occupied == 0.5
    assert scores.free_error == pytest.approx(2 / 3)
    wide = occupancy_scores(solid, reachable, GEOMETRY, classes, GEOMETRY, IDENTITY, 0.25)
    assert wide.precision_occupied == 1.0
    assert wide.free_error == pytest.approx(1 / 3)


def test_cells_outside_the_truth_are_wrong():
    solid = np.zeros((10, 10), dtype=bool)
    geometry = GridGeometry(0.1, 0.0, 0.0, 10, 10)
    classes = np.array([[OBSTACLE, CLEAR]], dtype=np.uint8)
    far = GridGeometry(0.1, 30.0, 30.0, 1, 2)
    scores = occupancy_scores(solid, ~solid, geometry, classes, far, IDENTITY)
    assert (scores.precision_occupied, scores.free_error) == (0.0, 1.0)


@settings(max_examples=20, deadline=None)
@given(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.integers(0, 3))
def test_scores_do_not_depend_on_the_map_frame(x, y, quarter):
    solid = np.zeros((20, 24), dtype=bool)
    solid[4:8, 10:14] = True
    geometry = GridGeometry(0.1, 0.0, 0.0, 20, 24)
    reachable = reachable_area(solid, geometry, [[0.5, 1.5]], 0.25)
    classes = np.rot90(_as_map(solid, reachable), quarter)
    T_world_map = Pose2(x, y, quarter * math.pi / 2)
    corner = T_world_map.inverse().apply([[0, 0], [2.4, 2.0]]).min(axis=0)
    map_geometry = GridGeometry(0.1, corner[0], corner[1], *classes.shape)
    got = coverage(reachable, geometry, classes, map_geometry, T_world_map)
    assert got == 1.0
    scores = occupancy_scores(solid, reachable, geometry, classes, map_geometry, T_world_map)
    assert (scores.precision_occupied, scores.recall_occupied, scores.free_error) == (1, 1, 0)


def _trajectory(seed, offset=0.0):
    rng = np.random.default_rng(seed)
    stamps = np.arange(0.0, 20.0, 0.5) + offset
    places = np.cumsum(rng.normal(0.0, 0.3, (len(stamps), 2)), axis=0)
    thetas = np.cumsum(rng.normal(0.0, 0.5, len(stamps)))
    return np.column_stack((stamps, places, np.angle(np.exp(1j * thetas))))


def _moved(rows, T):
    moved = rows.copy()
    moved[:, 1:3] = T.apply(rows[:, 1:3])
    moved[:, 3] += T.theta
    return moved


def test_one_transform_for_the_whole_team():
    T_world_map = Pose2(3.0, -2.0, 0.7)
    truth = {"r1": _trajectory(1), "r2": _trajectory(2)}
    estimated = {k: _moved(rows, T_world_map.inverse()) for k, rows in truth.items()}
    fitted = fit_team(estimated, truth)
    assert fitted.as_array() == pytest.approx(T_world_map.as_array())
    errors = trajectory_rmse(estimated, truth, fitted)
    assert errors == {"r1": pytest.approx(0.0, abs=1e-9), "r2": pytest.approx(0.0, abs=1e-9)}
    # One robot's error is not fitted away.
    estimated["r2"][:, 1:3] += [1.0, 0.0]
    errors = trajectory_rmse(estimated, truth, fit_team(estimated, truth))
    assert 0.2 < errors["r1"] < 0.8 and 0.2 < errors["r2"] < 0.8


def test_stamps_are_matched_by_interpolation():
    truth = {"r1": np.array([[0.0, 0.0, 0.0, 0.0], [10.0, 10.0, 0.0, 0.0]])}
    estimated = {
        "r1": np.array([[-1.0, 9, 9, 0], [2.5, 2.5, 0, 0], [7.0, 7, 0, 0], [11.0, 9, 9, 0]])
    }
    assert fit_team(estimated, truth).as_array() == pytest.approx([0, 0, 0])
    assert trajectory_rmse(estimated, truth, IDENTITY)["r1"] == pytest.approx(0.0)


def test_robots_that_stood_are_fitted_by_their_headings():
    truth = {"r1": np.array([[0.0, 5.0, 5.0, 1.0], [9.0, 5.0, 5.0, 1.0]])}
    estimated = {"r1": np.array([[0.0, 0.0, 0.0, 0.0], [9.0, 0.0, 0.0, 0.0]])}
    assert fit_team(estimated, truth).as_array() == pytest.approx([5.0, 5.0, 1.0])


def test_nothing_to_compare():
    rows = np.array([[0.0, 1.0, 2.0, 0.0]])
    assert fit_team({}, {}) == IDENTITY
    assert fit_team({"r1": rows}, {}) == IDENTITY
    assert trajectory_rmse({"r1": rows}, {}, IDENTITY) == {"r1": None}


def test_overlap():
    assert overlap([0.5, 0.5], 1.0) == 0.0
    assert overlap([0.8, 0.7], 1.0) == pytest.approx(0.5)
    assert overlap([0.0], 0.0) == 0.0


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "start", "area"),
    [
        ("hospital_62m", (2.0, 12.5), 1043),
        ("willow", (9.18, 11.68), 579),
        ("office_plan", (2.68, 5.28), 1304),
        ("office_furnished", (2.18, 7.82), 1098),
        ("lab_scanned", (4.82, 18.08), 703),
        ("gdc_3", (5.08, 15.42), 1168),
    ],
)
def test_the_area_a_body_gets_to_in_real_maps(data_dir, name, start, area):
    """The index of the maps counts places of the body's centre, by a slightly kinder rule."""
    solid, geometry = read_map(data_dir / "maps" / f"{name}.yaml")
    places = reachable_places(body_places(solid, geometry, 0.25), geometry, [start])
    got = np.count_nonzero(places) * geometry.resolution**2
    assert 0.93 * area < got <= 1.01 * area
