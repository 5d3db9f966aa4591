"""A robot's copy of the team's observations: what it tells, what it is told, the map of it all."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mapping.geometry import Floats, Pose2, pose_from
from mapping.observation_coding import Observation, encode_observation
from mapping.scan_coding import ScanCodingSettings
from mapping.shared_map import SharedMap
from protocol.effects import Effect
from protocol.log.held_log import HeldLog, draw_changes
from protocol.log.messages import LogMessage, PoseSet
from protocol.log.pose_coding import pose_of, pose_steps
from protocol.log.sync import LogSync, sends
from protocol.map_feed import MapFeed
from protocol.messages import MapDelta, MapSnapshot, PoseUpdate, ScanReport
from protocol.reported_scan import scan_of
from protocol.world_messages import Joined
from robot_agent.decentral.alone import OwnMap
from robot_agent.decentral.others_scans import OthersScans
from robot_agent.decentral.own_place import OwnPlace
from robot_agent.decentral.own_poses import OwnPoses, first_pose, moved, own_table
from robot_agent.decentral.settings import PeerSettings
from robot_agent.decentral.tying import Standing
from robot_agent.local_mapping import LocalMapping

_EPSILON = 1e-9


class Sharing:
    """Keeps the copy, tells the robot's software the map and where the robot is in it.

    Args:
        sync: keeps the log the same as the others'.
        shared: draws it.
        settings: how often, and how exactly.
        reference: whether this robot stands where it was told by definition: the others fit theirs.
        left: where the robot wrote down that it was when its software ended, map frame.

    Attributes:
        feed: tells the map to the robot's software.
        place: finds where the robot's own map lies in the team's.
        repositionings: when all poses were told anew, each `{t_s, robot, poses}`, (n, 3) map frame.
        home: where the robot began, (x, y) [m], map frame; None until it is known.
    """

    def __init__(
        self,
        sync: LogSync,
        shared: SharedMap,
        settings: PeerSettings,
        reference: bool,
        left: Pose2 | None = None,
    ) -> None:
        self.sync = sync
        self.shared = shared
        self.held = HeldLog(sync.log)
        self.feed = MapFeed(shared.view(), settings.map_period_s)
        self.home: tuple[float, float] | None = None
        self.repositionings: list[dict[str, object]] = []
        self.place = OwnPlace(sync, settings.tying, reference, left)
        self._judge = MapFeed(shared.view(), 0.0)
        self._settings = settings
        self._coding = ScanCodingSettings(error_bound_m=settings.error_bound_m)
        self._own: OwnPoses | None = None
        self._alone: OwnMap | None = None
        self._turned: MapSnapshot | None = None
        self._told: ScanReport | None = None
        self._rows: list[int] = []  # which report each entry of this start was, from 0
        self._looked: tuple[OwnPoses | None, Floats] = None, np.zeros((0, 3))  # at its own poses
        self._updated: Pose2 | None = None
        self._next_repose = 0.0
        self._noted = sync.telling.version
        self._mapping: LocalMapping | None = None
        self._kept = own_table(sync)
        self._others = OthersScans(sync, shared)

    # --- the robot's own ------------------------------------------------------------------------

    def begin(self, joined: Joined, mapping: LocalMapping, first: bool) -> None:
        """The robot has a body now.

        Args:
            joined: where it was told it starts.
            mapping: its own map.
            first: whether it stands where it was told, and was not started anew somewhere.
        """
        self._mapping = mapping
        self.place.begin(joined, first)
        if self.place.T_map_own is not None:
            self._tie(self.place.T_map_own)

    @property
    def tied(self) -> bool:
        """Whether the robot knows where its own map lies in the team's."""
        return self._own is not None

    def observe(self, report: ScanReport, now: float) -> None:
        """Share what the robot saw, or keep it until it knows where that was.

        Args:
            report: of a scan.
            now: mission time [s].
        """
        self.place.see(report)
        if self._own is not None:
            self._append(report, now)
            return
        self.place.wait(report, now)
        if self._alone is not None:
            self._alone.observe(report)

    def place_due(self, teammates: Sequence[Standing], now: float) -> PoseUpdate | None:
        """Return where the robot's own map lies in the team's, if that is news to its software.

        Args:
            teammates: those who know where they are.
            now: mission time [s].
        """
        if now < self._next_repose - _EPSILON or self._mapping is None:
            return None
        self._next_repose = now + self._settings.repose_period_s
        if self.place.due(self.checksum(), now):
            self._find(teammates, now)
        if self.place.mend_due(self.checksum(), now):
            self._mend(now)
        if self.place.settle_due(now):
            # Nobody is there who could tell where it is: better about there than nowhere.
            self._found(self.place.settle(now), now)
        if self._own is None:
            return self._go_alone(now)
        T_map_odom = self._own.T_map_own
        if self._told is not None:
            poses_own = self._mapping.reported_poses()[self._rows]
            self._revise(self._own, poses_own, now)
            T_map_odom = self._own.T_map_odom(poses_own[-1], self._told.T_odom_base)
        if self._updated == T_map_odom:
            return None
        self._updated = T_map_odom
        return PoseUpdate(number=0, T_map_odom=T_map_odom, uncertainty_m=0.0, matched=True)

    def track(self) -> Floats:
        """Return where the robot was at each scan since it was started, (n, 4) as known now.

        Rows are stamp [s], x, y [m], theta [rad], map frame; none before it knows where that is.
        """
        if self._own is None or self._mapping is None:
            return np.zeros((0, 4))
        stamps, poses_own = self._mapping.track()
        poses = [(self._own.T_map_own @ pose_from(pose)).as_tuple() for pose in poses_own]
        return np.column_stack((stamps, np.array(poses).reshape(-1, 3)))

    # --- the team's -----------------------------------------------------------------------------

    def hears(self, peer: str, now: float) -> bool:
        """Note that a peer said something; return whether it is listened to."""
        if peer in self.sync.standing.isolated:
            return False
        self.sync.hear(peer, now)
        return True

    def take(self, peer: str, message: LogMessage, now: float) -> list[Effect]:
        """Take a peer's word about logs."""
        self.sync.handle(peer, message, now)
        if self.sync.overtaken:
            self._begin_life(now)
        return list(self.sync.take_notes())

    def fault(self, peer: str, reason: str, now: float) -> list[Effect]:
        """Count something that cannot be."""
        self.sync.fault(peer, reason, now)
        return list(self.sync.take_notes())

    def next_deadline(self) -> float:
        """Return when something is due next [s]."""
        return min(self.sync.next_deadline(), self.feed.due, self._next_repose)

    def tick(self, now: float) -> list[Effect]:
        """Say what is due."""
        if self.sync.next_deadline() > now:
            return []
        sent = self.sync.tick(now)
        if any(isinstance(out.message, PoseSet) for out in sent):
            self._note_told(now)
        return [*sends("radio", sent), *self.sync.take_notes()]

    def delta_due(self, now: float) -> MapDelta | None:
        """Return what changed of the map, if it is time."""
        if now < self.feed.due - _EPSILON:
            return None
        self.follow(now)
        if self._settings.use_team_map and self._own is not None and self._mapping is not None:
            T_map_own = self._own.T_map_own
            news = self._others.news(len(self._kept), self.checksum(), T_map_own)
            if news is not None:
                self._mapping.take_others(news)
        return self.feed.delta_due(now)

    def turned(self) -> MapSnapshot | None:
        """Return the map that its software drives by, if it is another one since the last call."""
        turned, self._turned = self._turned, None
        return turned

    def told_judge(self, have: int) -> MapSnapshot | MapDelta | None:
        """Return the map for somebody who has it as of number `have`."""
        if have == 0 or have != self._judge.number:
            self._judge.delta()
            return self._judge.snapshot() if self._judge.number else None
        return self._judge.delta()

    def checksum(self) -> int:
        """Return a checksum of all that is held."""
        return self.held.checksum()

    def follow(self, now: float) -> None:
        """Let the map follow the log; whoever told what is no observation is to blame."""
        draw_changes(self.sync, self.held, self.shared, now)

    # --- steps ----------------------------------------------------------------------------------

    def _tie(self, T_map_own: Pose2) -> None:
        """The robot knows where its own map lies in the team's."""
        self._own = OwnPoses(self._kept, T_map_own)
        if self._alone is not None:
            self._alone, self._turned = None, self.feed.turn_to(self.shared.view())
        first = first_pose(self.sync) or T_map_own
        self.home = (first.x, first.y)

    def _begin_life(self, now: float) -> None:
        """Others hold more of this life than the robot wrote down: it goes on in a new one."""
        me = self.sync.log.me
        lives = [author.life for author in self.sync.log.authors() if author.robot == me.robot]
        self.sync.begin_life(max(lives) + 1, now)
        self._kept = own_table(self.sync)[:0]
        if self._own is not None:
            self._own = OwnPoses(self._kept, self._own.T_map_own)

    def _append(self, report: ScanReport, now: float) -> None:
        assert self._own is not None
        victims_base = report.T_odom_base.inverse().apply(report.victims_odom.astype(np.float64))
        observation = Observation(scan_of(report), victims_base)
        payload = encode_observation(observation, self._coding)
        pose = pose_steps(self._own.T_map_own @ report.T_odom_base)
        self.sync.append(payload, pose, now)
        self._told = report
        self._rows.append(report.number - 1)

    def _revise(self, own: OwnPoses, poses_own: Floats, now: float) -> None:
        """Tell the poses (n, 3), own map, anew if one of them is off by too much."""
        if own is self._looked[0] and np.array_equal(poses_own, self._looked[1]):
            return
        self._looked = own, poses_own
        settings, told, table = self._settings, own_table(self.sync), own.table(poses_own)
        if moved(told, table, settings.repose_m, math.radians(settings.repose_deg)):
            self.sync.revise(table, now)

    def _note_told(self, now: float) -> None:
        """Note the robot's own poses if they were told anew: some are better before that."""
        own = self.sync.log.own
        if self.sync.telling.version == own.version > self._noted:
            self._noted = own.version
            poses = np.array([pose_of(row).as_tuple() for row in own.poses.tolist()])
            self.repositionings.append(
                {"t_s": now, "robot": self.sync.log.me.robot, "poses": poses}
            )

    def _go_alone(self, now: float) -> PoseUpdate | None:
        """Let the robot's software explore by its own map, when it waited for long."""
        if self._alone is not None or not self.place.alone_due(now):
            return None
        T_map_own = self.place.whereabouts.T_map_own
        self._alone = OwnMap(T_map_own, self.place.waiting, self.shared.team)
        self._turned = self.feed.turn_to(self._alone.view)
        return PoseUpdate(number=0, T_map_odom=T_map_own, uncertainty_m=0.0, matched=True)

    def _found(self, waited: Sequence[ScanReport], now: float) -> None:
        """The robot knows where it is: it shares what waited for that."""
        assert self.place.T_map_own is not None
        self._tie(self.place.T_map_own)
        for report in waited:
            self._append(report, now)

    def _find(self, teammates: Sequence[Standing], now: float) -> None:
        """Look where the robot's own map lies in the team's; share what it saw once it knows."""
        self.follow(now)
        others = self._others.placed(len(self._kept))
        waited = self.place.find(
            others, teammates, self.shared.team.resolution, self.checksum(), now
        )
        if self.place.T_map_own is not None:
            self._found(waited, now)

    def _mend(self, now: float) -> None:
        """Look whether all that the robot saw fits what those saw whose names come before its."""
        self.follow(now)
        assert self._mapping is not None
        me, kept = self.sync.log.me, len(self._kept)
        poses_own = self._mapping.reported_poses()[self._rows]
        placed = list(self.shared.team.placed())
        own = [
            (p.scan, pose_from(poses_own[p.number - kept - 1]))
            for p in placed
            if p.author == me and p.number > kept
        ]
        others = [(p.scan, p.T_map_base) for p in placed if p.author[0] < me.robot]
        if self.place.mend(own, others, self.shared.team.resolution, now):
            assert self.place.T_map_own is not None
            self._tie(self.place.T_map_own)
