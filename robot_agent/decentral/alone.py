"""The map that a robot drives by while it does not know where it is: of what it saw itself.

One that stood still would never see what tells it where that is.
"""

from __future__ import annotations

from collections.abc import Iterable

from mapping.geometry import Pose2
from mapping.shared_map import MapView, SharedMap
from mapping.team_map import TeamMap
from protocol.messages import ScanReport
from protocol.reported_scan import scan_of

_ME = ("me", 0)


class OwnMap:
    """Draws what one robot saw, as if its own map lay where it is thought to.

    Args:
        T_map_own: there.
        reports: what it saw so far.
        like: the team's map, whose cells and limits it shares.

    Attributes:
        T_map_own: see above.
        view: the map, for who follows it.
    """

    def __init__(
        self, T_map_own: Pose2, reports: Iterable[ScanReport], like: TeamMap[tuple[str, int]]
    ) -> None:
        team = TeamMap[tuple[str, int]](
            like.resolution, like.integration, (like.bounds.ix1 - like.bounds.ix0) ** 2
        )
        shared = SharedMap(team)
        self.T_map_own = T_map_own
        self.view: MapView = shared.view()
        self._team = team
        for report in reports:
            self.observe(report)

    def observe(self, report: ScanReport) -> None:
        """Take in what the robot saw."""
        T_map_base = self.T_map_own @ report.T_odom_base
        self._team.observe(_ME, report.number, scan_of(report), T_map_base)
