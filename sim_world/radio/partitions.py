"""Who is cut off from whom, and when: outages, partitions, one-way links."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from sim_world.radio.settings import OneWay, Partition


@dataclass(frozen=True, slots=True)
class Outage:
    """A time during which a robot's radio is cut off: start <= t < end [s]."""

    robot: str
    start: float
    end: float


class Cuts:
    """All scheduled cuts of a mission.

    Args:
        outages: radios that are silent and deaf.
        partitions: groups that do not hear each other.
        one_way: links without a way back.
    """

    def __init__(
        self,
        outages: Iterable[Outage] = (),
        partitions: Iterable[Partition] = (),
        one_way: Iterable[OneWay] = (),
    ) -> None:
        self._outages = tuple(outages)
        self._partitions = tuple(
            (p.start_s, p.start_s + p.duration_s, _sides(p)) for p in partitions
        )
        self._dead_ways = frozenset((link.listener, link.speaker) for link in one_way)

    def off(self, name: str, now: float) -> bool:
        """Whether a member's radio is cut off at `now` [s]."""
        return any(o.robot == name and o.start <= now < o.end for o in self._outages)

    def parted(self, sender: str, receiver: str, now: float) -> bool:
        """Whether frames of `sender` cannot get to `receiver` at `now` [s]."""
        if (sender, receiver) in self._dead_ways:
            return True
        return any(
            start <= now < end and side.get(sender, -1) != side.get(receiver, -1)
            for start, end, side in self._partitions
        )


def _sides(partition: Partition) -> dict[str, int]:
    """Return the group of each member that is named in one."""
    return {name: k for k, group in enumerate(partition.groups) for name in group}
