"""Where the members of a team without a master are, by the beacons they send."""

from __future__ import annotations

import numpy as np

from protocol.messages import TeamPoses
from protocol.peer_messages import Beacon, LastHeard

# A member that knows its place no better than this does not know it [m].
PLACED_M = 0.3


class Crew:
    """What was last heard of everybody, oneself included.

    Attributes:
        beacons: by name, the newest.
        stamps: by name, when it was sent [s], mission time, but never later than it was heard.
        left: by name, where one was that was started anew since.
    """

    def __init__(self) -> None:
        self.beacons: dict[str, Beacon] = {}
        self.stamps: dict[str, float] = {}
        self.left: dict[str, LastHeard] = {}

    def hear(self, name: str, beacon: Beacon, stamp: float, now: float) -> bool:
        """Take a beacon; return whether it is newer than what was heard before.

        A sender whose clock is ahead counts as if it spoke now. Otherwise it would be here for
        longer than it is, and nothing that it says once its clock is right would be heard.

        Args:
            name: who sent it.
            beacon: what it says.
            stamp: when, by the sender's clock [s], mission time.
            now: mission time [s].
        """
        stamp = min(stamp, now)
        if stamp <= self.stamps.get(name, -1.0):
            return False
        before = self.beacons.get(name)
        if before is not None and before.life < beacon.life and before.sigma_m <= PLACED_M:
            self.left[name] = LastHeard(
                life=before.life, stamp_s=max(self.stamps[name], 0.0), T_map_base=before.T_map_base
            )
        self.beacons[name], self.stamps[name] = beacon, stamp
        return True

    def last_heard(self, name: str) -> LastHeard | None:
        """Return where one was before it was started anew, if it does not know where it is."""
        lost = name in self.beacons and self.beacons[name].sigma_m > PLACED_M
        return self.left.get(name) if lost else None

    def heard_within(self, period: float, now: float) -> list[str]:
        """Return who was heard in the last `period` [s], sorted."""
        return sorted(name for name, stamp in self.stamps.items() if now - stamp <= period)

    @property
    def unplaced(self) -> tuple[float, ...]:
        """The radii [m] of all who do not know where they are, each once."""
        radii = {b.radius_m: None for b in self.beacons.values() if b.sigma_m > PLACED_M}
        return tuple(sorted(radii))

    @property
    def seeking(self) -> bool:
        """Whether somebody does not know its place yet: who does tells no error."""
        return any(beacon.sigma_m > 0.0 for beacon in self.beacons.values())

    def bodies(self, since: float) -> list[tuple[str, float, float, float]]:
        """Return where those stand that know their place: name, x, y and radius [m], map frame.

        Args:
            since: of whom nothing was heard after this [s] may be anywhere, and is left out.
        """
        return [
            (name, beacon.T_map_base.x, beacon.T_map_base.y, beacon.radius_m)
            for name, beacon in sorted(self.beacons.items())
            if beacon.sigma_m <= PLACED_M and self.stamps[name] >= since
        ]

    def forget(self, name: str) -> None:
        """Forget a member that is not listened to any more."""
        self.beacons.pop(name, None)
        self.stamps.pop(name, None)
        self.left.pop(name, None)

    def team_poses(self, since: float = -1.0) -> TeamPoses:
        """Return where everybody is, except for those who do not know it.

        Args:
            since: of whom nothing was heard after this [s] may be anywhere, and is left out.
        """
        names = sorted(
            name
            for name in self.beacons
            if self.beacons[name].sigma_m <= PLACED_M and self.stamps[name] >= since
        )
        heard = [self.beacons[name] for name in names]
        rows = [(self.stamps[name], *self.beacons[name].T_map_base.as_tuple()) for name in names]
        paths = [beacon.path_map for beacon in heard]
        return TeamPoses(
            robots=tuple(names),
            poses_map=np.array(rows, dtype=np.float64).reshape(-1, 4),
            radii_m=np.array([beacon.radius_m for beacon in heard], dtype=np.float32),
            uncertainty_m=np.array([beacon.sigma_m for beacon in heard], dtype=np.float32),
            paths_map=np.concatenate([np.zeros((0, 2), np.float32), *paths]).astype(np.float32),
            path_lengths=tuple(len(path) for path in paths),
            busy=tuple(beacon.busy for beacon in heard),
        )
