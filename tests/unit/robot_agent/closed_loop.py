"""A small world to close the loop: disc robots among solid cells, with a lidar and a noisy pose."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

import numba
import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2, wrap_angle
from mapping.grid import GridGeometry
from protocol.body import Body
from protocol.map_cells import pack_cells
from protocol.messages import MapSnapshot
from robot_agent.navigation import NavigationStep, Navigator
from robot_agent.navigation_settings import NavigationSettings
from robot_agent.planning_map import PlanningMap
from robot_agent.right_of_way import Teammate

STEP = 0.1
# Plain Python casts rays slowly; every fourth beam will do there.
COMPILED = not numba.config.DISABLE_JIT
BEAMS = 180 if COMPILED else 45
RANGE = 8.0
RADIUS = 0.25


@dataclass
class Grid:
    """Solid cells, (rows, cols) bool, corner at (0, 0)."""

    solid: npt.NDArray[np.bool_]
    resolution: float

    @property
    def geometry(self) -> GridGeometry:
        return GridGeometry(self.resolution, 0.0, 0.0, *self.solid.shape)

    def fill(self, x0: float, y0: float, x1: float, y1: float, solid: bool = True) -> Grid:
        """Set a rectangle [m]."""
        a, b = round(y0 / self.resolution), round(y1 / self.resolution)
        c, d = round(x0 / self.resolution), round(x1 / self.resolution)
        self.solid[a:b, c:d] = solid
        return self

    @classmethod
    def walled(cls, width: float, height: float, resolution: float = 0.05) -> Grid:
        """Return an empty hall [m] with walls of 0.2 m."""
        grid = cls(
            np.ones((round(height / resolution), round(width / resolution)), bool), resolution
        )
        return grid.fill(0.2, 0.2, width - 0.2, height - 0.2, solid=False)


def snapshot_of(grid: Grid, number: int = 1) -> MapSnapshot:
    """Return the map message of a grid that is known perfectly."""
    log_odds = np.where(grid.solid, 3.0, -3.0).astype(np.float32)
    rows, cols = grid.solid.shape
    return MapSnapshot(
        number=number,
        resolution_m=grid.resolution,
        origin_x_m=0.0,
        origin_y_m=0.0,
        rows=rows,
        cols=cols,
        cells=pack_cells(log_odds),
    )


def planning_map_of(grid: Grid, settings: NavigationSettings | None = None) -> PlanningMap:
    """Return the planning map of a grid that is known perfectly."""
    settings = settings or NavigationSettings()
    planning_map = PlanningMap(RADIUS, settings.planning_map)
    planning_map.apply_snapshot(snapshot_of(grid))
    return planning_map


@compiled
def cast(
    solid: npt.NDArray[np.bool_],
    resolution: float,
    discs: Floats,
    x: float,
    y: float,
    bearings: Floats,
    reach: float,
) -> Floats:
    """Return the ranges [m] by stepping a third of a cell; `discs` (n, 3) are x, y, radius."""
    rows, cols = solid.shape
    ranges = np.full(len(bearings), reach)
    for k in range(len(bearings)):
        c, s = math.cos(bearings[k]), math.sin(bearings[k])
        limit = reach
        for m in range(len(discs)):
            dx, dy = discs[m, 0] - x, discs[m, 1] - y
            along = dx * c + dy * s
            off2 = dx * dx + dy * dy - along * along
            if along > 0.0 and off2 < discs[m, 2] ** 2:
                limit = min(limit, along - math.sqrt(discs[m, 2] ** 2 - off2))
        length = 0.0
        while length < limit:
            iy = math.floor((y + s * length) / resolution)
            ix = math.floor((x + c * length) / resolution)
            if iy < 0 or ix < 0 or iy >= rows or ix >= cols or solid[iy, ix]:
                break
            length += resolution / 3.0
        ranges[k] = min(length, limit)
    return ranges


@compiled
def touches(solid: npt.NDArray[np.bool_], resolution: float, x: float, y: float, r: float) -> bool:
    """Whether a disc overlaps a solid cell."""
    rows, cols = solid.shape
    for iy in range(math.floor((y - r) / resolution), math.floor((y + r) / resolution) + 1):
        for ix in range(math.floor((x - r) / resolution), math.floor((x + r) / resolution) + 1):
            dx = max(ix * resolution - x, 0.0, x - (ix + 1) * resolution)
            dy = max(iy * resolution - y, 0.0, y - (iy + 1) * resolution)
            outside = iy < 0 or ix < 0 or iy >= rows or ix >= cols
            if dx * dx + dy * dy < r * r and (outside or solid[iy, ix]):
                return True
    return False


@dataclass
class Robot:
    """One robot: its true state, what it believes, and what became of it."""

    name: str
    T_world_base: Pose2
    planning_map: PlanningMap
    settings: NavigationSettings = field(default_factory=NavigationSettings)
    frozen: bool = False
    speed: float = 0.0
    turn_rate: float = 0.0
    bumped: bool = False
    collisions: int = 0
    driven: float = 0.0
    busy: bool = False
    statuses: list[str] = field(default_factory=list)
    track: list[tuple[float, float, float]] = field(default_factory=list)
    last: NavigationStep | None = None
    tight_map: tuple[float, float] | None = None
    scan: Floats = field(default_factory=lambda: np.empty((0, 2)))
    error: Floats = field(default_factory=lambda: np.zeros(3))
    announced: Teammate | None = None
    step_times: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.navigator = Navigator(Body(), self.settings, self.name)

    def send(self, x: float, y: float, tolerance: float = 0.3) -> None:
        """Give it a goal [m]."""
        self.busy = True
        self.navigator.set_goal((x, y), tolerance)


class World:
    """Moves robots; everything random comes from one generator."""

    def __init__(self, grid: Grid, seed: int = 0, heartbeat: float = 0.3) -> None:
        self.grid = grid
        self.rng = np.random.default_rng(seed)
        self.robots: list[Robot] = []
        self.now = 0.0
        self.heartbeat = heartbeat
        self.ticks = 0
        self.least_apart = math.inf

    def add(self, name: str, x: float, y: float, theta: float, planning_map: PlanningMap) -> Robot:
        robot = Robot(name, Pose2(x, y, theta), planning_map)
        self.robots.append(robot)
        return robot

    def tick(self) -> None:
        """One step of all robots."""
        self.ticks += 1
        self.now = self.ticks * STEP
        beat = max(round(self.heartbeat / STEP), 1)
        for k, robot in enumerate(self.robots):
            if not robot.frozen:
                self._sense(robot)
                self._decide(robot)
            if (self.ticks + k) % beat == 0 and not robot.frozen:
                self._announce(robot)
        for _ in range(2):
            for robot in self.robots:
                self._move(robot, 0.5 * STEP)

    def _sense(self, robot: Robot) -> None:
        robot.error = 0.95 * robot.error + math.sqrt(1 - 0.95**2) * self.rng.normal(
            0.0, (0.03, 0.03, 0.01)
        )
        if self.ticks % 2 == 0:
            T = robot.T_world_base
            bearings = np.linspace(-0.5 * math.pi, 0.5 * math.pi, BEAMS)
            discs = np.array(
                [
                    (o.T_world_base.x, o.T_world_base.y, RADIUS)
                    for o in self.robots
                    if o is not robot
                ]
            ).reshape(-1, 3)
            ranges = cast(
                self.grid.solid, self.grid.resolution, discs, T.x, T.y, bearings + T.theta, RANGE
            )
            hit = ranges < RANGE
            ranges = ranges + self.rng.normal(0.0, 0.03, BEAMS)
            points = np.column_stack((ranges * np.cos(bearings), ranges * np.sin(bearings)))
            robot.scan = points[hit]

    def believed(self, robot: Robot) -> Pose2:
        T = robot.T_world_base
        return Pose2(
            T.x + robot.error[0], T.y + robot.error[1], wrap_angle(T.theta + robot.error[2])
        )

    def _decide(self, robot: Robot) -> None:
        mates = [o.announced for o in self.robots if o is not robot and o.announced is not None]
        begin = time.perf_counter()
        step = robot.navigator.step(
            self.now, self.believed(robot), robot.scan, mates, robot.bumped, robot.planning_map
        )
        robot.step_times.append(time.perf_counter() - begin)
        robot.last = step
        robot.statuses.append(step.status)
        robot.tight_map = step.tight_map or robot.tight_map
        if step.status in ("arrived", "unreachable", "stuck"):
            robot.busy = False

    def _announce(self, robot: Robot) -> None:
        if robot.last is None:
            return
        robot.announced = Teammate(
            robot.name,
            self.believed(robot),
            self.now,
            RADIUS,
            robot.last.path_map.astype(np.float32).astype(np.float64),
            robot.busy,
        )

    def _move(self, robot: Robot, dt: float) -> None:
        want = robot.last
        v, w = (want.speed, want.turn_rate) if want is not None and not robot.frozen else (0, 0)
        v, w = min(max(v, -0.5), 0.5), min(max(w, -1.2), 1.2)
        robot.speed += min(max(v - robot.speed, -1.0 * dt), 1.0 * dt)
        robot.turn_rate += min(max(w - robot.turn_rate, -4.0 * dt), 4.0 * dt)
        T = robot.T_world_base
        middle = T.theta + 0.5 * dt * robot.turn_rate
        x = T.x + dt * robot.speed * math.cos(middle)
        y = T.y + dt * robot.speed * math.sin(middle)
        theta = wrap_angle(T.theta + dt * robot.turn_rate)
        hit = touches(self.grid.solid, self.grid.resolution, x, y, RADIUS)
        for other in self.robots:
            if other is not robot:
                o = other.T_world_base
                apart = math.hypot(o.x - x, o.y - y)
                self.least_apart = min(self.least_apart, apart)
                if apart < 2 * RADIUS and apart < math.hypot(o.x - T.x, o.y - T.y):
                    hit = True
        if hit:
            robot.collisions += not robot.bumped
            robot.T_world_base, robot.speed = Pose2(T.x, T.y, theta), 0.0
        else:
            robot.T_world_base = Pose2(x, y, theta)
            robot.driven += dt * abs(robot.speed)
        robot.bumped = hit
        robot.track.append((x, y, theta))

    def run(self, most: float) -> float:
        """Run until every robot that was sent somewhere is through; return the time it took [s]."""
        begin = self.now
        while self.now - begin < most and any(r.busy for r in self.robots):
            self.tick()
        return self.now - begin

    @property
    def collisions(self) -> int:
        return sum(robot.collisions for robot in self.robots)
