"""Driving to a goal: plan on the team's map, follow the path, give way, get loose, give up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from mapping.geometry import IDENTITY, Floats, Pose2
from protocol.body import Body
from robot_agent.navigation_settings import NavigationSettings
from robot_agent.planning import Goal, Planning, Scene
from robot_agent.planning_map import PlanningMap
from robot_agent.recovery import Recovery, StallWatch, room_behind
from robot_agent.right_of_way import Teammate
from robot_agent.route_planning import Discs
from robot_agent.sightings import TeammateTracks
from robot_agent.steering import Steered, Steering

Status = Literal["idle", "driving", "arrived", "unreachable", "stuck", "giving_way"]

_NO_PATH: Floats = np.empty((0, 2))
_NO_PATH.flags.writeable = False

# The end of a path is reached when so little is left of it [m].
_PATH_END = 0.08
# Points of an announced path are this far apart: it goes over the radio again and again [m].
_ANNOUNCED_SPACING = 0.3
# What the robot got stuck at stands so far before its rim [m].
_STUCK_AHEAD = 0.1


@dataclass(frozen=True, slots=True)
class NavigationStep:
    """What to do until the next step.

    Attributes:
        speed: [m/s].
        turn_rate: [rad/s].
        status: `arrived`, `unreachable` and `stuck` are said once; then the goal is forgotten.
        path_map: (n, 2) [m], what the robot is about to drive; empty if it means to stay.
        remaining_m: what is left of the path to the goal [m]; while none is known, as much as
            was left of the last one, or as the crow flies; 0 without a goal.
        reason: why, for `unreachable` and `stuck`.
        tight_map: (x, y) [m], where the body has just found that it does not get through; the map
            knows already.
    """

    speed: float
    turn_rate: float
    status: Status
    path_map: Floats
    remaining_m: float
    reason: str = ""
    tight_map: tuple[float, float] | None = None


class Navigator:
    """Takes one robot to its goals and keeps it out of everybody's way."""

    def __init__(self, body: Body, settings: NavigationSettings, name: str) -> None:
        """Navigate for the robot `name` with this body."""
        self._body = body
        self._settings = settings
        self._tracks = TeammateTracks(settings.right_of_way.silent_after_s)
        self._planning = Planning(body.radius_m, settings, name)
        self._steering = Steering(body, settings.driving, settings.right_of_way)
        self._watch = StallWatch(settings.recovery)
        self._scan_points: Floats = _NO_PATH
        self._T_map_scan = IDENTITY
        self._goal: Goal | None = None
        self.clear()

    @property
    def goal_map(self) -> tuple[float, float] | None:
        """The goal (x, y) [m] in the map frame, None without one."""
        return self._goal.place_map if self._goal is not None else None

    def set_goal(self, goal_map: tuple[float, float], tolerance: float, busy: bool = True) -> None:
        """Drive to a place.

        Args:
            goal_map: (x, y) [m].
            tolerance: how near the robot has to get [m].
            busy: whether it drives for a task, and so goes before robots that do not.
        """
        self.clear()
        self._goal = Goal((float(goal_map[0]), float(goal_map[1])), tolerance, busy)
        self._fresh = True

    def clear(self) -> None:
        """Forget the goal and stay, but still make way for others."""
        self._goal = None
        self._fresh = False
        self._blocked_since: float | None = None
        self._held_since: float | None = None
        self._recovery: Recovery | None = None
        self._to_goal: float | None = None
        self._planning.forget()
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
        scene = Scene(now, T_map_base, points, others, bumped, planning_map)
        planning_map.passed(T_map_base.x, T_map_base.y)
        if self._fresh:
            self._fresh = False
            self._watch.start(now)
        if self._recovery is not None:
            command = self._recovery.step(
                now, T_map_base, self._settings.recovery, self._body.drive.turn_rate_max_rad_s
            )
            if command is not None:
                return self._report(T_map_base, "driving", *command)
            self._recovery = None
        blocked_for = 0.0 if self._blocked_since is None else now - self._blocked_since
        if self._planning.update(scene, self._goal, blocked_for):
            self._blocked_since = None
        if self._planning.unreachable(now):
            return self._end("unreachable", "no path leads there for this body")
        if self._arrived(T_map_base):
            return self._end("arrived", "")
        return self._drive(scene)

    def _carried_along(self, T_map_base: Pose2, points_base: Floats) -> Floats:
        """Return the scan's points (n, 2) [m] in the base frame of now."""
        if points_base is not self._scan_points:
            self._scan_points, self._T_map_scan = points_base, T_map_base
            return points_base
        return (T_map_base.inverse() @ self._T_map_scan).apply(points_base)

    def _arrived(self, T_map_base: Pose2) -> bool:
        """Whether the goal is reached: near enough, and not just on the other side of a wall."""
        path, goal = self._planning.path, self._goal
        if goal is None or path is None or self._planning.giving_way:
            return False
        away = math.hypot(goal.place_map[0] - T_map_base.x, goal.place_map[1] - T_map_base.y)
        if path.remaining <= _PATH_END and path.off < self._settings.driving.off_path_m:
            return True
        return away <= goal.tolerance and path.remaining <= 1.5 * goal.tolerance

    def _end(self, status: Status, reason: str) -> NavigationStep:
        """Be through with the goal."""
        self.clear()
        return NavigationStep(0.0, 0.0, status, _NO_PATH, 0.0, reason)

    def _drive(self, scene: Scene) -> NavigationStep:
        """Return the command that carries out the plan."""
        now, here = scene.now, scene.T_map_base
        plan, path = self._planning.plan, self._planning.path
        status: Status = "idle" if self._goal is None else "driving"
        status = "giving_way" if self._planning.giving_way else status
        left = self._planning.left
        if plan is None or path is None or left <= _PATH_END:
            self._watch.excuse(now)
            if status == "idle":
                self._planning.plan = None
            return self._report(here, status)
        steered = self._steering.follow(path, here, scene.points_base, scene.others)
        self._note_blocked(now, steered)
        if steered.blocked and steered.by_teammate:
            self._watch.excuse(now)
            if self._held_too_long(now):
                return self._end("stuck", "a teammate is in the way and does not move")
        elif self._watch.stalled(now, here.x, here.y, plan.to_go, scene.bumped):
            return self._recover(scene, plan.to_go)
        return self._report(here, status, *self._slowed(steered, left))

    def _slowed(self, steered: Steered, left: float) -> tuple[float, float]:
        """Return speed and turn rate for a robot that is to stop in `left` [m]."""
        if steered.speed <= 0.0:
            return steered.speed, steered.turn_rate
        most = math.sqrt(2.0 * self._settings.driving.braking_m_s2 * left)
        share = min(1.0, most / steered.speed)
        return steered.speed * share, steered.turn_rate * share

    def _note_blocked(self, now: float, steered: Steered) -> None:
        """Keep since when something is in the way, and since when a teammate is."""
        if not steered.blocked:
            self._blocked_since = self._held_since = None
        elif steered.by_teammate:
            self._held_since = now if self._held_since is None else self._held_since
        else:
            self._blocked_since = now if self._blocked_since is None else self._blocked_since

    def _held_too_long(self, now: float) -> bool:
        """Whether a teammate has been in the way for too long."""
        patience = self._settings.right_of_way.blocked_for_s
        return self._held_since is not None and now - self._held_since > patience

    def _recover(self, scene: Scene, to_go: float) -> NavigationStep:
        """Begin to get loose, or give up."""
        settings, here, radius = self._settings.recovery, scene.T_map_base, self._body.radius_m
        count = self._watch.recovering(scene.now, to_go)
        if count > settings.most_recoveries:
            return self._end("stuck", f"got nowhere after {count - 1} attempts")
        # Where the way leads on is what it cannot pass: it may have turned aside by now.
        path = self._planning.path
        ahead = here.apply((radius + _STUCK_AHEAD, 0.0)).reshape(1, 2)
        if path is not None:
            ahead = path.ahead(radius + _STUCK_AHEAD)[-1:]
        # A single bump may be the jamb of a door that is the only way: make it dear at first.
        again = self._watch.stuck_here(here.x, here.y) > 1
        spot = Discs(ahead, settings.block_radius_m, hard=again)
        self._planning.avoid(scene.now, spot)
        room = room_behind(scene.planning_map, here, scene.others, radius, settings.back_up_m)
        self._recovery = Recovery.begin(scene.now, here, room, count, settings)
        self._steering.halt()
        step = self._report(here, "driving")
        if not again:
            return step
        place = (float(ahead[0, 0]), float(ahead[0, 1]))
        scene.planning_map.refused(place, settings.block_radius_m)
        return replace(step, tight_map=place)

    def _report(
        self, T_map_base: Pose2, status: Status, speed: float = 0.0, turn_rate: float = 0.0
    ) -> NavigationStep:
        """Return the step with what is to be announced."""
        path_map = _NO_PATH
        plan, path, left = self._planning.plan, self._planning.path, self._planning.left
        if plan is not None and path is not None:
            if left > _PATH_END:
                horizon = min(self._settings.right_of_way.horizon_m, left)
                path_map = path.ahead(horizon, _ANNOUNCED_SPACING)
            if plan.reachable:
                self._to_goal = plan.to_go if plan.giving_way else path.remaining
        return NavigationStep(speed, turn_rate, status, path_map, self._remaining(T_map_base))

    def _remaining(self, T_map_base: Pose2) -> float:
        """Return what is left to the goal [m], see `NavigationStep`."""
        if self._goal is None:
            return 0.0
        if self._to_goal is not None:
            return self._to_goal
        x, y = self._goal.place_map
        return math.hypot(x - T_map_base.x, y - T_map_base.y)
