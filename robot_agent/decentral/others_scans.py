"""What others saw, as a robot's own estimator may use it."""

from __future__ import annotations

from mapping.estimator import OthersScan
from mapping.geometry import Pose2
from mapping.scan import LaserScan
from mapping.shared_map import Author, SharedMap
from mapping.team_map import PlacedScan
from protocol.log.sync import LogSync


class OthersScans:
    """All scans that are held but those of this start of the robot, which its estimator has seen.

    What the robot itself saw before it was started anew counts as another's. Whoever is isolated
    tells wrong things: what it saw is on the map still, as on everybody's, but places nobody.

    Args:
        sync: who is isolated, and who the robot is.
        shared: the scans, and where they were made.
    """

    def __init__(self, sync: LogSync, shared: SharedMap) -> None:
        self._sync = sync
        self._shared = shared
        self._told: tuple[object, ...] = ()

    def placed(self, kept: int) -> list[tuple[LaserScan, Pose2]]:
        """Return the scans and where they were made, map frame.

        Args:
            kept: so many of the robot's own entries were written before it was started.
        """
        return [(seen.scan, seen.T_map_base) for seen in self._seen(kept)]

    def news(self, kept: int, held: int, T_map_own: Pose2) -> list[OthersScan] | None:
        """Return the scans as an estimator takes them; None if they are the same as last time.

        Args:
            kept: see `placed`.
            held: checksum of all that is held.
            T_map_own: where the frame of the robot's own map lies in the team's.
        """
        told = held, tuple(self._sync.standing.isolated), kept, T_map_own
        if told == self._told:
            return None
        self._told = told
        T_own_map = T_map_own.inverse()
        return [
            OthersScan(seen.author, seen.number, seen.scan, T_own_map @ seen.T_map_base)
            for seen in self._seen(kept)
        ]

    def _seen(self, kept: int) -> list[PlacedScan[Author]]:
        isolated = self._sync.standing.isolated
        scans = self._shared.scans(self._sync.log.me, kept)
        return [seen for seen in scans if seen.author[0] not in isolated]
