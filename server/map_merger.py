"""The central mapper: places every robot's scans in one team map.

The same matcher that a robot runs against its own map is run here against the team's, starting from
the robot's locally corrected pose: "basically the same software runs at both levels" (Simmons et
al. 2000, section "Coordinated Mapping"). The first scan of the first robot defines the map frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from mapping.correlative_search import SearchWindow
from mapping.geometry import Floats, Pose2, interpolate, wrap_angle
from mapping.grid import EMPTY_BOX, CellBox, GridGeometry
from mapping.match_map import MapSettings, MatchMap
from mapping.scan import LaserScan
from mapping.scan_integration import IntegrationSettings, scan_extent
from mapping.scan_matching import MatchResult, match
from mapping.scan_points import scan_points, turned_points
from protocol.fields import LARGEST_EDGE
from server.settings import MergerSettings

_HELD_TOGETHER = 6  # reports that are matched together to tie a robot to the map


@dataclass(frozen=True, slots=True)
class Report:
    """One scan of a robot as it told it.

    Attributes:
        scan: the scan, without beams that hit teammates.
        T_odom_base: the robot's locally corrected pose.
        covariance: (3, 3) of it relative to the robot's own map around it, odom frame.
        track_odom: (n, 4) stamp, x, y, theta since the report before, odom frame.
    """

    scan: LaserScan
    T_odom_base: Pose2
    covariance: Floats
    track_odom: Floats


@dataclass(frozen=True, slots=True)
class Node:
    """A scan in the team's map: a vertex of the pose graph.

    Attributes:
        robot: who took it.
        scan: the scan.
        T_map_base: where.
        T_odom_base: where by the robot's own estimate, in its local map.
        covariance: (3, 3) of the match that placed it, map frame.
        own_covariance: (3, 3) of `T_odom_base` in the robot's own map, odom frame.
        life: which life of the robot's process, from 0; each has a local map of its own.
    """

    robot: str
    scan: LaserScan
    T_map_base: Pose2
    T_odom_base: Pose2
    covariance: Floats
    own_covariance: Floats
    life: int = 0


@dataclass(slots=True)
class Member:
    """What the merger knows of one robot.

    Attributes:
        T_map_odom: where its local map lies in the team's.
        covariance: (3, 3) of the robot's pose in the team's map, map frame.
        aligned: whether a scan of it was ever matched (or defined the frame).
        track: corrected poses so far, rows of stamp, x, y, theta, map frame.
        held: reports that wait for the alignment.
        last: the report that was placed last.
        unmatched: reports in a row that contradicted the map.
        placed: reports placed so far.
        life: which life of the robot's process this is, from 0.
    """

    T_map_odom: Pose2
    covariance: Floats
    aligned: bool = False
    track: list[Floats] = field(default_factory=list)
    held: list[Report] = field(default_factory=list)
    last: Report | None = None
    unmatched: int = 0
    placed: int = 0
    life: int = 0


@dataclass(frozen=True, slots=True)
class Placement:
    """Outcome of placing a report.

    Attributes:
        matched: whether it agrees with the team's map.
        moved: correction of the robot's place by this report [m].
        too_far: whether it was refused because the map would have grown beyond all reason.
    """

    matched: bool
    moved: float
    too_far: bool = False


TOO_FAR = Placement(matched=False, moved=0.0, too_far=True)


class MapMerger:
    """Builds the team's map.

    Attributes:
        map: the team's map and what matching needs of it.
        members: by robot's name.
        nodes: all placed scans, in order.
        dirty: cells changed since `take_changes`, on the lattice.
    """

    def __init__(self, settings: MergerSettings) -> None:
        self.settings = settings
        self.map = MatchMap(
            MapSettings(
                resolution=settings.resolution_m,
                integration=IntegrationSettings(fill_between=True),
            )
        )
        self.members: dict[str, Member] = {}
        self.nodes: list[Node] = []
        self.dirty = EMPTY_BOX

    @property
    def lattice(self) -> tuple[int, int]:
        """Row and column of the map's cell (0, 0) on the lattice of cells through the origin."""
        geometry = self.geometry
        return (
            round(geometry.origin_y / geometry.resolution),
            round(geometry.origin_x / geometry.resolution),
        )

    def take_changes(self) -> tuple[CellBox, npt.NDArray[np.float32]]:
        """Return the rectangle of cells that changed since the last call, and their log-odds.

        The rectangle's indices are those of the lattice through the origin, so they stay valid when
        the map grows.
        """
        box, self.dirty = self.dirty, EMPTY_BOX
        rows, cols = self.lattice
        return box, self.log_odds[box.shifted(-rows, -cols).slices]

    def add(self, name: str, T_map_start: Pose2, sigma: float, turn_sigma: float) -> None:
        """Take a robot in that was told to start at `T_map_start`, within the errors [m], [rad].

        A robot that starts anew comes back here with an empty local map of its own; its track and
        its scans stay.
        """
        known = self.members.get(name)
        covariance = np.diag([sigma**2, sigma**2, turn_sigma**2]) + np.diag([1e-4, 1e-4, 1e-5])
        if known is None:
            self.members[name] = Member(T_map_start, covariance)
            return
        restart = self._last_pose(name) or T_map_start
        self.members[name] = Member(
            restart, covariance, track=known.track, placed=known.placed, life=known.life + 1
        )

    def place(self, name: str, report: Report) -> Placement:
        """Place a report in the team's map; the robot's alignment follows."""
        member = self.members[name]
        if not self._holds(report.scan, member.T_map_odom @ report.T_odom_base):
            return TOO_FAR
        if not member.aligned:
            return self._tie(name, member, report)
        prior = self._prior(member)
        guess = member.T_map_odom @ report.T_odom_base
        result = self.map.match(report.scan, guess, prior, self._window(prior))
        if self._contradicts(result):
            wide = self.settings.wide_scale * prior + np.diag([0.04, 0.04, 0.01])
            result = self.map.match(report.scan, guess, wide, SearchWindow())
        if self._contradicts(result):
            member.unmatched += 1
            self._extend_track(member, report, member.T_map_odom)
            return Placement(False, 0.0)
        member.covariance, member.unmatched = result.covariance, 0
        return self._insert(name, member, report, result.T_map_base @ report.T_odom_base.inverse())

    def _tie(self, name: str, member: Member, report: Report) -> Placement:
        """Tie a robot's local map to the team's, or keep its report until that is possible.

        The robot that comes first defines the map frame. Of the others all reports so far are
        matched together: what they saw in all directions says more than one view of a corridor.
        """
        if self.map.scans == 0:
            member.aligned = True
            member.covariance = np.diag([1e-4, 1e-4, 1e-5])
            return self._insert(name, member, report, member.T_map_odom)
        member.held.append(report)
        sigma = math.sqrt(max(member.covariance[0, 0], member.covariance[1, 1]))
        turn_sigma = math.sqrt(member.covariance[2, 2])
        # Starts are told with uniform errors: one sigma of them is their largest.
        window = SearchWindow(1.25 * sigma + 0.1, 1.25 * turn_sigma + 0.02)
        T_base_odom = report.T_odom_base.inverse()
        points = [
            turned_points(scan_points(held.scan), T_base_odom @ held.T_odom_base)
            for held in member.held[-_HELD_TOGETHER:]
        ]
        result = match(
            self.map.grid,
            self.map.surfaces,
            np.concatenate(points),
            member.T_map_odom @ report.T_odom_base,
            member.covariance,
            self.map.settings.matching,
            window,
        )
        if not self._aligns(result, len(member.held)):
            return Placement(False, 0.0)
        T_map_odom = result.T_map_base @ T_base_odom
        member.covariance, member.aligned = result.covariance, True
        waiting, member.held = member.held, []
        for held in waiting:
            placement = self._insert(name, member, held, T_map_odom)
        return placement

    def track(self, name: str) -> Floats:
        """Return the corrected poses of a robot, (n, 4): stamp, x, y, theta, map frame."""
        rows = self.members[name].track
        return np.vstack(rows) if rows else np.zeros((0, 4))

    def uncertainty(self, name: str) -> float:
        """Return one sigma of a robot's place in the team's map [m]."""
        covariance = self.members[name].covariance
        return math.sqrt(max(covariance[0, 0], covariance[1, 1]))

    @property
    def geometry(self) -> GridGeometry:
        """Where the team's map lies, map frame."""
        return self.map.grid.geometry

    @property
    def log_odds(self) -> npt.NDArray[np.float32]:
        """The team's map, (rows, cols) float32."""
        return self.map.grid.log_odds

    # --- steps --------------------------------------------------------------------------------

    def _prior(self, member: Member) -> Floats:
        """Return the covariance of the guess: the last match's, and what the way since added."""
        settings = self.settings
        drift, turn_drift = settings.drift_m, math.radians(settings.drift_deg)
        return member.covariance + np.diag([drift**2, drift**2, turn_drift**2])

    def _window(self, prior: Floats) -> SearchWindow | None:
        """Return the window to search, or None where the guess is good."""
        sigma = math.sqrt(max(prior[0, 0], prior[1, 1]))
        turn_sigma = math.sqrt(prior[2, 2])
        if sigma < self.settings.search_sigma_m and turn_sigma < math.radians(3.0):
            return None
        return SearchWindow(min(3.0 * sigma, 1.5), min(3.0 * turn_sigma, 0.5))

    def _contradicts(self, result: MatchResult) -> bool:
        """Whether enough end points fall where the map is known, and too few of them at walls."""
        settings = self.settings
        return result.known >= settings.known_least and result.fit < settings.fit_least

    def _aligns(self, result: MatchResult, held: int) -> bool:
        """Whether a match is good enough to tie a robot to the team's map."""
        settings = self.settings
        if result.explained < settings.align_points or result.fit < settings.align_fit:
            return False
        sigma = math.sqrt(np.linalg.eigvalsh(result.covariance[:2, :2])[-1])
        sure = sigma <= settings.align_sigma_m and result.covariance[2, 2] <= (
            math.radians(settings.align_sigma_deg) ** 2
        )
        return bool(sure) or held >= settings.hold_most

    def _insert(self, name: str, member: Member, report: Report, T_map_odom: Pose2) -> Placement:
        """Insert a scan at its corrected pose."""
        T_map_base = T_map_odom @ report.T_odom_base
        if not self._holds(report.scan, T_map_base):
            return TOO_FAR
        box = self.map.insert(report.scan, T_map_base)
        moved = (member.T_map_odom @ report.T_odom_base).distance_to(T_map_base)
        self.nodes.append(
            Node(
                robot=name,
                scan=report.scan,
                T_map_base=T_map_base,
                T_odom_base=report.T_odom_base,
                covariance=member.covariance,
                own_covariance=report.covariance,
                life=member.life,
            )
        )
        self._extend_track(member, report, T_map_odom)
        member.T_map_odom = T_map_odom
        member.last = report
        member.placed += 1
        self.dirty = self.dirty.union(box.shifted(*self.lattice))
        return Placement(True, moved)

    def _holds(self, scan: LaserScan, T_map_base: Pose2) -> bool:
        """Whether map and search stay within the limits if this scan is looked for here."""
        most = self.settings.largest_cells
        larger, _ = self.geometry.grown(*scan_extent(scan, T_map_base))
        # The search lays a square around the laser, as wide as its longest beams on both sides.
        longest = float(scan.ranges[scan.hits].max(initial=0.0)) / self.geometry.resolution
        square = (2.0 * longest) ** 2
        edge = max(larger.rows, larger.cols)
        return larger.rows * larger.cols <= most and square <= most and edge <= LARGEST_EDGE

    def _extend_track(self, member: Member, report: Report, T_map_odom: Pose2) -> None:
        """Append the corrected poses since the last report; the correction grows along the way."""
        rows = report.track_odom
        if not len(rows):
            return
        T_before = member.T_map_odom if member.track or member.placed else T_map_odom
        corrected = np.empty_like(rows)
        for k, (stamp, x, y, theta) in enumerate(rows.tolist()):
            T_blend = interpolate(T_before, T_map_odom, (k + 1) / len(rows))
            pose = T_blend @ Pose2(x, y, theta)
            corrected[k] = stamp, pose.x, pose.y, wrap_angle(pose.theta)
        member.track.append(corrected)

    def _last_pose(self, name: str) -> Pose2 | None:
        """Return where a robot was last in the team's map, or None."""
        member = self.members[name]
        return member.T_map_odom @ member.last.T_odom_base if member.last else None
