from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from mapping.geometry import Pose2
from mapping.grid import CLEAR, OBSTACLE
from protocol.map_cells import pack_cells
from protocol.messages import MapDelta, MapSnapshot, TeamPoses
from protocol.operator_messages import RobotLost
from sim_world.judge import Judge
from sim_world.truth import CoverageJudge
from tests.unit.rooms import room

RESOLUTION = 0.1
HALF = Pose2(0.0, 0.0, 0.0)


def judge() -> Judge:
    solid, geometry = room().free_truth()
    return Judge(CoverageJudge.for_starts(solid, geometry, [(0.0, 0.0)], 0.2), 0.65, 0.35)


def log_odds(rows: int, cols: int, value: float) -> npt.NDArray[np.float32]:
    return np.full((rows, cols), value, dtype=np.float32)


def delta(number: int, x: int, y: int, rows: int, cols: int, value: float = -3.0) -> MapDelta:
    return MapDelta(
        number=number,
        resolution_m=RESOLUTION,
        lattice_x=x,
        lattice_y=y,
        rows=rows,
        cols=cols,
        cells=pack_cells(log_odds(rows, cols, value)),
    )


def whole_truth(number: int) -> MapSnapshot:
    solid, geometry = room().free_truth()
    return MapSnapshot(
        number=number,
        resolution_m=geometry.resolution,
        origin_x_m=geometry.origin_x,
        origin_y_m=geometry.origin_y,
        rows=geometry.rows,
        cols=geometry.cols,
        cells=pack_cells(np.where(solid, 3.0, -3.0).astype(np.float32)),
    )


def poses(**at: tuple[float, float]) -> TeamPoses:
    count = len(at)
    table = np.array([[0.0, x, y, 0.0] for x, y in at.values()]).reshape(-1, 4)
    return TeamPoses(
        robots=tuple(at),
        poses_map=table,
        radii_m=np.full(count, 0.2, dtype=np.float32),
        uncertainty_m=np.zeros(count, dtype=np.float32),
        paths_map=np.zeros((0, 2), dtype=np.float32),
        path_lengths=(0,) * count,
        busy=(False,) * count,
    )


def test_a_perfect_map_covers_everything() -> None:
    one = judge()
    assert one.measure(0.0) == 0.0
    assert one.hear(whole_truth(5), {}, 0.0)
    assert one.number == 5
    assert one.measure(1.0) == pytest.approx(1.0)
    assert one.measure(2.0) == pytest.approx(1.0)  # nothing new: the last figure stands
    assert [t for t, _ in one.timeline] == [0.0, 1.0, 2.0]


def test_deltas_build_the_map_and_grow_it() -> None:
    one = judge()
    assert one.hear(delta(1, -5, -5, 4, 6), {}, 0.0)
    assert one.hear(delta(2, 5, 0, 3, 3, 3.0), {}, 0.0)
    assert one.hear(delta(3, -9, -9, 2, 2), {}, 0.0)
    classes = one.classes()
    assert one.geometry is not None
    assert (classes == CLEAR).sum() == 4 * 6 + 2 * 2
    assert (classes == OBSTACLE).sum() == 9
    iy, ix = one.geometry.cell_at(0.55, 0.05)
    assert classes[iy, ix] == OBSTACLE
    assert 0.0 < one.measure(1.0) < 0.2


def test_a_missed_delta_is_noticed_and_an_old_one_is_ignored() -> None:
    one = judge()
    assert not one.hear(delta(2, 0, 0, 2, 2), {}, 0.0)
    assert one.hear(delta(1, 0, 0, 2, 2), {}, 0.0)
    assert not one.hear(delta(3, 0, 0, 2, 2), {}, 0.0)
    assert one.hear(delta(1, 0, 0, 2, 2, 3.0), {}, 0.0)
    assert (one.classes() == OBSTACLE).sum() == 0
    assert one.hear(whole_truth(9), {}, 0.0)
    assert one.hear(delta(10, 0, 0, 2, 2), {}, 0.0)


def test_what_is_of_no_interest_is_passed_over() -> None:
    one = judge()
    assert one.hear(RobotLost(robot="a", state="lost"), {}, 0.0)
    assert one.number == 0


def test_the_map_is_laid_onto_the_world_where_robots_truly_were() -> None:
    """A team that believes to be elsewhere still covers what it mapped."""
    one = judge()
    T_world_map = Pose2(0.4, -0.2, 0.5)
    for k in range(6):
        x, y = 0.3 * k, 0.1 * k * k
        T_world_base = T_world_map @ Pose2(x, y, 0.0)
        one.hear(poses(a=(x, y), ghost=(0.0, 0.0)), {"a": T_world_base}, 0.0)
    one.hear(delta(1, 0, 0, 2, 2), {}, 0.0)
    one.measure(1.0)
    assert one.T_world_map.x == pytest.approx(0.4)
    assert one.T_world_map.theta == pytest.approx(0.5)


def test_without_any_way_driven_the_frames_count_as_one() -> None:
    one = judge()
    for _ in range(5):
        one.hear(poses(a=(0.0, 0.0)), {"a": Pose2(1.0, 1.0, 0.0)}, 0.0)
    one.hear(delta(1, 0, 0, 2, 2), {}, 0.0)
    one.measure(1.0)
    assert one.T_world_map == HALF


def test_old_poses_are_thinned_out() -> None:
    one = judge()
    truth = {f"r{k}": Pose2(math.sin(k), math.cos(k), 0.0) for k in range(200)}
    at = {name: (pose.x, pose.y) for name, pose in truth.items()}
    for _ in range(25):
        one.hear(poses(**at), truth, 0.0)
    assert one._paired <= 4000


def test_a_map_beyond_all_reason_is_not_believed() -> None:
    one = judge()
    assert one.hear(delta(1, 0, 0, 4, 4), {}, 0.0)
    with pytest.raises(ValueError, match="not believed"):
        one.hear(delta(2, 10**6, 10**6, 4, 4), {}, 0.0)
    assert one.number == 1 and one.classes().size < 10**6
