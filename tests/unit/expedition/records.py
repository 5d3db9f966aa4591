"""Made-up runs for tests of the results."""

import numpy as np

from expedition.results.record import (
    PoseGraphRecord,
    RobotRecord,
    RunRecord,
    TruthRecord,
)
from mapping.geometry import Pose2
from mapping.grid import GridGeometry, OccupancyGrid

T_WORLD_MAP = Pose2(0.4, -0.2, 0.1)


def walled_room(rows: int = 30, cols: int = 40, resolution: float = 0.1) -> TruthRecord:
    solid = np.zeros((rows, cols), dtype=bool)
    solid[0] = solid[-1] = True
    solid[:, 0] = solid[:, -1] = True
    starts = {"ada": np.array([0.6, 0.6, 0.0]), "bob": np.array([0.6, 1.5, 0.0])}
    return TruthRecord(GridGeometry(resolution, 0.0, 0.0, rows, cols), solid, starts)


def map_of(truth: TruthRecord, T_world_map: Pose2 = T_WORLD_MAP) -> OccupancyGrid:
    """Return a perfect map of `truth` in the map frame, on a finer lattice."""
    geometry = GridGeometry(0.05, -1.0, -1.0, 100, 120)
    centres = geometry.centres_of(np.argwhere(np.ones(geometry.shape, dtype=bool)))
    cells = truth.geometry.cells_at(T_world_map.apply(centres))
    inside = truth.geometry.contains(cells)
    log_odds = np.zeros(len(cells), dtype=np.float32)
    solid = truth.solid[cells[inside, 0], cells[inside, 1]]
    log_odds[inside] = np.where(solid, 3.0, -3.0)
    return OccupancyGrid(geometry, log_odds.reshape(geometry.shape))


def track(points: list[tuple[float, float]], seconds: float = 2.0) -> np.ndarray:
    """Return a track (n, 4) through world points, one every `seconds`."""
    rows = [(seconds * i, x, y, 0.3 * i) for i, (x, y) in enumerate(points)]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def in_map(track_world: np.ndarray) -> np.ndarray:
    """Return a world track as a perfect estimator would have it in the map frame."""
    estimate = track_world.copy()
    estimate[:, 1:3] = T_WORLD_MAP.inverse().apply(track_world[:, 1:3])
    estimate[:, 3] -= T_WORLD_MAP.theta
    return estimate


def task(t: float, event: str, robot: str, number: int, **more: object) -> dict:
    return {"t_s": t, "event": event, "robot": robot, "task": number, **more}


def full_record() -> RunRecord:
    """Return a run in which everything is there."""
    truth = walled_room()
    ada = track([(0.6, 0.6), (1.6, 0.6), (2.6, 0.6), (3.2, 1.4)])
    bob = track([(0.6, 1.5), (0.6, 2.2), (1.6, 2.2), (2.4, 2.2)])
    graph = PoseGraphRecord(
        {"bob": in_map(bob)[:, 1:], "ada": ada[:, 1:]},
        np.array([(0, 0, 0, 1), (1, 0, 1, 1), (0, 3, 1, 3)]),
        np.array([(1.0, 0.0, 0.3), (0.7, 0.1, 0.3), (0.1, 0.2, 0.3)]),
        np.array([np.diag([1e4, 1e4, 1e5]), np.diag([1e4, 1e4, 1e5]), np.diag([1e2, 0.0, 1e3])]),
    )
    return RunRecord(
        team="auction",
        world="room",
        strategy="auction",
        estimator="incremental",
        seed=3,
        version="0.1.0",
        ended="explored",
        reason="nothing left to gain.",
        sim_time_s=8.0,
        wall_time_s=0.5,
        grid=map_of(truth),
        map_digest="abc",
        robots=[
            RobotRecord("bob", "finished", 0.2, in_map(bob), bob, 12, None, 10, 20, "abc"),
            RobotRecord(
                "ada",
                "lost",
                0.2,
                in_map(ada),
                ada,
                10,
                4.5,
                30,
                40,
                "abc",
                [{"t_s": 0.5, "event": "ready"}],
            ),
        ],
        coverage_timeline=np.array([[0.0, 0.1], [2.0, 0.5], [4.0, 0.9], [6.0, 0.9995], [8.0, 1.0]]),
        single_clear={"ada": 60, "bob": 70},
        union_clear=100,
        tasks=[
            task(0.0, "awarded", "ada", 1, kind="explore", goal=[1.0, 1.0], reason=""),
            task(3.0, "failed", "ada", 1, reason="stuck <here>"),
            task(0.0, "awarded", "bob", 2, kind="visit", goal=[2.0, 1.0]),
            task(4.0, "terminated", "bob", 2, reason=""),
            task(5.0, "awarded", "bob", 3, kind="juggle"),
            {"t_s": 6.0, "event": "lost", "robot": "ada", "task": None},
        ],
        events=[{"t_s": 0.0, "event": "started"}],
        faults=[{"t_s": 3.0, "robot": "ada", "kind": "freeze"}, {"kind": "cut_link"}],
        bytes={"scan_report": {"count": 3, "bytes": 3000}, "bid": {"count": 1, "bytes": 80}},
        bytes_links={"ada>server": {"count": 4, "bytes": 3080}},
        remaining=[
            {"x_m": 2.0, "y_m": 1.0, "gain_m2": 0.2, "reason": "too narrow"},
            {"reason": "unknown region"},
        ],
        pose_graph=graph,
        truth=truth,
        config={"world": {"name": "room", "limit": None}, "list": [1, None, 2]},
    )


def nasty_records() -> dict[str, RunRecord]:
    """Return runs of which a lot is missing or odd."""
    no_truth = full_record()
    no_truth.truth = None
    for robot in no_truth.robots:
        robot.track_world = None
    no_map = full_record()
    no_map.grid = None
    zero_map = full_record()
    zero_map.grid = OccupancyGrid.unknown(GridGeometry(0.05, 0.0, 0.0, 0, 0))
    unknown_map = full_record()
    unknown_map.grid = OccupancyGrid.unknown(GridGeometry(0.05, 0.0, 0.0, 4, 6))
    no_robots = full_record()
    no_robots.robots = []
    empty_tracks = full_record()
    for robot in empty_tracks.robots:
        robot.track_map = np.empty((0, 4))
        robot.track_world = np.empty((0, 4))
    stray = full_record()
    stray.robots[0].track_map = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 9.0e4, 0.0, 0.0]])
    stray.robots[0].id = "../../<b>bob</b>"
    not_finite = full_record()
    not_finite.robots[0].track_map = np.array([[0.0, np.nan, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    not_finite.sim_time_s = float("nan")
    not_finite.coverage_timeline = np.array([[0.0, 0.0], [np.nan, np.nan]])
    zero_truth = full_record()
    zero_truth.truth = TruthRecord(GridGeometry(0.1, 0, 0, 0, 0), np.zeros((0, 0), dtype=bool))
    steps = full_record()
    steps.time_unit = "steps"
    many = full_record()
    many.robots = [
        RobotRecord(f"robot-{i:02d}", track_map=track([(i, 0.0), (i, 1.0)])) for i in range(20)
    ]
    many.remaining = [{"x_m": 0.1 * i, "y_m": 1.0, "reason": "late"} for i in range(60)]
    return {
        "nothing": RunRecord(),
        "no truth": no_truth,
        "no map": no_map,
        "zero-size map": zero_map,
        "unknown map": unknown_map,
        "no robots": no_robots,
        "empty tracks": empty_tracks,
        "stray": stray,
        "not finite": not_finite,
        "zero-size truth": zero_truth,
        "steps": steps,
        "many": many,
    }
