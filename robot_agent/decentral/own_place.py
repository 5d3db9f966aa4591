"""Where a robot's own map lies in the team's: told exactly, found, or not known yet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from mapping.geometry import IDENTITY, Pose2
from mapping.placed_by_sight import Guess
from protocol.log.sync import LogSync
from protocol.messages import SERVER, ScanReport
from protocol.peer_messages import LastHeard, Lookout
from protocol.world_messages import Joined
from robot_agent.decentral.alignment import Placed
from robot_agent.decentral.lookouts import Frame, Lookouts
from robot_agent.decentral.mending import Mending
from robot_agent.decentral.settings import TyingSettings
from robot_agent.decentral.tying import Standing, Tying, Whereabouts, left_at, told_at_start


class OwnPlace:
    """Finds where the robot's own map lies in the team's.

    Args:
        sync: what is held of the robot's earlier lives shows where it was seen last.
        settings: when it is sure.
        reference: whether this robot stands where it was told by definition: the others fit theirs.
        left: where the robot wrote down that it was when its software ended, map frame.

    Attributes:
        T_map_own: where its own map lies; None while that is not known.
        lookouts: who saw whom from the start.
    """

    def __init__(
        self, sync: LogSync, settings: TyingSettings, reference: bool, left: Pose2 | None = None
    ) -> None:
        self.T_map_own: Pose2 | None = None
        self.lookouts = Lookouts(sync.log.me.robot, settings.sight_period_s)
        self._sync = sync
        self._settings = settings
        self._reference = reference
        self._left = left
        self._first = True  # whether it stands where it was told
        self._heard: LastHeard | None = None  # where others last heard it, before it started anew
        self._told = Whereabouts(IDENTITY, (0.0, 0.0))
        self._errors = (0.0, 0.0)
        self._tying = Tying(settings)
        self._mending = Mending(settings)
        self._since: float | None = None  # when it began to look
        self._settled = False  # it took what it was told for true, as nobody was there to ask

    def begin(self, joined: Joined, first: bool) -> None:
        """Take in where the robot was told it starts.

        Args:
            joined: says so.
            first: whether it stands there, and was not started anew somewhere.
        """
        self._told = told_at_start(joined)
        self._errors = joined.start_sigma_m, math.radians(joined.start_sigma_deg)
        self._first = first
        if first and (self._reference or joined.start_sigma_m <= self._settings.start_m):
            self.T_map_own = self._told.T_map_own

    @property
    def uncertain(self) -> bool:
        """Whether starts are told with errors that count, this robot's or not."""
        return self._errors[0] > self._settings.start_m

    @property
    def whereabouts(self) -> Whereabouts:
        """Where the robot's own map lies in the team's, as far as it knows."""
        if self.T_map_own is None:
            return self._thought
        return Whereabouts(self.T_map_own, self._thought.sigma if self._settled else (0.0, 0.0))

    @property
    def _thought(self) -> Whereabouts:
        """Where it lies as far as the robot was told, or as it was when its software ended."""
        return (
            self._told
            if self._first
            else left_at(self._sync, self._left, self._heard_at, self._told)
        )

    @property
    def _heard_at(self) -> Pose2 | None:
        return None if self._heard is None else self._heard.T_map_base

    def hear(self, word: LastHeard) -> None:
        """Take in where a teammate last heard this robot before it was started anew."""
        if word.life < self._sync.log.me.life:
            newest = self._heard is None or word.stamp_s > self._heard.stamp_s
            self._heard = word if newest else self._heard

    def see(self, report: ScanReport) -> None:
        """Take in whom the robot saw from its start."""
        if self._first:
            self.lookouts.see(report)

    def wait(self, report: ScanReport, now: float) -> None:
        """Keep what the robot saw until it knows where that was."""
        self._since = now if self._since is None else self._since
        self._tying.add(report)

    @property
    def waiting(self) -> list[ScanReport]:
        """What the robot saw that waits until it knows where that was."""
        return self._tying.waiting

    def alone_due(self, now: float) -> bool:
        """Whether it waited so long that it had better explore on its own."""
        return self._waited(now) >= self._settings.alone_s

    def settle_due(self, now: float) -> bool:
        """Whether it waited for long, and nobody is there who could tell where it is.

        That is so if it heard nobody; or if nobody told what he saw, as the first robot is not
        there, and none whose name comes before its own was heard: then it stands in for the first.
        """
        if self._waited(now) < self._settings.settle_s:
            return False
        heard = self._heard_lately(now)
        leads = self._first and not self._told_of
        return not heard or (leads and self._sync.log.me.robot < heard[0])

    def settle(self, now: float) -> list[ScanReport]:
        """Take the robot's own map to lie where it is thought to; return all that waited for that.

        What others saw, once they are heard, may mend it. One that stands in for the first robot is
        sure of its place: the map is where it says.
        """
        self.T_map_own, self._settled = self._thought.T_map_own, not self._heard_lately(now)
        return self._tying.take()

    def _heard_lately(self, now: float) -> list[str]:
        """Return the robots that it heard within the time in which it would settle, sorted."""
        heard = self._sync.peers.heard_within(self._settings.settle_s, now)
        return sorted(name for name in heard if name != SERVER)

    @property
    def _told_of(self) -> bool:
        """Whether somebody has told what it saw."""
        log = self._sync.log
        return any(log.of(author).entries for author in log.authors())

    def _waited(self, now: float) -> float:
        """Return for how long what the robot saw has waited for its place [s]; 0 if it does not."""
        if self.T_map_own is not None or self._since is None:
            return 0.0
        return now - self._since

    def lookout_due(self, now: float) -> Lookout | None:
        """Return whom the robot saw from its start, for the others, if it is time."""
        frame = Frame(self.whereabouts.T_map_own, self._errors, self.T_map_own is not None)
        return self.lookouts.due(frame, self._sync.log.me.life, now)

    def due(self, held: int, now: float) -> bool:
        """Whether it is time to look anew where the robot's own map lies.

        Args:
            held: checksum of all that the robot holds.
            now: mission time [s].
        """
        return self.T_map_own is None and self._tying.due(held, now)

    def find(
        self,
        scans: Sequence[Placed],
        teammates: Sequence[Standing],
        resolution: float,
        held: int,
        now: float,
    ) -> list[ScanReport]:
        """Look whether what the robot saw fits what was seen around there before.

        Args:
            scans: what others saw, and where, map frame.
            teammates: those who know where they are.
            resolution: edge of a cell to match with [m].
            held: checksum of all that the robot holds.
            now: mission time [s].

        Returns:
            All that waited, if the robot knows now where that was.
        """
        guesses = self.guesses(now)
        self.T_map_own = self._tying.attempt(scans, guesses, teammates, resolution, held, now)
        return [] if self.T_map_own is None else self._tying.take()

    def guesses(self, now: float) -> Iterator[Guess]:
        """Return where the robot's own map may lie, the surest first."""
        told = Frame(self._thought.T_map_own, self._errors, aligned=False)
        seen = self.lookouts.guess(told) if self._first else None
        if seen is not None:
            yield seen
        since = now if self._since is None else self._since
        if not self._first or now - since >= self._settings.sight_wait_s:
            yield self._thought.guess

    def mend(
        self, own: Sequence[Placed], others: Sequence[Placed], resolution: float, now: float
    ) -> bool:
        """Look whether the robot's own map lies where it is thought to; return whether it moved.

        Args:
            own: what the robot saw, and where in its own map, in order.
            others: what others saw to whom it fits itself, and where, map frame.
            resolution: edge of a cell to match with [m].
            now: mission time [s].
        """
        if self.T_map_own is None:
            return False
        guesses = self.guesses(now)
        better = self._mending.look(own, others, self.T_map_own, guesses, resolution)
        self.T_map_own = better or self.T_map_own
        self._settled &= better is None
        return better is not None

    def mend_due(self, held: int, now: float) -> bool:
        """Whether to look again if the robot's own map lies where it is thought to.

        Args:
            held: checksum of all that the robot holds.
            now: mission time [s].
        """
        found = self.T_map_own is not None and self._since is not None
        return found and self._mending.due(held, now)
