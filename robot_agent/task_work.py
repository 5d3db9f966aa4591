"""The task in hand: from award to its end, with news for the server."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mapping.frontiers import find_frontiers
from mapping.geometry import Floats, Pose2
from protocol.body import Body
from protocol.messages import Award, Message, TaskEnd, TaskProgress, TightPlace
from robot_agent.navigation import Navigator
from robot_agent.planning_map import PlanningMap
from robot_agent.right_of_way import Teammate
from robot_agent.settings import TaskSettings

_EPSILON = 1e-9
_NO_PATH = np.zeros((0, 2))
_VIEW_MARGIN = 0.35  # [rad]; what lies nearer to the edge of the field of view is turned to


@dataclass(frozen=True, slots=True)
class WorkStep:
    """What the task in hand wants: motion, the path to announce, and news for the server."""

    speed: float
    turn_rate: float
    path_map: Floats
    news: list[Message] = field(default_factory=list)


class TaskWork:
    """Works on one task at a time; an award replaces what was in hand.

    Args:
        navigator: drives to places.
        body: its limits.
        settings: when a place counts as reached, how often progress is told.
    """

    def __init__(self, navigator: Navigator, body: Body, settings: TaskSettings) -> None:
        self._navigator = navigator
        self._drive = body.drive
        self._half_view = math.radians(0.5 * body.lidar.field_of_view_deg)
        self._looking = False
        self._looked_at = -1
        self._frontier: tuple[float, float] | None = None
        self._settings = settings
        self._award: Award | None = None
        self._awarded = -math.inf
        self._next_progress = 0.0
        self._ended: set[int] = set()

    @property
    def wants_bids(self) -> bool:
        """Whether the robot is free for, or at work on, exploration."""
        return self._award is None or self._award.kind in ("explore", "wait")

    @property
    def idle(self) -> bool:
        """Whether the robot has nothing to do, or only waits."""
        return self._award is None or self._award.kind == "wait"

    def award(self, award: Award, now: float) -> list[Message]:
        """Take a task; one that was ended already is told again, one in hand goes on."""
        if award.task in self._ended:
            return [TaskEnd(task=award.task, outcome="done", reason="ended before")]
        current = self._award
        if current is not None and award.task < current.task:
            return []  # a late copy of an older award
        self._award, self._awarded = award, now
        self._looking = self._looking and current is not None and current.task == award.task
        self._looked_at = -1
        if current is not None and current.task == award.task:
            return []
        self._next_progress = now
        if award.kind in ("drive", "pause"):
            self._navigator.clear()
            return []
        near = self._settings.arrive_visit_m
        if award.kind != "visit":
            near = self._settings.arrive_explore_m
        self._navigator.set_goal(award.goal_map, near, busy=award.kind != "wait")
        return []

    def terminate(self, task: int) -> None:
        """The server takes a task back."""
        if self._award is not None and self._award.task == task:
            self.halt()

    def halt(self) -> None:
        """Put the task in hand down."""
        if self._award is not None:
            self._ended.add(self._award.task)
        self._award = None
        self._looking = False
        self._navigator.clear()

    def step(
        self,
        now: float,
        T_map_base: Pose2,
        points_base: Floats,
        teammates: Sequence[Teammate],
        bumped: bool,
        planning_map: PlanningMap,
    ) -> WorkStep:
        """Work for one control period.

        Args:
            now: mission time [s].
            T_map_base: where the robot is, map frame.
            points_base: (n, 2) [m] end points of the last scan, base frame.
            teammates: the others.
            bumped: whether the body touches something.
            planning_map: the team's map.
        """
        award = self._award
        if award is not None and award.kind == "drive":
            return self._by_hand(award, now)
        if award is not None and award.kind == "explore":
            if self._explored(award, planning_map):
                return WorkStep(0.0, 0.0, _NO_PATH, self._end(award, "done", "seen already"))
            if self._looking:
                return self._look(award, T_map_base)
        step = self._navigator.step(now, T_map_base, points_base, teammates, bumped, planning_map)
        if award is not None and award.kind == "explore" and step.status == "arrived":
            self._looking = True
            return self._look(award, T_map_base)
        news: list[Message] = []
        if award is not None:
            news = self._news(award, step.status, step.remaining_m, now)
        if step.tight_map is not None:
            news.append(TightPlace(place_map=step.tight_map))
        return WorkStep(step.speed, step.turn_rate, np.asarray(step.path_map), news)

    def _look(self, award: Award, T_map_base: Pose2) -> WorkStep:
        """Turn at a frontier until the lidar faces it, then the task is done."""
        bearing = 0.0
        if self._frontier is not None:
            ahead = T_map_base.inverse().apply(self._frontier)
            bearing = math.atan2(float(ahead[1]), float(ahead[0]))
        if abs(bearing) < self._half_view - _VIEW_MARGIN:
            return WorkStep(0.0, 0.0, _NO_PATH, self._end(award, "done", ""))
        rate = math.copysign(self._drive.turn_rate_max_rad_s, bearing)
        return WorkStep(0.0, rate, _NO_PATH, [])

    def _explored(self, award: Award, planning_map: PlanningMap) -> bool:
        """Whether the map shows no frontier at the goal any more; looks only when it changed."""
        if planning_map.number != self._looked_at:
            self._looked_at = planning_map.number
            settings = self._settings
            self._frontier = frontier_near(
                planning_map, award.goal_map, settings.look_radius_m, settings.look_cells_min
            )
        return self._frontier is None

    def _by_hand(self, award: Award, now: float) -> WorkStep:
        """An operator drives; without fresh words the robot halts."""
        fresh = now - self._awarded <= self._settings.drive_timeout_s
        limits = self._drive
        speed = _clipped(award.speed_m_s, limits.speed_max_m_s) if fresh else 0.0
        turn_rate = _clipped(award.turn_rate_rad_s, limits.turn_rate_max_rad_s) if fresh else 0.0
        return WorkStep(speed, turn_rate, _NO_PATH, self._progress(award, 0.0, now))

    def _news(self, award: Award, status: str, remaining: float, now: float) -> list[Message]:
        """Return what the server should know about the task now."""
        if award.kind in ("explore", "visit", "wait") and status == "arrived":
            return self._end(award, "done", "")
        if status == "unreachable":
            return self._end(award, "unreachable", "no way for this body")
        if status == "stuck":
            return self._end(award, "failed", "stuck")
        return self._progress(award, remaining, now)

    def _end(self, award: Award, outcome: str, reason: str) -> list[Message]:
        """End the task in hand."""
        self.halt()
        return [TaskEnd.model_validate({"task": award.task, "outcome": outcome, "reason": reason})]

    def _progress(self, award: Award, remaining: float, now: float) -> list[Message]:
        """Tell now and then that the robot is at work."""
        if now < self._next_progress - _EPSILON:
            return []
        self._next_progress = now + self._settings.progress_period_s
        return [TaskProgress(task=award.task, remaining_m=max(remaining, 0.0))]


def frontier_near(
    planning_map: PlanningMap, place: tuple[float, float], radius: float, cells_min: int
) -> tuple[float, float] | None:
    """Return the middle (x, y) [m] of what is left of the frontier around a place, map frame.

    Args:
        planning_map: the team's map.
        place: (x, y) [m], map frame.
        radius: how far around it to look [m].
        cells_min: fewer frontier cells in a row are noise.

    Returns:
        None if the map shows no frontier there (any more).
    """
    geometry = planning_map.geometry
    x, y = place
    box = geometry.box_around(x - radius, y - radius, x + radius, y + radius)
    if box.empty:
        return None
    found = find_frontiers(planning_map.classes, 1, cells_min, box)
    points = geometry.centres_of(found.cells)
    near = np.hypot(points[:, 0] - x, points[:, 1] - y) <= radius
    if not near.any():
        return None
    middle = points[near].mean(axis=0)
    return float(middle[0]), float(middle[1])


def _clipped(value: float, limit: float) -> float:
    """Return `value` within +-`limit`."""
    return max(-limit, min(limit, value))
