"""The robot's core: local SLAM, bids and navigation, between a body and a radio.

Body frames and fleet messages in; motion commands, scan reports, bids and task news out. It has no
clock, no socket and no file: the same core runs in a simulated team and on a real robot.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan
from protocol import messages as words
from protocol.body import Body
from protocol.effects import Effect, Event, Note, Received, Rejected, Send, Stop
from protocol.fault_book import FaultBook
from protocol.map_cells import map_digest
from protocol.messages import SERVER, Message
from protocol.world_messages import BodyFrame, Join, Joined, JoinRefused, Shutdown
from robot_agent.explorer import Explorer
from robot_agent.local_mapping import LocalMapping
from robot_agent.look_around import LookAround
from robot_agent.map_following import MapFollower
from robot_agent.motion_commands import MotionCommands
from robot_agent.navigation import Navigator
from robot_agent.novelty import unseen_area
from robot_agent.planning_map import PlanningMap
from robot_agent.settings import RobotSettings
from robot_agent.task_work import TaskWork
from robot_agent.team_view import Teammates
from robot_agent.unplaced import without_discs

_EPSILON = 1e-9
_NO_POINTS = np.zeros((0, 2))
_PATH_POINTS = 64  # of its path a robot announces this many points, nearest first


class Agent:
    """The core of one robot.

    Args:
        name: the robot's name.
        settings: of all its parts.
        incarnation: which life of this robot's software this is.
        rng: for estimators that draw lots.

    Attributes:
        unplaced: radii [m] of teammates that may be anywhere: what looks like one is no wall.
    """

    def __init__(
        self,
        name: str,
        settings: RobotSettings,
        incarnation: int = 0,
        rng: np.random.Generator | None = None,
    ) -> None:
        self.name = name
        self.unplaced: tuple[float, ...] = ()
        self.settings = settings
        self._incarnation = incarnation
        self._rng = rng or np.random.default_rng(0)
        self._teammates = Teammates(name)
        self._joined: Joined | None = None
        self._welcome = False
        self._ended = False
        self._aligned = False
        self._look = LookAround(settings.look_around)
        self._T_map_odom = IDENTITY
        self._points_base = _NO_POINTS
        self._speed = 0.0
        self._path_map = np.zeros((0, 2), dtype=np.float32)
        self._news: Sequence[Message] = ()
        self._commands = MotionCommands()
        self._next_heartbeat = 0.0
        self._next_hello = 0.0
        self._follower: MapFollower | None = None
        self._body_parts: tuple[LocalMapping, PlanningMap, Explorer, TaskWork] | None = None
        self._dropped = FaultBook()
        self._answers: dict[type[Message], Callable[[Message, float], list[Effect]]] = {
            Joined: self._switch_on,
            JoinRefused: self._give_up,
            words.Refused: self._give_up,
            Shutdown: self._shut_down,
            BodyFrame: self._sense,
            words.Welcome: self._welcomed,
            words.ReportsReceived: self._reports_received,
            words.PoseUpdate: self._pose_update,
            words.TeamPoses: self._team_poses,
            words.MapSnapshot: self._map_snapshot,
            words.MapDelta: self._map_delta,
            words.Award: self._award,
            words.Terminate: self._terminate,
            words.TightPlace: self._tight_place,
            words.MissionEnd: self._mission_end,
        }

    # --- the core's three methods -----------------------------------------------------------

    def next_deadline(self) -> float | None:
        """Return when something is due next [s]; a joined robot lives by its body's frames."""
        return 0.0 if self._joined is None and self._next_hello == 0.0 else self._next_hello

    def handle(self, event: Event, now: float) -> list[Effect]:
        """Take a body frame or a word of the fleet."""
        if isinstance(event, Rejected):
            return list(self._dropped.enter("a frame", event.source, event.reason))
        if not isinstance(event, Received):
            return []
        answer = self._answers.get(type(event.message))
        return answer(event.message, now) if answer else []

    def tick(self, now: float) -> list[Effect]:
        """Knock at the world's and the server's door until they open."""
        self._next_hello = now + self.settings.hello_period_s
        if self._joined is None:
            return [Send("body", "world", Join(role="robot", incarnation=self._incarnation))]
        if self._welcome:
            return self._ask_again(now)
        hello = words.Hello(
            role="robot",
            incarnation=self._incarnation,
            body=self._joined.body,
            start=self._joined.start,
            start_sigma_m=self._joined.start_sigma_m,
            start_sigma_deg=self._joined.start_sigma_deg,
        )
        return [Send("radio", SERVER, hello)]

    # --- the body -----------------------------------------------------------------------------

    def _switch_on(self, message: Message, now: float) -> list[Effect]:
        """The world tells what body this is."""
        assert isinstance(message, Joined)
        if self._joined is not None:
            return []
        body = message.body or Body()
        self._joined = message
        self._T_map_odom = message.start or IDENTITY
        self._next_hello = now
        settings = self.settings
        planning_map = PlanningMap(body.radius_m, settings.navigation.planning_map)
        explorer = Explorer(body, settings.explorer, planning_map)
        self._follower = MapFollower(planning_map, settings.hello_period_s, self._dropped)
        self._body_parts = (
            LocalMapping(body, settings.mapping, settings.estimator, self._rng),
            planning_map,
            explorer,
            TaskWork(Navigator(body, settings.navigation, self.name), body, settings.task),
        )
        return self.tick(now)

    def _sense(self, message: Message, now: float) -> list[Effect]:
        """Live one control period: map, drive, report."""
        assert isinstance(message, BodyFrame)
        if self._joined is None or self._body_parts is None:
            return []
        mapping, planning_map, explorer, work = self._body_parts
        if len(message.ranges):
            mapping.take(self._scan_of(message, mapping), message.T_wheel_base)
            mapping.sight_victims(message.victims_base.astype(np.float64))
            self._points_base = mapping.scan.points_base() if mapping.scan else _NO_POINTS
            if self._look.first and not (self._look.done and self._aligned):
                body = self._joined.body or Body()
                mapping.sight(self._teammates.find_in(self._sweep_of(message), body))
        mapping.move(message.T_wheel_base)
        if self._looks_around(message):
            rate = (self._joined.body or Body()).drive.turn_rate_max_rad_s
            effects = self._command(0.0, rate if self._welcome else 0.0, now)
        else:
            effects = self._drive(message, now)
        if not self._welcome:
            return effects

        def news(scan: LaserScan) -> float:
            return unseen_area(planning_map, scan, self._T_map_odom @ mapping.T_odom_base)

        arrived = any(isinstance(word, words.TaskEnd) for word in self._news)
        if (len(message.ranges) and mapping.report_due(self._aligned, news)) or (
            arrived and mapping.has_news
        ):
            effects.append(Send("radio", SERVER, mapping.report()))
        T_map_base = self._T_map_odom @ mapping.T_odom_base
        ready = self._aligned and self._look.done and not self._ended
        if ready and work.wants_bids:
            bid = explorer.bid(T_map_base, self._teammates.places, work.idle, now)
            effects += [Send("radio", SERVER, bid)] if bid else []
        return [*effects, *self._heartbeat(mapping, planning_map, now)]

    def _scan_of(self, frame: BodyFrame, mapping: LocalMapping) -> LaserScan:
        """Return the sweep of a frame, without beams that hit teammates."""
        mapping.move(frame.T_wheel_base)
        T_map_base = self._T_map_odom @ mapping.T_odom_base
        sweep = self._sweep_of(frame)
        if self.unplaced:
            sweep = without_discs(sweep, self.unplaced)
        return self._teammates.mask(sweep, T_map_base, self.settings.mapping.teammate_margin_m)

    def _sweep_of(self, frame: BodyFrame) -> LaserScan:
        """Return the sweep of a frame as measured."""
        assert self._joined is not None
        lidar = (self._joined.body or Body()).lidar
        return LaserScan(
            frame.ranges,
            lidar.bearing_start,
            lidar.bearing_step,
            lidar.range_max_m,
            frame.stamp_s,
        )

    def _looks_around(self, frame: BodyFrame) -> bool:
        """Whether to turn on the spot: once, and on until the server has placed the robot."""
        self._look.follow(frame.T_wheel_base)
        return not self._ended and not (self._look.done and self._aligned)

    def _drive(self, frame: BodyFrame, now: float) -> list[Effect]:
        """Let the task in hand drive the body."""
        assert self._body_parts is not None
        mapping, planning_map, _, work = self._body_parts
        T_map_base = self._T_map_odom @ mapping.T_odom_base
        step = work.step(
            now, T_map_base, self._points_base, self._teammates.others, frame.bumped, planning_map
        )
        self._speed, self._path_map = step.speed, step.path_map[:_PATH_POINTS].astype(np.float32)
        commands = self._command(step.speed, step.turn_rate, now)
        self._news = step.news
        news = [Send("radio", SERVER, message) for message in step.news]
        return [*commands, *news]

    def _command(self, speed: float, turn_rate: float, now: float) -> list[Effect]:
        command = self._commands.say(speed, turn_rate, now)
        return [] if command is None else [Send("body", "world", command)]

    def _heartbeat(
        self, mapping: LocalMapping, planning_map: PlanningMap, now: float
    ) -> list[Effect]:
        """Tell where the robot is and what it is about to drive."""
        if now < self._next_heartbeat - _EPSILON:
            return []
        self._next_heartbeat = now + self.settings.heartbeat_period_s
        heartbeat = words.Heartbeat(
            T_odom_base=mapping.T_odom_base,
            speed_m_s=self._speed,
            moving=abs(self._speed) > 0.01,
            path_map=self._path_map,
            reports=mapping.reports,
            map_number=planning_map.number,
            map_digest=map_digest(planning_map.cells, planning_map.geometry) if self._ended else "",
        )
        return [Send("radio", SERVER, heartbeat)]

    # --- words of the server ------------------------------------------------------------------

    def _welcomed(self, message: Message, now: float) -> list[Effect]:
        self._welcome = True
        return []

    def _ask_again(self, now: float) -> list[Effect]:
        """Send once more what the server does not confirm."""
        if self._body_parts is None or self._body_parts[0].unconfirmed < 3:
            return []
        return [Send("radio", SERVER, report) for report in self._body_parts[0].missing(now)]

    def _reports_received(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.ReportsReceived)
        if self._body_parts is None:
            return []
        lacking = self._body_parts[0].received(message.number, now)
        return [Send("radio", SERVER, report) for report in lacking]

    def _pose_update(self, message: Message, now: float) -> list[Effect]:
        """The server placed a report: the local map lies a little different in the team's."""
        assert isinstance(message, words.PoseUpdate)
        self._T_map_odom = message.T_map_odom
        self._aligned = self._aligned or message.matched
        return []

    def _team_poses(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.TeamPoses)
        self._teammates.hear(message)
        return []

    def _map_snapshot(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.MapSnapshot)
        return self._follower.snapshot(message) if self._follower else []

    def _map_delta(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.MapDelta)
        return self._follower.delta(message, now) if self._follower else []

    def _award(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.Award)
        if self._body_parts is None or self._ended:
            return []
        news = self._body_parts[3].award(message, now)
        return [Send("radio", SERVER, word) for word in news]

    def _terminate(self, message: Message, now: float) -> list[Effect]:
        assert isinstance(message, words.Terminate)
        if self._body_parts is not None:
            self._body_parts[3].terminate(message.task)
        return []

    def _tight_place(self, message: Message, now: float) -> list[Effect]:
        """A teammate of this size or less does not fit through there."""
        assert isinstance(message, words.TightPlace)
        if self._body_parts is not None:
            reach = self.settings.navigation.recovery.block_radius_m
            self._body_parts[1].refused(message.place_map, reach)
        return []

    def _mission_end(self, message: Message, now: float) -> list[Effect]:
        """Stop and send what is still held."""
        if self._body_parts is None or self._ended:
            return []
        self._ended = True
        mapping, _, _, work = self._body_parts
        work.halt()
        if mapping.scan is None:
            return []
        return [Send("radio", SERVER, mapping.report())]

    def _give_up(self, message: Message, now: float) -> list[Effect]:
        """Somebody does not take this robot in."""
        assert isinstance(message, words.Refused | JoinRefused)
        return [Note("error", message.reason), Stop(f"refused: {message.reason}")]

    def _shut_down(self, message: Message, now: float) -> list[Effect]:
        return [Stop("over")]

    @property
    def explorer(self) -> Explorer | None:
        """What makes its bids, once it has a body."""
        return self._body_parts[2] if self._body_parts else None

    @property
    def planning_map(self) -> PlanningMap | None:
        """Its copy of the team's map, once it has a body."""
        return self._body_parts[1] if self._body_parts else None

    @property
    def mapping(self) -> LocalMapping | None:
        """Its own mapping, once it has a body."""
        return self._body_parts[0] if self._body_parts else None

    @property
    def body(self) -> Body:
        """Its body, as far as it knows."""
        return (self._joined and self._joined.body) or Body()

    def pose_map(self) -> Pose2:
        """Return where the robot believes to be, map frame."""
        T_odom_base = self._body_parts[0].T_odom_base if self._body_parts else IDENTITY
        return self._T_map_odom @ T_odom_base
