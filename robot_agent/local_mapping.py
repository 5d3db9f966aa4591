"""The robot's own mapping: odometry and scans in, its pose and numbered reports out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from mapping.estimator import OthersScan, TakesOthersScans
from mapping.geometry import IDENTITY, Floats, Pose2
from mapping.incremental_slam import SlamSettings
from mapping.match_map import MapSettings
from mapping.motion_model import MotionModel
from mapping.scan import LaserScan
from protocol.body import Body
from protocol.fields import NO_POINTS
from protocol.messages import ScanReport
from robot_agent.estimators import make_estimator
from robot_agent.settings import LocalMapSettings


class LocalMapping:
    """Local SLAM and the log of reports that the server may not have yet.

    Attributes:
        T_odom_base: the pose now, in the frame of the robot's own map.
        scan: the last scan, or None.
        scans: number of scans taken.
        matched: whether the last scan agreed with the map.
    """

    def __init__(
        self, body: Body, settings: LocalMapSettings, estimator: str, rng: np.random.Generator
    ) -> None:
        """Begin at the origin of the robot's own map.

        Args:
            body: its lidar and its wheels.
            settings: what to report.
            estimator: by whose word, see `robot_agent.estimators`.
            rng: for estimators that draw lots.

        Raises:
            EstimatorError: there is no such estimator.
        """
        self._settings = settings
        self._lidar = body.lidar
        drive = body.drive
        # A model surer of itself than half a percent would leave scans no say in it.
        motion = MotionModel(
            distance_sigma=max(drive.noise_distance, 0.005),
            drift_sigma=max(math.radians(drive.noise_heading_deg_m), 0.002),
            rotation_sigma=max(drive.noise_turn, 0.005),
        )
        slam = SlamSettings(map=MapSettings(resolution=settings.resolution_m), motion=motion)
        self._slam = make_estimator(estimator, slam, rng)
        self.T_odom_base = IDENTITY
        self.scan: LaserScan | None = None
        self.scans = 0
        self.matched = False
        self._T_wheel_slam: Pose2 | None = None
        self._track: list[tuple[float, float, float, float]] = []
        self._sightings: list[Floats] = []
        self._victims: list[Floats] = []
        self._log: dict[int, ScanReport] = {}
        self._number = 0
        self._since_report = 0
        self._T_odom_reported: Pose2 | None = None
        self._resent = -math.inf
        self._stamps: list[float] = []
        self._reported: list[int] = []  # which scan each report was of, from 0

    def move(self, T_wheel_base: Pose2) -> None:
        """Follow the wheels between scans."""
        if self._T_wheel_slam is None:
            self._T_wheel_slam = T_wheel_base
        T_slam_base = self._T_wheel_slam.inverse() @ T_wheel_base
        self.T_odom_base = self._slam.T_odom_base @ T_slam_base

    def take(self, scan: LaserScan, T_wheel_base: Pose2) -> None:
        """Take in a scan made at `T_wheel_base`."""
        if self._T_wheel_slam is None:
            self._T_wheel_slam = T_wheel_base
        estimate = self._slam.step(self._T_wheel_slam.inverse() @ T_wheel_base, scan)
        self._T_wheel_slam = T_wheel_base
        self.T_odom_base, self.matched = estimate.T_odom_base, estimate.matched
        self.scan = scan
        self.scans += 1
        self._stamps.append(scan.stamp)
        self._since_report += 1
        pose = self.T_odom_base
        self._track.append((scan.stamp, pose.x, pose.y, pose.theta))

    def take_others(self, scans: Sequence[OthersScan]) -> None:
        """Tell the estimator all that others saw, odom frame, if it is one that takes it."""
        if isinstance(self._slam, TakesOthersScans):
            self._slam.take_others(scans)

    def sight(self, places_base: Floats) -> None:
        """Note where the last scan showed discs of a teammate's size, (k, 2) [m], base frame."""
        self._sightings.append(self._slam.T_odom_base.apply(places_base))

    def sight_victims(self, places_base: Floats) -> None:
        """Note where victims were made out with the last scan, (k, 2) [m], base frame."""
        if len(places_base):
            self._victims.append(self._slam.T_odom_base.apply(places_base))

    def report_due(self, aligned: bool, news: Callable[[LaserScan], float]) -> bool:
        """Whether the last scan is to be reported; a robot at rest has nothing new to tell.

        Args:
            aligned: whether the server has placed the robot in its map.
            news: tells how much [m2] a scan shows that the team's map does not have.
        """
        last = self._T_odom_reported
        if last is None:
            return self.scan is not None
        if self._since_report < self._settings.report_every:
            early = aligned and self._since_report >= self._settings.news_every
            if not early or self.scan is None or news(self.scan) < self._settings.news_m2:
                return False
        settings = self._settings
        turn = math.radians(settings.report_turned_deg)
        return not aligned or last.moved(self.T_odom_base, settings.report_moved_m, turn)

    @property
    def has_news(self) -> bool:
        """Whether the last scan has not been reported."""
        return self._since_report > 0

    def report(self) -> ScanReport:
        """Make a report of the last scan and keep it until the server has it."""
        scan = self.scan
        assert scan is not None
        self._number += 1
        report = ScanReport(
            number=self._number,
            stamp_s=scan.stamp,
            ranges=scan.ranges,
            bearing_start_rad=scan.bearing_start,
            bearing_step_rad=scan.bearing_step,
            range_max_m=scan.range_max,
            T_base_laser=scan.T_base_laser,
            T_odom_base=self._slam.T_odom_base,
            covariance=np.ascontiguousarray(self._slam.covariance),
            track_odom=np.array(self._track, dtype=np.float64).reshape(-1, 4)[-4096:],
            T_wheel_base=self._T_wheel_slam,
            sightings_odom=np.concatenate((NO_POINTS, *self._sightings)).astype(np.float32)[-256:],
            victims_odom=np.concatenate((NO_POINTS, *self._victims)).astype(np.float32)[-255:],
        )
        self._track.clear()
        self._sightings.clear()
        self._victims.clear()
        self._since_report = 0
        self._T_odom_reported = self._slam.T_odom_base
        self._log[self._number] = report
        self._reported.append(self.scans - 1)
        return report

    def track(self) -> tuple[Floats, Floats]:
        """Return stamps (n,) [s] and poses (n, 3) of all scans, odom frame, as known now."""
        return np.array(self._stamps), self._slam.trajectory()

    def reported_poses(self) -> Floats:
        """Return where the scan of each report was taken, (n, 3), odom frame, as known now."""
        poses: Floats = self._slam.trajectory()[self._reported]
        return poses

    def received(self, number: int, now: float) -> list[ScanReport]:
        """The server holds all reports up to `number`; return those it lacks, now and then."""
        for held in [n for n in self._log if n <= number]:
            del self._log[held]
        if number == self._number or now - self._resent < self._settings.resend_period_s:
            return []
        return self.missing(now)

    def missing(self, now: float) -> list[ScanReport]:
        """Return the oldest reports that the server does not confirm."""
        self._resent = now
        return [self._log[n] for n in sorted(self._log)[:20]]

    @property
    def unconfirmed(self) -> int:
        """Number of reports that the server has not confirmed."""
        return len(self._log)

    @property
    def reports(self) -> int:
        """Number of reports made."""
        return self._number
