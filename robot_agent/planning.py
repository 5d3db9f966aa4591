"""When to plan anew, and the plan in force."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Floats, Pose2
from robot_agent.navigation_settings import NavigationSettings
from robot_agent.obstacle_memory import ObstacleMemory, unmapped_points
from robot_agent.path_following import DrivenPath
from robot_agent.planning_map import PlanningMap
from robot_agent.right_of_way import Sighting
from robot_agent.route_choice import Choice, RouteChoice, Situation
from robot_agent.route_planning import Discs
from robot_agent.sightings import STANDS_WITHIN

# Plans that were asked for by events (a blocked path, a lost path) are this far apart [s].
_PLAN_PAUSE = 0.5
# Something in the way for this long asks for a new plan, if the last one is older than that [s].
_BLOCKED_LASTS = 0.5
_BLOCKED_PAUSE = 1.0
# The path is looked over this far ahead for cells that have become blocked [m].
_LOOK_OVER = 3.0
# A robot that made way goes on when its way has been free for this long [s].
_FREE_LASTS = 0.7


@dataclass(frozen=True, slots=True)
class Goal:
    """Where to drive.

    Attributes:
        place_map: (x, y) [m].
        tolerance: how near the robot has to get [m].
        busy: whether it drives for a task.
    """

    place_map: tuple[float, float]
    tolerance: float
    busy: bool


@dataclass(frozen=True, slots=True)
class Scene:
    """What one step knows: see `robot_agent.navigation.Navigator.step`."""

    now: float
    T_map_base: Pose2
    points_base: Floats
    others: Sequence[Sighting]
    bumped: bool
    planning_map: PlanningMap


class Planning:
    """Keeps the plan of one robot up to date.

    Attributes:
        plan: the plan in force, None without any.
    """

    def __init__(self, body_radius: float, settings: NavigationSettings, name: str) -> None:
        """Plan for the robot `name` of this radius [m]."""
        self._radius = body_radius
        self._settings = settings
        self._choice = RouteChoice(name, body_radius, settings.right_of_way)
        self._memory = ObstacleMemory(body_radius, settings.recovery.block_for_s)
        self._stood_at = (math.inf, math.inf, 0.0)
        self.plan: Choice | None = None
        self.forget()

    @property
    def path(self) -> DrivenPath | None:
        """The path of the plan, if there is one."""
        return self.plan.route.path if self.plan is not None and self.plan.route else None

    @property
    def giving_way(self) -> bool:
        """Whether the plan is to make way for a teammate."""
        return self.plan is not None and self.plan.giving_way

    @property
    def left(self) -> float:
        """How much of the path is to be driven for now [m]."""
        if self.plan is None or self.path is None:
            return 0.0
        return max(min(self.path.remaining, self.plan.stop_at - self.path.at), 0.0)

    def forget(self) -> None:
        """Drop the plan; obstacles are remembered."""
        self.plan = None
        self._planned_at = -math.inf
        self._assess_at = -math.inf
        self._free_since: float | None = None
        self._unreachable_since: float | None = None

    def avoid(self, now: float, discs: Discs) -> None:
        """Keep out of a place for a while, and plan anew."""
        self._memory.add(now, discs)
        self.plan = None

    def unreachable(self, now: float) -> bool:
        """Whether no way to the goal has been found for long enough."""
        patience = self._settings.driving.unreachable_after_s
        return self._unreachable_since is not None and now - self._unreachable_since >= patience

    def update(self, scene: Scene, goal: Goal | None, blocked_for: float) -> bool:
        """Plan anew if it is time to; return whether that was done.

        Args:
            scene: what this step knows.
            goal: where to drive, None to stay.
            blocked_for: for how long something other than a teammate has been in the way [s].
        """
        self._follow(scene)
        if not self._due(scene, goal, blocked_for):
            return False
        self._renew(scene, goal)
        return True

    def _follow(self, scene: Scene) -> None:
        """Keep where on the path the robot is, and since when it has not moved."""
        here = scene.T_map_base
        if self.path is not None:
            self.path.advance(here.x, here.y)
        if math.hypot(here.x - self._stood_at[0], here.y - self._stood_at[1]) > STANDS_WITHIN:
            self._stood_at = (here.x, here.y, scene.now)

    def _due(self, scene: Scene, goal: Goal | None, blocked_for: float) -> bool:
        """Whether it is time for a new plan."""
        if self.plan is None:
            return goal is not None or self._asked_to_move(scene, goal)
        age = scene.now - self._planned_at
        period = self._settings.driving.replan_period_s
        if self.plan.giving_way:
            period = self._settings.right_of_way.assess_period_s
        if age >= period or self._asked_to_move(scene, goal):
            return True
        if blocked_for > _BLOCKED_LASTS and age > _BLOCKED_PAUSE:
            return True
        return age >= _PLAN_PAUSE and self._lost_path(scene)

    def _asked_to_move(self, scene: Scene, goal: Goal | None) -> bool:
        """Whether a teammate comes that this robot has to make way for and does not yet."""
        if scene.now < self._assess_at or self.giving_way:
            return False
        self._assess_at = scene.now + self._settings.right_of_way.assess_period_s
        if all(other.stays for other in scene.others):
            return False
        path = np.array([[scene.T_map_base.x, scene.T_map_base.y]])
        if self.path is not None:
            path = self.path.ahead(self._settings.right_of_way.horizon_m)
        return bool(self._choice.rivals(scene.now, self._situation(scene, goal, ()), path))

    def _lost_path(self, scene: Scene) -> bool:
        """Whether the robot is off its path or the map has changed on it."""
        path, geometry = self.path, scene.planning_map.geometry
        if path is None:
            return False
        if path.off > self._settings.driving.off_path_m:
            return True
        blocked_in = path.first_blocked(
            scene.planning_map.weights,
            geometry.origin_x,
            geometry.origin_y,
            geometry.resolution,
            _LOOK_OVER,
        )
        # The first steps may lead out of a place that is blocked: that is known.
        return self._radius < blocked_in < math.inf

    def _situation(self, scene: Scene, goal: Goal | None, spots: Sequence[Discs]) -> Situation:
        """Return what a choice of route is made from."""
        return Situation(
            (scene.T_map_base.x, scene.T_map_base.y),
            goal.place_map if goal is not None else None,
            goal.tolerance if goal is not None else 0.0,
            goal is not None and goal.busy,
            self._stood_at[2],
            spots,
            scene.others,
        )

    def _renew(self, scene: Scene, goal: Goal | None) -> None:
        """Choose a route anew."""
        now = scene.now
        seen = unmapped_points(
            scene.planning_map, scene.T_map_base, scene.points_base, scene.others
        )
        spots = self._memory.keep_out(now, seen, self.path)
        choice = self._choice.choose(now, self._situation(scene, goal, spots), scene.planning_map)
        self._planned_at = now
        if self.giving_way and not choice.giving_way:
            self._free_since = now if self._free_since is None else self._free_since
            if now - self._free_since < _FREE_LASTS:
                return
        self._free_since = None
        self.plan = choice
        if choice.reachable:
            self._unreachable_since = None
        elif self._unreachable_since is None:
            self._unreachable_since = now
