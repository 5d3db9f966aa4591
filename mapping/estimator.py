"""What every estimator of a robot's own way can do, whatever it works by.

Odometry and scans go in, step by step; the pose now comes out of each step, and at the end the way
as all of it together has it. An estimator never sees a clock, a file or the truth, so a robot in a
team and a recorded log feed it alike. A new one is one file and one row in
`robot_agent.estimators.ESTIMATORS`; a conformance test over that table tests it by its existing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mapping.geometry import Floats, Pose2
from mapping.grid import OccupancyGrid
from mapping.pose_graph import PoseGraph
from mapping.scan import LaserScan


@dataclass(frozen=True, slots=True)
class Estimate:
    """What the robot believes after one step.

    Attributes:
        T_odom_base: its pose in the frame of its own map.
        covariance: (3, 3) of (x, y, theta), odom frame, relative to the map around it.
        matched: whether a scan was matched and agrees with the map.
        inserted: whether the scan was inserted into the map.
    """

    T_odom_base: Pose2
    covariance: Floats
    matched: bool
    inserted: bool


@dataclass(frozen=True, slots=True, eq=False)
class OthersScan:
    """What somebody else saw.

    Attributes:
        author: who: a name, and which life of its software.
        number: which of the author's scans it is.
        scan: the ranges.
        T_odom_base: where its author says that it was taken, in the frame of the robot's own map.
    """

    author: tuple[str, int]
    number: int
    scan: LaserScan
    T_odom_base: Pose2


class Estimator(Protocol):
    """Keeps the pose of one robot, and its own map, up to date.

    Made from `mapping.incremental_slam.SlamSettings` (all that estimators have in common, such as
    the noise of the wheels) and a `numpy.random.Generator`, which not all of them use.

    Attributes:
        T_odom_base: the pose now, in the frame of the robot's own map.
        covariance: (3, 3) of (x, y, theta), odom frame.
    """

    T_odom_base: Pose2
    covariance: Floats

    def step(self, T_before_after: Pose2, scan: LaserScan | None) -> Estimate:
        """Take in one odometry increment, and the scan taken at its end if there is one.

        Args:
            T_before_after: pose of the base after the motion in the base before it, as the wheels
                tell it.
            scan: may be None.
        """
        ...

    def finish(self) -> None:
        """All is in: put right what only hindsight can."""
        ...

    def trajectory(self) -> Floats:
        """Return the pose at each scan taken in, (n, 3) of x, y [m], theta [rad], as known now.

        In the order of the steps, in one frame, which is the odom frame up to what was put right.
        """
        ...

    def pose_graph(self) -> PoseGraph | None:
        """Return the graph whose optimum the trajectory is; None where there is none."""
        ...

    def occupancy(self) -> OccupancyGrid:
        """Return the map as known now, in the frame of `trajectory`."""
        ...


@runtime_checkable
class TakesOthersScans(Protocol):
    """What an estimator may do besides: place the robot by what others saw, too."""

    def take_others(self, scans: Sequence[OthersScan]) -> None:
        """Take in all that others saw, in place of all that was told by this before.

        None of it may be the robot's own: what an estimator made of its scans must not come back
        to it as if somebody else had seen the same.

        Args:
            scans: ordered by author and number; where they lie may be told anew at any time.
        """
        ...
