"""The central mapper: places every robot's scans in one team map.

The same matcher that a robot runs against its own map is run here against the team's, starting from
the robot's locally corrected pose: "basically the same software runs at both levels" (Simmons et
al. 2000, section "Coordinated Mapping"). The first scan of the first robot defines the map frame.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.comparing import firm_match
from mapping.correlative_search import SearchWindow
from mapping.geometry import Floats, Pose2
from mapping.grid import GridGeometry
from mapping.loop_search import LoopSearch
from mapping.match_map import MapSettings, MatchMap
from mapping.motion_model import MotionModel
from mapping.mutual_sightings import MutualSightings
from mapping.pose_graph import carried_covariance, turned_covariance
from mapping.scan_integration import IntegrationSettings
from mapping.scan_matching import MatchResult
from mapping.submap_graph import SubmapGraph
from mapping.trail import Trail
from mapping.way import Report, Way, corrected_track, way_between
from server.limits import holds
from server.placing import TOO_FAR, Member, Node, Placement, node_tracks
from server.settings import MergerSettings
from server.tying import aligns, contradicts, guesses, match_held, search_window

__all__ = ["MapMerger", "Member", "Node", "Placement", "Report"]

_WIDEST = SearchWindow()  # where a robot is looked for whose reports contradict the map


class MapMerger:
    """Builds the team's map.

    Attributes:
        map: the team's map and what matching needs of it.
        sightings: who saw whom from the start.
        members: by robot's name.
        nodes: all placed scans, in order.
        team: the pose graph that holds the scans together.
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
        self.team = SubmapGraph(settings.loops, self.map.settings)
        self._loops = LoopSearch(self.team)
        self.sightings = MutualSightings()
        self.members: dict[str, Member] = {}
        self.nodes: list[Node] = []
        self._trails: dict[str, Trail] = {}
        self._settled = 0  # how many edges there were when the map was put right last
        self.dirty = EMPTY_BOX

    def take_changes(self) -> tuple[CellBox, npt.NDArray[np.float32]]:
        """Return the rectangle of cells that changed since the last call, and their log-odds.

        The rectangle's indices are those of the lattice through the origin, so they stay valid when
        the map grows.
        """
        box, self.dirty = self.dirty, EMPTY_BOX
        rows, cols = self.geometry.lattice
        return box, self.log_odds[box.shifted(-rows, -cols).slices]

    def add(
        self,
        name: str,
        T_map_start: Pose2,
        sigma: float,
        turn_sigma: float,
        motion: MotionModel | None = None,
    ) -> None:
        """Take a robot in that was told to start at `T_map_start`, within the errors [m], [rad].

        A robot that starts anew comes back here with an empty local map of its own; its track and
        its scans stay.
        """
        known = self.members.get(name)
        covariance = np.diag([sigma**2, sigma**2, turn_sigma**2]) + np.diag([1e-4, 1e-4, 1e-5])
        motion, told = motion or MotionModel(), (sigma, turn_sigma)
        if known is None:
            self.members[name] = Member(T_map_start, covariance, told, motion)
            return
        self.sightings.forget(name)
        restart = self._last_pose(name) or T_map_start
        self.members[name] = Member(
            restart, covariance, told, motion, placed=known.placed, life=known.life + 1
        )

    def place(self, name: str, report: Report) -> Placement:
        """Place a report in the team's map; the robot's alignment follows."""
        member = self.members[name]
        if not self._holds(report, member.T_map_odom @ report.T_odom_base):
            return TOO_FAR
        if len(report.sightings_odom):
            self.sightings.add(name, report.T_odom_base, report.covariance, report.sightings_odom)
        if member.aligned:
            return self._follow(name, member, report)
        return self._tie(name, member, report)

    def _follow(self, name: str, member: Member, report: Report) -> Placement:
        """Place a report of a robot that is tied to the team's map.

        Where the scan closes a loop with an error, all scans of the team move, and the map is drawn
        again.
        """
        assert member.last is not None
        track = np.concatenate((*member.untold, report.track_odom))
        way = way_between(member.last, report, track, member.motion)
        guess = member.T_map_odom @ member.last.T_odom_base @ way.T_last_base
        prior = self._prior(member, guess, way)
        result = self._match(report, guess, prior, member.unmatched)
        stray = contradicts(result, self.settings)
        T_map_base = guess
        if not stray:
            T_map_base = firm_match(self.map, report.scan, guess, prior, result).T_map_base
        found = self._loops.around(name, report.scan, T_map_base, way)
        if stray and not found:
            member.unmatched += 1
            member.untold.append(report.track_odom)
            return Placement(False, 0.0)
        if not self._holds(report, T_map_base):
            return TOO_FAR
        member.covariance = member.covariance if stray else result.covariance
        node = self._extend(name, report, T_map_base, way)
        redrawn = False
        if self.team.strained(self.team.connect_loops(node, found)) or stray:
            self.team.settle()
            member.covariance = self.team.chains[name].covariance
            redrawn = self._redraw()
            T_map_base = self.team.graph.pose(node)
        self._insert(name, member, report, T_map_base @ report.T_odom_base.inverse())
        return Placement(True, guess.distance_to(T_map_base), redrawn=redrawn)

    def _holds(self, report: Report, T_map_base: Pose2) -> bool:
        """Whether the map stays within its limits with a report at a pose."""
        return holds(self.geometry, self.settings.largest_cells, report.scan, T_map_base)

    def _match(self, report: Report, guess: Pose2, prior: Floats, unmatched: int) -> MatchResult:
        """Match a report with the team's map, in a wider window if it contradicts the map.

        The window grows with every report in a row that does: a robot does not leap, and somewhere
        within a metre there is nearly always a place that looks alike.
        """
        result = self.map.match(report.scan, guess, prior, search_window(prior, self.settings))
        if contradicts(result, self.settings):
            wide = self.settings.wide_scale * prior + np.diag([0.04, 0.04, 0.01])
            share = min(0.25 * (1 + unmatched), 1.0)
            window = SearchWindow(share * _WIDEST.reach, share * _WIDEST.turn)
            result = self.map.match(report.scan, guess, wide, window)
        return result

    def _tie(self, name: str, member: Member, report: Report) -> Placement:
        """Tie a robot's local map to the team's, or keep its report until that is possible.

        The robot that comes first defines the map frame. Of the others all reports so far are
        matched together: what they saw in all directions says more than one view of a corridor.
        """
        if self.map.scans == 0:
            member.aligned = True
            member.covariance = np.diag([1e-4, 1e-4, 1e-5])
            self._begin(name, member, [report], member.T_map_odom, member.covariance)
            return Placement(True, 0.0)
        member.held.append(report)
        if len(member.held) <= self.settings.sight_wait:
            return Placement(False, 0.0)
        for guess in guesses(name, self.members, self.sightings):
            result = match_held(self.map, member.held, guess)
            if aligns(result, len(member.held), self.settings):
                T_map_odom = result.T_map_base @ report.T_odom_base.inverse()
                return self._tied(name, member, T_map_odom, result.covariance)
            if guess.seen and not contradicts(result, self.settings):
                return self._tied(name, member, guess.T_map_odom, guess.covariance)
        return Placement(False, 0.0)

    def _tied(self, name: str, member: Member, T_map_odom: Pose2, covariance: Floats) -> Placement:
        """Insert what a robot told so far, where its local map was found to lie."""
        moved = member.T_map_odom.distance_to(T_map_odom)
        member.covariance, member.aligned = covariance, True
        waiting, member.held = member.held, []
        self._begin(name, member, waiting, T_map_odom, covariance)
        return Placement(True, moved)

    def settle(self) -> bool:
        """Put the map right by all that is known; return whether it was drawn again."""
        graph = self.team.graph
        if len(graph.edges) == self._settled:
            return False
        self.team.settle()
        self._loops.consolidate()
        self.team.settle()
        self.reject_wrong()
        self._settled = len(graph.edges)
        return self._redraw()

    def reject_wrong(self) -> None:
        """Take comparisons out of the graph that all others contradict; no pose moves."""
        self.team.graph.reject(self.settings.loops.reject_above)

    def track(self, name: str) -> Floats:
        """Return the corrected poses of a robot, (n, 4): stamp, x, y, theta, map frame."""
        member = self.members[name]
        tracks = node_tracks(node for node in self.nodes if node.robot == name)
        T_map_odom = member.T_map_odom
        untold = [corrected_track(rows, T_map_odom, T_map_odom) for rows in member.untold]
        return np.concatenate((np.zeros((0, 4)), *tracks, *untold))

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

    def _prior(self, member: Member, guess: Pose2, way: Way) -> Floats:
        """Return the covariance of the guess: the last match's, and what the way since added."""
        settings = self.settings
        drift, turn_drift = settings.drift_m, math.radians(settings.drift_deg)
        assert member.last is not None
        before = member.T_map_odom @ member.last.T_odom_base
        carried = carried_covariance(member.covariance, guess.x - before.x, guess.y - before.y)
        grown = carried + turned_covariance(way.covariance, -guess.theta)
        return grown + np.diag([drift**2, drift**2, turn_drift**2])

    def _begin(
        self,
        name: str,
        member: Member,
        reports: list[Report],
        T_map_odom: Pose2,
        covariance: Floats,
    ) -> None:
        """Insert the first reports of a robot; its way through the pose graph begins with them."""
        graph = self.team.graph
        for k, report in enumerate(reports):
            T_map_base = T_map_odom @ report.T_odom_base
            if k == 0:
                nearest = graph.nearest(T_map_base)
                node = self.team.begin(name, report.scan, T_map_base, covariance)
                self._trails[name] = Trail(self.settings.loops.spans_m)
                self._trails[name].begin(node, report)
                if nearest is not None:
                    T_near_base = graph.pose(nearest).inverse() @ T_map_base
                    turned = turned_covariance(covariance, T_map_base.theta)
                    self.team.tie(nearest, node, T_near_base, turned)
            else:
                assert member.last is not None
                way = way_between(member.last, report, report.track_odom, member.motion)
                self._extend(name, report, T_map_base, way)
            self._insert(name, member, report, T_map_odom)

    def _extend(self, name: str, report: Report, T_map_base: Pose2, way: Way) -> int:
        """Add a node to a robot's way, tied to the one before and to some long before."""
        node = self.team.extend(name, report.scan, T_map_base, way)
        for span in self._trails[name].add(node, report, way):
            self.team.span(span, node)
        return node

    def _insert(self, name: str, member: Member, report: Report, T_map_odom: Pose2) -> None:
        """Insert a scan at its corrected pose."""
        T_map_base = T_map_odom @ report.T_odom_base
        box = self.map.insert(report.scan, T_map_base)
        track = np.concatenate((*member.untold, report.track_odom))
        member.untold = []
        self.nodes.append(
            Node(
                robot=name,
                scan=report.scan,
                T_map_base=T_map_base,
                T_odom_base=report.T_odom_base,
                life=member.life,
                track_odom=track,
            )
        )
        member.T_map_odom = T_map_odom
        member.last = report
        member.unmatched = 0
        member.placed += 1
        self.dirty = self.dirty.union(box.shifted(*self.geometry.lattice))

    def _redraw(self) -> bool:
        """Draw the whole map again where the pose graph moved its scans; return whether it did."""
        if not self.team.astray([node.T_map_base for node in self.nodes]):
            return False
        old = self.geometry
        self.map = MatchMap(self.map.settings)
        far_x = old.origin_x + (old.cols - 0.5) * old.resolution
        far_y = old.origin_y + (old.rows - 0.5) * old.resolution
        half = 0.5 * old.resolution
        self.map.grow(old.origin_x + half, old.origin_y + half, far_x, far_y)
        for k, node in enumerate(self.nodes):
            T_map_base = self.team.graph.pose(k)
            self.nodes[k] = replace(node, T_map_base=T_map_base)
            if self.members[node.robot].aligned:
                self.members[node.robot].T_map_odom = self.nodes[k].T_map_odom
        self.map.insert_all((node.scan, node.T_map_base) for node in self.nodes)
        geometry = self.geometry
        whole = CellBox(0, 0, geometry.rows, geometry.cols)
        self.dirty = self.dirty.union(whole.shifted(*self.geometry.lattice))
        return True

    def _last_pose(self, name: str) -> Pose2 | None:
        """Return where a robot was last in the team's map, or None."""
        member = self.members[name]
        return member.T_map_odom @ member.last.T_odom_base if member.last else None
