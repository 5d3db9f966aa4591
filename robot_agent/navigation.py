"""Driving to a goal: plan on the team's map, follow the path, give way, get loose, give up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapping.geometry import IDENTITY, Floats, Pose2
from protocol.body import Body
from robot_agent.avoidance import free_backwards
from robot_agent.navigation_settings import NavigationSettings
from robot_agent.planning_map import PlanningMap
from robot_agent.recovery import Recovery, StallWatch
from robot_agent.right_of_way import Sighting, Teammate
from robot_agent.route_choice import Choice, RouteChoice, Situation
from robot_agent.route_planning import Discs, unmapped_points
from robot_agent.sightings import STANDS_WITHIN, TeammateTracks
from robot_agent.steering import Steering

Status = Literal["idle", "driving", "arrived", "unreachable", "stuck", "giving_way"]

_NO_PATH: Floats = np.empty((0, 2))
_NO_PATH.flags.writeable = False

# Plans that were asked for by events (a blocked path, a lost path) are this far apart [s].
_PLAN_PAUSE = 0.5
# Something in the way for this long asks for a new plan [s].
_BLOCKED_LASTS = 0.5
# The path is looked over this far ahead for cells that have become blocked [m].
_LOOK_OVER = 3.0
# A robot that made way goes on when its way has been free for this long [s].
_FREE_LASTS = 0.7
# Points of an announced path are this far apart: it goes over the radio again and again [m].
_ANNOUNCED_SPACING = 0.3
# The end of a path is reached when so little is left of it [m].
_PATH_END = 0.08


@dataclass(frozen=True, slots=True)
class NavigationStep:
    """What to do until the next step.

    Attributes:
        speed: [m/s].
        turn_rate: [rad/s].
        status: `arrived`, `unreachable` and `stuck` are said once; then the goal is forgotten.
        path_map: (n, 2) [m], what the robot is about to drive; empty if it means to stay.
        remaining_m: what is left of the path to the goal [m]; 0 without a goal.
        reason: why, for `unreachable` and `stuck`.
    """

    speed: float
    turn_rate: float
    status: Status
    path_map: Floats
    remaining_m: float
    reason: str = ""


@dataclass(frozen=True, slots=True)
class _Scene:
    """What one step knows: see `Navigator.step`."""

    now: float
    T_map_base: Pose2
    points_base: Floats
    others: Sequence[Sighting]
    bumped: bool
    planning_map: PlanningMap


@dataclass(frozen=True, slots=True)
class _Spot:
    """A place where the robot got stuck, kept out of until a time [s]."""

    discs: Discs
    until: float


class Navigator:
    """Takes one robot to its goals and keeps it out of everybody's way."""

    def __init__(self, body: Body, settings: NavigationSettings, name: str) -> None:
        """Navigate for the robot `name` with this body."""
        self._body = body
        self._settings = settings
        self._tracks = TeammateTracks(settings.right_of_way.silent_after_s)
        self._choice = RouteChoice(name, body.radius_m, settings.right_of_way)
        self._steering = Steering(body, settings.driving, settings.right_of_way)
        self._watch = StallWatch(settings.recovery)
        self._stood_at = (math.inf, math.inf, 0.0)
        self._spots: list[_Spot] = []
        self._scan_points: Floats = _NO_PATH
        self._T_map_scan = IDENTITY
        self.clear()

    @property
    def goal_map(self) -> tuple[float, float] | None:
        """The goal (x, y) [m] in the map frame, None without one."""
        return self._goal

    def set_goal(self, goal_map: tuple[float, float], tolerance: float, busy: bool = True) -> None:
        """Drive to a place.

        Args:
            goal_map: (x, y) [m].
            tolerance: how near the robot has to get [m].
            busy: whether it drives for a task, and so goes before robots that do not.
        """
        self.clear()
        self._goal = (float(goal_map[0]), float(goal_map[1]))
        self._tolerance = tolerance
        self._busy = busy
        self._fresh = True

    def clear(self) -> None:
        """Forget the goal and stay, but still make way for others."""
        self._goal: tuple[float, float] | None = None
        self._tolerance = 0.0
        self._busy = False
        self._fresh = False
        self._plan: Choice | None = None
        self._planned_at = -math.inf
        self._assess_at = -math.inf
        self._free_since: float | None = None
        self._unreachable_since: float | None = None
        self._blocked_since: float | None = None
        self._held_since: float | None = None
        self._recovery: Recovery | None = None
        self._steering.halt()

    def step(
        self,
        now: float,
        T_map_base: Pose2,
        points_base: Floats,
        teammates: Sequence[Teammate],
        bumped: bool,
        planning_map: PlanningMap,
    ) -> NavigationStep:
        """Return what to do until the next step.

        Args:
            now: mission time [s].
            T_map_base: where the robot is.
            points_base: (n, 2) [m], end points of the last scan's beams in their order, in the
                base frame. They are taken as of the step in which this very array came first, and
                carried along from then on as the robot moves.
            teammates: what the others announced last.
            bumped: whether the body touches something.
            planning_map: the robot's copy of the team's map.
        """
        others = self._tracks.sightings(now, teammates)
        points = self._carried_along(T_map_base, points_base)
        scene = _Scene(now, T_map_base, points, others, bumped, planning_map)
        if self._fresh:
            self._fresh = False
            self._watch.start(now)
        self._note_standing(scene)
        if self._recovery is not None:
            command = self._recovery.step(
                now, T_map_base, self._settings.recovery, self._body.drive.turn_rate_max_rad_s
            )
            if command is not None:
                return self._report("driving", *command)
            self._recovery = None
            self._plan = None
        if self._plan is not None and self._plan.route is not None:
            self._plan.route.path.advance(T_map_base.x, T_map_base.y)
        if self._arrived(T_map_base):
            self.clear()
            return self._report("arrived")
        if self._wants_plan(scene):
            self._replan(scene)
        return self._drive(scene)

    def _carried_along(self, T_map_base: Pose2, points_base: Floats) -> Floats:
        """Return the scan's points (n, 2) [m] in the base frame of now."""
        if points_base is not self._scan_points:
            self._scan_points, self._T_map_scan = points_base, T_map_base
            return points_base
        return (T_map_base.inverse() @ self._T_map_scan).apply(points_base)

    def _note_standing(self, scene: _Scene) -> None:
        """Keep since when the robot has not moved."""
        x, y, _ = self._stood_at
        here = scene.T_map_base
        if math.hypot(here.x - x, here.y - y) > STANDS_WITHIN:
            self._stood_at = (here.x, here.y, scene.now)

    def _arrived(self, T_map_base: Pose2) -> bool:
        """Whether the goal is reached: near enough, and not just on the other side of a wall."""
        plan = self._plan
        if self._goal is None or plan is None or plan.route is None or plan.giving_way:
            return False
        path = plan.route.path
        away = math.hypot(self._goal[0] - T_map_base.x, self._goal[1] - T_map_base.y)
        if path.remaining <= _PATH_END and path.off < self._settings.driving.off_path_m:
            return True
        return away <= self._tolerance and path.remaining <= 1.5 * self._tolerance

    def _wants_plan(self, scene: _Scene) -> bool:
        """Whether it is time for a new plan."""
        now, plan = scene.now, self._plan
        if plan is None:
            return self._goal is not None or self._asked_to_move(scene)
        age = now - self._planned_at
        period = self._settings.right_of_way.assess_period_s
        if age >= self._settings.driving.replan_period_s or (plan.giving_way and age >= period):
            return True
        if self._asked_to_move(scene):
            return True
        if age < _PLAN_PAUSE:
            return False
        if self._blocked_since is not None and now - self._blocked_since > _BLOCKED_LASTS:
            return age > 2.0 * _PLAN_PAUSE
        return self._lost_path(scene, plan)

    def _asked_to_move(self, scene: _Scene) -> bool:
        """Whether a teammate comes that this robot has to make way for and does not yet."""
        if scene.now < self._assess_at or (self._plan is not None and self._plan.giving_way):
            return False
        self._assess_at = scene.now + self._settings.right_of_way.assess_period_s
        if all(other.stays for other in scene.others):
            return False
        path = np.array([[scene.T_map_base.x, scene.T_map_base.y]])
        if self._plan is not None and self._plan.route is not None:
            path = self._plan.route.path.ahead(self._settings.right_of_way.horizon_m)
        return bool(self._choice.rivals(scene.now, self._situation(scene, ()), path))

    def _lost_path(self, scene: _Scene, plan: Choice) -> bool:
        """Whether the robot is off its path or the map has changed on it."""
        if plan.route is None:
            return False
        path, geometry = plan.route.path, scene.planning_map.geometry
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
        return self._body.radius_m < blocked_in < math.inf

    def _situation(self, scene: _Scene, spots: Sequence[Discs]) -> Situation:
        """Return what a choice of route is made from."""
        return Situation(
            (scene.T_map_base.x, scene.T_map_base.y),
            self._goal,
            self._tolerance,
            self._busy,
            self._stood_at[2],
            spots,
            scene.others,
        )

    def _replan(self, scene: _Scene) -> None:
        """Choose a route anew."""
        now = scene.now
        self._spots = [spot for spot in self._spots if spot.until > now]
        spots = [spot.discs for spot in self._spots]
        seen = unmapped_points(
            scene.planning_map, scene.T_map_base, scene.points_base, scene.others
        )
        if len(seen):
            spots.append(Discs(seen, self._body.radius_m))
        choice = self._choice.choose(now, self._situation(scene, spots), scene.planning_map)
        self._planned_at = now
        before = self._plan
        if before is not None and before.giving_way and not choice.giving_way:
            self._free_since = now if self._free_since is None else self._free_since
            if now - self._free_since < _FREE_LASTS:
                return
        self._free_since = None
        self._blocked_since = None
        self._plan = choice
        if choice.reachable:
            self._unreachable_since = None
        elif self._unreachable_since is None:
            self._unreachable_since = now

    def _drive(self, scene: _Scene) -> NavigationStep:
        """Return the command that carries out the plan."""
        plan, now = self._plan, scene.now
        if plan is not None and self._unreachable_since is not None:
            if now - self._unreachable_since >= self._settings.driving.unreachable_after_s:
                self.clear()
                return self._report("unreachable", reason="no path leads there for this body")
        if plan is None or plan.route is None:
            self._watch.excuse(now)
            status: Status = "idle" if self._goal is None else "driving"
            return self._report("giving_way" if plan and plan.giving_way else status)
        status = "giving_way" if plan.giving_way else "driving"
        path = plan.route.path
        left = min(path.remaining, plan.stop_at - path.at)
        if left <= _PATH_END:
            self._watch.excuse(now)
            if not plan.giving_way and self._goal is None:
                self._plan = None
            return self._report(status)
        steered = self._steering.follow(path, scene.T_map_base, scene.points_base, scene.others)
        self._note_blocked(now, steered.blocked, steered.by_teammate)
        if steered.blocked and steered.by_teammate:
            self._watch.excuse(now)
            if self._held_too_long(now):
                self.clear()
                return self._report("stuck", reason="a teammate is in the way and does not move")
        elif self._watch.stalled(
            now, scene.T_map_base.x, scene.T_map_base.y, plan.to_go, scene.bumped
        ):
            return self._recover(scene)
        slow = (
            math.sqrt(2.0 * self._settings.driving.braking_m_s2 * left)
            / self._body.drive.speed_max_m_s
        )
        share = min(1.0, slow)
        return self._report(
            status, steered.speed * share, steered.turn_rate * (share if steered.speed else 1.0)
        )

    def _note_blocked(self, now: float, blocked: bool, by_teammate: bool) -> None:
        """Keep since when something is in the way, and since when a teammate is."""
        if not blocked:
            self._blocked_since = self._held_since = None
        elif by_teammate:
            self._held_since = now if self._held_since is None else self._held_since
        else:
            self._blocked_since = now if self._blocked_since is None else self._blocked_since

    def _held_too_long(self, now: float) -> bool:
        """Whether a teammate has been in the way for too long."""
        patience = self._settings.right_of_way.blocked_for_s
        return self._held_since is not None and now - self._held_since > patience

    def _recover(self, scene: _Scene) -> NavigationStep:
        """Begin to get loose, or give up."""
        settings = self._settings.recovery
        here, geometry = scene.T_map_base, scene.planning_map.geometry
        to_go = self._plan.to_go if self._plan is not None else 0.0
        count = self._watch.recovering(scene.now, to_go)
        if count > settings.most_recoveries:
            self.clear()
            return self._report("stuck", reason=f"got nowhere after {count - 1} attempts")
        ahead = here.apply((self._body.radius_m + 0.1, 0.0)).reshape(1, 2)
        # A single bump may be the jamb of a door that is the only way: make it dear at first.
        discs = Discs(ahead, settings.block_radius_m, hard=count > 1)
        self._spots.append(_Spot(discs, scene.now + settings.block_for_s))
        room = free_backwards(
            scene.planning_map.clearance,
            geometry.origin_x,
            geometry.origin_y,
            geometry.resolution,
            here.x,
            here.y,
            here.theta,
            self._body.radius_m + geometry.resolution,
            settings.back_up_m,
        )
        if self._someone_behind(scene):
            room = 0.0
        self._recovery = Recovery.begin(scene.now, here, room, count, settings)
        return self._report("driving")

    def _someone_behind(self, scene: _Scene) -> bool:
        """Whether a teammate is so near that backing up could touch it."""
        reach = 2.0 * self._settings.recovery.back_up_m
        return any(
            math.hypot(other.x - scene.T_map_base.x, other.y - scene.T_map_base.y)
            < self._body.radius_m + other.teammate.radius + reach
            for other in scene.others
        )

    def _report(
        self, status: Status, speed: float = 0.0, turn_rate: float = 0.0, reason: str = ""
    ) -> NavigationStep:
        """Return the step with what is to be announced."""
        path_map, remaining = _NO_PATH, 0.0
        plan = self._plan
        if plan is not None and plan.route is not None:
            path = plan.route.path
            horizon = min(self._settings.right_of_way.horizon_m, plan.stop_at - path.at)
            if horizon > _PATH_END and path.remaining > _PATH_END:
                path_map = path.ahead(horizon, _ANNOUNCED_SPACING)
            remaining = plan.to_go if plan.giving_way else path.remaining
        return NavigationStep(
            speed, turn_rate, status, path_map, remaining if self._goal else 0.0, reason
        )
