"""One robot's local estimator: its own pose and its own map, as it goes.

Source: Simmons et al. 2000, section "Coordinated Mapping".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mapping.correlative_search import SearchWindow
from mapping.estimator import Estimate
from mapping.geometry import IDENTITY, Floats, Pose2, wrap_angle
from mapping.grid import OccupancyGrid
from mapping.match_map import MapSettings, MatchMap
from mapping.motion_model import MotionModel
from mapping.scan import LaserScan
from mapping.scan_matching import MatchResult
from mapping.scan_points import scan_points

# A motion that is told at once and is larger may be old news [m], [rad].
_LEAP, _LEAP_TURN = 0.1, math.radians(5.0)
# Squared distance from what the wheels say beyond which a poor match is not believed (in three
# dimensions, one in ten thousand is farther away).
_GATE = 21.0
# Two scans that put the robot at the same place differ by no more than this [m], [rad].
_AGREED = (0.15, math.radians(5.0))


@dataclass(frozen=True, slots=True)
class SlamSettings:
    """How the local estimator works.

    Attributes:
        map: everything that shapes the map.
        motion: noise of the wheels.
        keyframe_distance: a scan is inserted after moving this far [m].
        keyframe_turn: or after turning this much [rad].
        refine_distance: a scan that is not inserted refines the walls after moving this far [m].
        refine_turn: or after turning this much [rad].
        search_sigma: search a window where the pose's standard deviation exceeds this [m].
        search_turn_sigma: or that of the heading exceeds this [rad].
        window_sigmas: size of that window in standard deviations.
        fit_least: with a smaller share of known end points explained, the pose is searched for in
            the wide window.
        fit_poor: where that finds nothing either, the first match counts down to this share.
        known_least: fewer known end points say nothing, for or against.
        wide: window of the search after a bad match.
        wide_covariance_scale: the prior's covariance is widened by this factor then.
        anchor_known: a scan of whose end points a smaller share than this falls where the map is
            known is weighed against the wheels since the last one that showed more of it, not
            against what the scans in between made of the same few walls: else these hold the
            robot back, step by step.
    """

    map: MapSettings = field(default_factory=MapSettings)
    motion: MotionModel = field(default_factory=MotionModel)
    keyframe_distance: float = 0.2
    keyframe_turn: float = math.radians(10.0)
    refine_distance: float = 0.04
    refine_turn: float = math.radians(2.0)
    search_sigma: float = 0.08
    search_turn_sigma: float = math.radians(3.0)
    window_sigmas: float = 3.0
    fit_least: float = 0.5
    fit_poor: float = 0.25
    known_least: int = 12
    wide: SearchWindow = field(default_factory=SearchWindow)
    wide_covariance_scale: float = 9.0
    anchor_known: float = 0.6


class IncrementalSlam:
    """Scan matching: the likeliest pose of each scan in the map of those before it.

    Attributes:
        settings: how it works.
        map: grid and walls in the odom frame, the frame of this robot's own map.
        T_odom_base: the pose now.
        covariance: (3, 3) of (x, y, theta), odom frame.
    """

    def __init__(
        self,
        settings: SlamSettings | None = None,
        rng: np.random.Generator | None = None,
        T_odom_base: Pose2 = IDENTITY,
    ) -> None:
        """Begin at a pose; nothing is drawn by lot, so `rng` is not used."""
        self.settings = settings or SlamSettings()
        self.map = MatchMap(self.settings.map)
        self.T_odom_base = T_odom_base
        self.covariance: Floats = np.diag([1e-6, 1e-6, 1e-8])
        # Where the robot is by the wheels since the map last knew most of what it saw.
        self._anchor, self._loose = T_odom_base, self.covariance
        # Where the last scan put the robot that fitted well only far from where it was thought.
        self._elsewhere: Pose2 | None = None
        self._T_odom_keyframe: Pose2 | None = None
        self._T_odom_refined = T_odom_base
        self._poses: list[tuple[float, float, float]] = []

    def step(self, T_before_after: Pose2, scan: LaserScan | None) -> Estimate:
        """Take in one odometry increment, and the scan taken at its end if there is one.

        Args:
            T_before_after: pose of the base after the motion in the base before it, as the wheels
                tell it.
            scan: may be None.
        """
        motion = self.settings.motion
        self.T_odom_base, self.covariance = motion.propagate(
            self.T_odom_base, self.covariance, T_before_after
        )
        self._anchor, self._loose = motion.propagate(self._anchor, self._loose, T_before_after)
        if self._elsewhere is not None:
            self._elsewhere = self._elsewhere @ T_before_after
        matched = inserted = False
        if scan is not None:
            matched, inserted = self._take(scan)
            self._poses.append(self.T_odom_base.as_tuple())
        return Estimate(self.T_odom_base, self.covariance, matched, inserted)

    def finish(self) -> None:
        """Nothing is put right afterwards: every pose stands as it was matched."""

    def trajectory(self) -> Floats:
        """Return the pose at each scan taken in, (n, 3) of x, y [m], theta [rad], odom frame."""
        return np.array(self._poses, dtype=np.float64).reshape(-1, 3)

    def pose_graph(self) -> None:
        """Return None: there is no graph."""

    def occupancy(self) -> OccupancyGrid:
        """Return the robot's own occupancy grid, odom frame."""
        return self.map.grid

    def _take(self, scan: LaserScan) -> tuple[bool, bool]:
        """Match a scan, correct the pose, insert the scan if due; return (matched, inserted)."""
        settings = self.settings
        if self._T_odom_keyframe is None:
            self._insert(scan, cautious=False)
            return True, True
        result = self._locate(scan)
        if result is None:
            return False, False
        self.T_odom_base, self.covariance = result.T_map_base, result.covariance
        if result.known >= settings.anchor_known * len(scan_points(scan)):
            self._anchor, self._loose = self.T_odom_base, self.covariance
        matched = result.known >= settings.known_least
        distance, turn = settings.keyframe_distance, settings.keyframe_turn
        if not self._T_odom_keyframe.moved(self.T_odom_base, distance, turn):
            self._refine(scan)
            return matched, False
        self._insert(scan, cautious=self._uncertain())
        return matched, True

    def _locate(self, scan: LaserScan) -> MatchResult | None:
        """Return where a scan was taken; None if it contradicts the map wherever it is tried."""
        settings = self.settings
        near = self.map.match(
            scan, self.T_odom_base, self._loose, self._window(), T_map_prior=self._anchor
        )
        before, self._elsewhere = self._elsewhere, None
        if not self._contradicts(near, settings.fit_least):
            return near
        for T_odom_guess in self._mishaps(before):
            far = self._search_wide(scan, T_odom_guess)
            if self._far_better(far, near):
                return self._found_again(far, before)
        # Things were moved, or the map is bent: even so it knows more than the wheels, if both say
        # much the same.
        if self._contradicts(near, settings.fit_poor) or self._unlikely(near):
            return None
        return near

    def _found_again(self, far: MatchResult, before: Pose2 | None) -> MatchResult | None:
        """Return a match from far away if the last scan put the robot there, too.

        A body close by that nobody told of fills half of a scan, and the rest may fit somewhere.
        """
        self._elsewhere = far.T_map_base
        if before is None or before.moved(far.T_map_base, *_AGREED):
            return None
        self._elsewhere = None
        self._anchor, self._loose = far.T_map_base, far.covariance
        return far

    def _mishaps(self, elsewhere: Pose2 | None) -> list[Pose2]:
        """Return where the robot may be after a mishap: near its guess, or near where it was.

        Wheels slip, and their word may come late, all at once. Where the last scan put the robot,
        if that was `elsewhere`, comes first.
        """
        places = [self.T_odom_base] if elsewhere is None else [elsewhere, self.T_odom_base]
        T_odom_last = Pose2(*self._poses[-1])
        moved = T_odom_last.moved(self.T_odom_base, _LEAP, _LEAP_TURN)
        return [*places, T_odom_last] if moved else places

    def _search_wide(self, scan: LaserScan, T_odom_guess: Pose2) -> MatchResult:
        """Match in the wide window around a pose, with a prior that allows for a mishap."""
        settings = self.settings
        covariance = settings.wide_covariance_scale * self.covariance
        covariance = covariance + np.diag([0.2**2, 0.2**2, math.radians(5.0) ** 2])
        return self.map.match(scan, T_odom_guess, covariance, settings.wide)

    def _far_better(self, far: MatchResult, near: MatchResult) -> bool:
        """Whether a match from far away explains half of what the one nearby does not, or more.

        Within a metre there is nearly always a place that looks a little more alike.
        """
        return far.known >= self.settings.known_least and far.fit >= 0.5 * (1.0 + near.fit)

    def _unlikely(self, result: MatchResult) -> bool:
        """Whether a match is farther from where the wheels put the robot than they may err."""
        off = result.T_map_base.as_array() - self._anchor.as_array()
        off[2] = wrap_angle(off[2])
        return float(off @ np.linalg.solve(self._loose, off)) > _GATE

    def _contradicts(self, result: MatchResult, fit_least: float) -> bool:
        """Whether enough end points fall where the map is known, and too few of them at walls."""
        return result.known >= self.settings.known_least and result.fit < fit_least

    def _sigmas(self) -> tuple[float, float]:
        """Return the largest standard deviation in position [m] and that of the heading [rad]."""
        c = self.covariance
        middle = 0.5 * (c[0, 0] + c[1, 1])
        spread = math.hypot(0.5 * (c[0, 0] - c[1, 1]), c[0, 1])
        return math.sqrt(middle + spread), math.sqrt(c[2, 2])

    def _uncertain(self) -> bool:
        """Whether the pose is too uncertain for a local ascent, or to argue with the map."""
        sigma, turn_sigma = self._sigmas()
        settings = self.settings
        return sigma > settings.search_sigma or turn_sigma > settings.search_turn_sigma

    def _window(self) -> SearchWindow | None:
        """Return the window to search before the ascent, or None if the guess is good enough."""
        if not self._uncertain():
            return None
        sigma, turn_sigma = self._sigmas()
        n = self.settings.window_sigmas
        return SearchWindow(n * sigma, n * turn_sigma, self.settings.wide.turn_step)

    def _insert(self, scan: LaserScan, cautious: bool) -> None:
        """Insert the scan at the pose believed now."""
        self.map.insert(scan, self.T_odom_base, cautious)
        self._T_odom_keyframe = self._T_odom_refined = self.T_odom_base

    def _refine(self, scan: LaserScan) -> None:
        """Let a scan that is not inserted sharpen the walls it sees, if it shows them anew.

        What is drawn at a pose that is wrong by a fraction of a degree stays in the map, and all
        that follows is matched with it; over several poses in a row such errors average out.
        """
        settings = self.settings
        distance, turn = settings.refine_distance, settings.refine_turn
        if self._T_odom_refined.moved(self.T_odom_base, distance, turn):
            self.map.refine(scan, self.T_odom_base)
            self._T_odom_refined = self.T_odom_base
