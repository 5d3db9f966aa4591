"""Takes in the robots' scan reports, in the order of their numbers, and places them in the map."""

from __future__ import annotations

import numpy as np

from protocol.effects import Effect, Send
from protocol.fault_book import FaultBook
from protocol.messages import PoseUpdate, ReportsReceived, ScanReport
from protocol.reported_scan import scan_of
from server.map_merger import MapMerger, Report
from server.roster import Roster
from server.teammates import Disc, disc_of, without_teammates

_TOO_FAR = "too far away: the map would exceed server.merger.largest_cells"


class ReportIntake:
    """Places reports and makes the answers to them.

    Args:
        merger: builds the team's map.
        roster: knows where teammates are, which must not become walls.
        teammate_margin: around each teammate [m].
        faults: where reports that are refused are counted.
    """

    def __init__(
        self, merger: MapMerger, roster: Roster, teammate_margin: float, faults: FaultBook
    ) -> None:
        self._merger = merger
        self._roster = roster
        self._margin = teammate_margin
        self._faults = faults
        self._received: dict[str, int] = {}

    def begin(self, name: str) -> None:
        """A robot begins a life: its reports count from 1."""
        self._received[name] = 0

    def take(self, name: str, message: ScanReport) -> list[Effect]:
        """Place a report if it is the next of its robot, and answer the robot.

        A report that is refused counts as received: the robot must not send it for ever.
        """
        if name not in self._received:
            return []
        if message.number != self._received[name] + 1:
            return [Send("fleet", name, ReportsReceived(number=self._received[name]))]
        self._received[name] = message.number
        member = self._merger.members[name]
        guess = member.T_map_odom @ message.T_odom_base
        discs = self.discs(name, message.stamp_s)
        scan = without_teammates(scan_of(message), guess, discs)
        report = Report(
            scan,
            message.T_odom_base,
            message.covariance,
            message.track_odom,
            message.T_wheel_base,
            message.sightings_odom.astype(np.float64),
        )
        placement = self._merger.place(name, report)
        notes = self._faults.enter("a report", name, _TOO_FAR) if placement.too_far else []
        received = ReportsReceived(number=message.number)
        update = self._update(name, placement.matched)
        answers: list[Effect] = [*notes, Send("fleet", name, received), Send("fleet", name, update)]
        if placement.redrawn:
            answers += [
                Send("fleet", other, self._update(other, True))
                for other in self._roster.present()
                if other != name and self._merger.members[other].aligned
            ]
        return answers

    def _update(self, name: str, matched: bool) -> PoseUpdate:
        """Return where a robot's local map lies in the team's by its last report."""
        return PoseUpdate(
            number=self._received[name],
            T_map_odom=self._merger.members[name].T_map_odom,
            uncertainty_m=self._merger.uncertainty(name),
            matched=matched,
        )

    def discs(self, observer: str, stamp: float) -> list[Disc]:
        """Return where all robots but one may be at `stamp` [s]."""
        return [
            disc_of(
                where,
                self._merger.members[name].T_map_odom,
                self._merger.uncertainty(name),
                self._margin,
                stamp,
            )
            for name, where in self._roster.where.items()
            if name != observer
        ]
