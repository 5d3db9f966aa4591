"""The scripted faults of a mission, as cuts of links and strikes in order of time."""

from __future__ import annotations

from collections.abc import Sequence

from sim_world.radio.partitions import Outage
from sim_world.settings import ScriptedFault


def outages(faults: Sequence[ScriptedFault]) -> tuple[Outage, ...]:
    """Return the cuts of radio links among the scripted faults."""
    return tuple(
        Outage(fault.robot, fault.at_s, fault.at_s + fault.duration_s)
        for fault in faults
        if fault.kind == "cut_link"
    )


def schedule(faults: Sequence[ScriptedFault]) -> list[tuple[float, str, str]]:
    """Return the strikes (time, robot, kind) of the scripted faults, in order of time."""
    strikes = []
    for fault in faults:
        if fault.kind == "freeze":
            strikes.append((fault.at_s, fault.robot, "freeze"))
            strikes.append((fault.at_s + fault.duration_s, fault.robot, "thaw"))
        elif fault.kind != "cut_link":
            strikes.append((fault.at_s, fault.robot, fault.kind))
    return sorted(strikes)
