"""Particle filter SLAM: many guesses of the way so far, each with the map that belongs to it.

Source: Grisetti, Stachniss & Burgard 2007, "Improved techniques for grid mapping with
Rao-Blackwellized particle filters", Algorithm 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from mapping.estimator import Estimate, OthersScan
from mapping.geometry import IDENTITY, Floats, Pose2, pose_from
from mapping.grid import OccupancyGrid
from mapping.incremental_slam import SlamSettings
from mapping.others_map import OthersMap
from mapping.particle_history import ParticleHistory
from mapping.particle_maps import ParticleMaps
from mapping.particle_settings import ParticleSettings
from mapping.pose_cloud import composed, drawn, turned
from mapping.resampling import effective_sample_size, normalized, systematic_resample
from mapping.scan import LaserScan
from mapping.scan_map import ScanMap
from mapping.scan_points import scan_points
from mapping.seen_free import count_contradictions

# So many of the last scans inserted may contradict a pose.
_VIEWS = 8
# A robot that is lost may be this far [m], [rad] from where it is thought to be (one sigma), over
# and above what the wheels' noise tells.
_LOST, _LOST_TURN = 0.3, math.radians(8.0)
# Blur of the walls when it is looked for, in sigmas of the likelihood.
_LOST_WIDENINGS = np.array([6.0, 3.0, 1.0])


class ParticleFilter:
    """Rao-Blackwellized particle filter: 30 guesses of the way, each with its own map.

    Between updates the scans are matched to the map of the best particle alone.

    Attributes:
        settings: what all estimators have in common.
        particles: what is special to this one.
        poses: (particles, 3) where each of them has the robot since the last update, map frame.
        weights: (particles,), sum 1.
        best: the particle with the most evidence in all its history.
        T_odom_base: the pose now, as the best particle has it.
        covariance: (3, 3) of (x, y, theta), odom frame, relative to its map.
    """

    def __init__(
        self,
        settings: SlamSettings | None = None,
        rng: np.random.Generator | None = None,
        particles: ParticleSettings | None = None,
        T_odom_base: Pose2 = IDENTITY,
    ) -> None:
        """Begin at a pose with an empty map; `rng` is what the particles are drawn with."""
        self.settings = settings or SlamSettings()
        self.particles = particles or ParticleSettings()
        count = self.particles.count
        self.poses: Floats = np.tile(T_odom_base.as_array(), (count, 1))
        self.best = 0
        self.T_odom_base = T_odom_base
        self.covariance: Floats = np.diag([1e-6, 1e-6, 1e-8])
        self._rng = rng or np.random.default_rng(0)
        self._log_weights: Floats = np.zeros(count)
        self._evidence: Floats = np.zeros(count)
        self._maps = ParticleMaps(count, self.settings.map, self.particles.walls)
        self._others = OthersMap(self.settings.map, self.particles.walls)
        self._history = ParticleHistory()
        # The way since the last update, as scans matched to the best particle's map show it, and
        # the covariance that the wheels alone would give it, in the frame of its beginning.
        self._T_keyframe_base = IDENTITY
        self._wheels: Floats = np.zeros((3, 3))
        self._keyframes: list[LaserScan] = []
        self._T_odom_last = T_odom_base
        self._between: list[tuple[Pose2, Floats]] = []
        self._scans: list[tuple[int, float, float, float]] = []
        # Where the robot is by the wheels since the map last knew nearly all that it saw.
        self._anchor, self._loose = T_odom_base, self.covariance
        self._explained = 0  # end points of the last scan that lie at walls of the map

    @property
    def weights(self) -> Floats:
        """The weights of the particles, (particles,), sum 1."""
        return normalized(self._log_weights)

    def step(self, T_before_after: Pose2, scan: LaserScan | None) -> Estimate:
        """Take in one odometry increment, and the scan taken at its end if there is one.

        Args:
            T_before_after: pose of the base after the motion in the base before it, as the wheels
                tell it.
            scan: may be None.
        """
        self._move(T_before_after)
        matched = inserted = False
        if scan is not None:
            matched, inserted = self._take(scan, scan_points(scan))
            self._scans.append((len(self._keyframes) - 1, *self._T_keyframe_base.as_tuple()))
        return Estimate(self.T_odom_base, self.covariance, matched, inserted)

    def take_others(self, scans: Sequence[OthersScan]) -> None:
        """Take in all that others saw, see `TakesOthersScans`.

        It counts from the next update on: what scans are matched with stays the same in between.
        """
        self._others.tell(scans)

    def finish(self) -> None:
        """Nothing is put right afterwards: the best particle is known all along."""

    def trajectory(self) -> Floats:
        """Return the best particle's pose at each scan, (n, 3) of x, y [m], theta [rad]."""
        if not self._scans:
            return np.zeros((0, 3))
        path = self._history.path(self.best)
        scans = np.array(self._scans)
        return composed(path[scans[:, 0].astype(np.int64)], scans[:, 1:])

    def pose_graph(self) -> None:
        """Return None: there is no graph."""

    def occupancy(self) -> OccupancyGrid:
        """Return the map of the best particle, in the frame of `trajectory`: drawn when asked."""
        drawn_map = ScanMap(self.settings.map.resolution, self.settings.map.integration)
        for number, (scan, T_odom_base) in enumerate(self._views()):
            drawn_map.observe(number, scan.within(self.particles.free_reach), T_odom_base)
        return drawn_map.grid()

    def _move(self, T_before_after: Pose2) -> None:
        """Follow the wheels."""
        self._T_odom_last = self.T_odom_base
        motion = self.settings.motion
        self.T_odom_base, self.covariance = motion.propagate(
            self.T_odom_base, self.covariance, T_before_after
        )
        self._anchor, self._loose = motion.propagate(self._anchor, self._loose, T_before_after)
        self._T_keyframe_base, self._wheels = motion.propagate(
            self._T_keyframe_base, self._wheels, T_before_after
        )

    def _take(self, scan: LaserScan, points: Floats) -> tuple[bool, bool]:
        """Take in a scan after a motion; return whether it was matched, and inserted."""
        if not self._keyframes:
            self._begin(scan, points)
            return True, True
        known = self._track(scan, points)
        if known is None:
            return False, False
        due = self._due() or self._short_sighted(points)
        if due:
            self._update(scan, points)
        elif self._shows_anew():
            self._between.append((self._T_keyframe_base, points))
        return known >= self.settings.known_least, due

    def _track(self, scan: LaserScan, points: Floats) -> int | None:
        """Correct the pose by a scan; return how many end points are known, None for a mismatch.

        Scans that show much that the map does not know are matched to the same few walls again and
        again. Each is weighed against the wheels since the last one that the map knew well, not
        against what the ones before it made of them: else they hold the robot back, step by step.
        """
        pose, covariance, _, explained = self._maps.match(
            self.best, points, self.T_odom_base.as_array(), self._anchor.as_array(), self._loose
        )
        known, fit = self._judge(scan, points, pose, explained)
        self._explained = explained
        if fit < self.settings.fit_least:
            far_pose, far_covariance, far_explained = self._search(points)
            far_known, far_fit = self._judge(scan, points, far_pose, far_explained)
            if far_known >= self.settings.known_least and far_fit >= 0.5 * (1.0 + fit):
                pose, covariance, known = far_pose, far_covariance, far_known
                explained = len(points)
            elif fit < self.settings.fit_poor:
                return None
        self.T_odom_base, self.covariance = pose_from(pose), covariance
        if explained >= self.particles.anchor_seen * len(points):
            self._anchor, self._loose = self.T_odom_base, self.covariance
        self._T_keyframe_base = pose_from(self.poses[self.best]).inverse() @ self.T_odom_base
        return known

    def _judge(
        self, scan: LaserScan, points: Floats, pose: Floats, explained: int
    ) -> tuple[int, float]:
        """Return how many end points the map knows of, and the share at walls (1 if it knows few).

        Args:
            scan: the scan.
            points: its end points.
            pose: (3,) of the base, odom frame.
            explained: how many of the end points lie at walls.
        """
        if 2 * explained >= len(points):
            return explained, 1.0
        views = self._views(max(0, len(self._keyframes) - _VIEWS))
        known = explained + count_contradictions(scan, pose_from(pose), views)
        return known, explained / known if known >= self.settings.known_least else 1.0

    def _search(self, points: Floats) -> tuple[Floats, Floats, int]:
        """Look for the robot all around: return the likeliest pose, its covariance, and the fit.

        Wheels slip, and their word may come late, all at once: half of the guesses are around where
        the robot was last.
        """
        spread = 9.0 * self.covariance + np.diag([_LOST**2, _LOST**2, _LOST_TURN**2])
        centres = np.empty((self.particles.guesses, 3))
        centres[::2] = self._T_odom_last.as_array()
        centres[1::2] = self.T_odom_base.as_array()
        found = [
            self._maps.match(self.best, points, guess, guess, spread, _LOST_WIDENINGS)
            for guess in drawn(centres, np.tile(spread, (len(centres), 1, 1)), self._rng)
        ]
        pose, covariance, _, explained = max(found, key=lambda match: match[2])
        return pose, covariance, explained

    def _views(self, since: int = 0) -> list[tuple[LaserScan, Pose2]]:
        """Return the scans inserted at updates, from one on, and where the best particle was."""
        path = self._history.path(self.best, since)
        return [
            (scan, pose_from(pose))
            for scan, pose in zip(self._keyframes[since:], path, strict=True)
        ]

    def _due(self) -> bool:
        """Whether the robot has moved or turned enough for an update."""
        particles = self.particles
        return IDENTITY.moved(
            self._T_keyframe_base, particles.update_distance, particles.update_turn
        )

    def _short_sighted(self, points: Floats) -> bool:
        """Whether much of what a scan shows is not on the map yet, and the robot has moved on.

        What is new there is easily taken for the walls that are known next to it.
        """
        particles = self.particles
        little = self._explained < particles.update_seen * len(points)
        return little and IDENTITY.moved(
            self._T_keyframe_base, particles.update_least, particles.update_turn
        )

    def _shows_anew(self) -> bool:
        """Whether a scan between updates shows the walls anew: see `SlamSettings`."""
        T_keyframe_last = self._between[-1][0] if self._between else IDENTITY
        settings = self.settings
        return T_keyframe_last.moved(
            self._T_keyframe_base, settings.refine_distance, settings.refine_turn
        )

    def _begin(self, scan: LaserScan, points: Floats) -> None:
        """Start all maps with the first scan."""
        self.poses[:] = self.T_odom_base.as_array()
        self._close_update(scan, np.arange(self.particles.count))
        self._maps.insert([(points, self.poses)])

    def _update(self, scan: LaserScan, points: Floats) -> None:
        """Update all particles with a scan.

        Source: Grisetti, Stachniss & Burgard 2007, Algorithm 1. As the weights do not depend on the
        poses drawn, these are drawn after resampling: so copies of one particle differ.
        """
        predicted = composed(self.poses, self._T_keyframe_base.as_array())
        means, covariances, evidence = self._match(points, predicted)
        self._weigh(evidence)
        parents = self._resample()
        poses = drawn(means[parents], covariances[parents], self._rng)
        self._maps.insert([*self._placed_between(parents), (points, poses)])
        self.poses = poses
        self.T_odom_base = pose_from(poses[self.best])
        self.covariance = covariances[parents[self.best]]
        self._anchor, self._loose = self.T_odom_base, self.covariance
        self._close_update(scan, parents)

    def _match(self, points: Floats, predicted: Floats) -> tuple[Floats, Floats, Floats]:
        """Return each particle's proposal: means (n, 3), covariances (n, 3, 3), log evidence (n,).

        Source: Grisetti, Stachniss & Burgard 2007, section III-A; sums over samples around the
        best match are replaced by the Gaussian with the curvature there.
        """
        means, evidence = np.empty_like(predicted), np.empty(len(predicted))
        covariances = np.empty((len(predicted), 3, 3))
        for i, mean in enumerate(predicted):
            prior = turned(self._wheels, self.poses[i, 2])
            means[i], covariances[i], value, _ = self._maps.match(i, points, mean, mean, prior)
            evidence[i] = value + 0.5 * np.linalg.slogdet(covariances[i])[1]
        return means, covariances, evidence

    def _weigh(self, evidence: Floats) -> None:
        """Multiply the weights by the evidence (n,)."""
        gain = self.particles.evidence_weight * (evidence - evidence.max())
        self._log_weights += gain
        self._log_weights -= self._log_weights.max()
        self._evidence += gain

    def _resample(self) -> npt.NDArray[np.int64]:
        """Draw the particles anew if few of them have most of the weight; return the parents."""
        weights = self.weights
        count = len(weights)
        parents = np.arange(count)
        if effective_sample_size(weights) < self.particles.resample_below * count:
            parents = systematic_resample(weights, self._rng)
            self._maps.inherit(parents)
            self._evidence = self._evidence[parents]
            self._log_weights = np.zeros(count)
        self.best = self._best_of(parents)
        return parents

    def _best_of(self, parents: npt.NDArray[np.int64]) -> int:
        """Return the best particle: an heir of the one so far, if no other is far better."""
        best = int(self._evidence.argmax())
        heirs = np.flatnonzero(parents == self.best)
        if len(heirs) == 0:
            return best
        heir = int(heirs[self._evidence[heirs].argmax()])
        return heir if self._evidence[best] - self._evidence[heir] <= self.particles.stay else best

    def _placed_between(self, parents: npt.NDArray[np.int64]) -> list[tuple[Floats, Floats]]:
        """Return the scans since the last update, with the poses (n, 3) of the particles then."""
        before = self.poses[parents]
        return [
            (points, composed(before, T_keyframe_scan.as_array()))
            for T_keyframe_scan, points in self._between
        ]

    def _close_update(self, scan: LaserScan, parents: npt.NDArray[np.int64]) -> None:
        """Remember the poses of an update, and begin the way to the next."""
        self._others.follow()
        self._maps.others = self._others.walls
        self._history.append(self.poses, parents)
        self._keyframes.append(replace(scan))  # without the points found in it
        self._between.clear()
        self._T_keyframe_base = IDENTITY
        self._wheels = np.zeros((3, 3))
