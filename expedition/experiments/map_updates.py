"""What a team told each other about their map, as a sequence of updates in the order of time.

A robot tells of each observation it makes, and, whenever its belief about its way has changed, of
the new poses of its earlier ones: "the robot r_j would simply broadcast new pose estimates".

Source: Pfingsthorn et al. 2007, section 2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mapping.geometry import Pose2, pose_from
from mapping.scan import LaserScan


@dataclass(frozen=True, slots=True)
class MapUpdate:
    """One update of the map.

    Attributes:
        stamp: when it was made [s].
        scan: the new observation; None when only poses of earlier ones changed.
        T_map_laser: where the laser was when the scan was taken; None without a scan.
        moved: the new poses of earlier observations, by their number: how many observations the
            updates before it brought first. Of all that are told, changed or not.
    """

    stamp: float
    scan: LaserScan | None
    T_map_laser: Pose2 | None
    moved: Mapping[int, Pose2] = field(default_factory=dict)


def map_updates(
    observations: Sequence[Mapping[str, Any]], repositionings: Sequence[Mapping[str, Any]]
) -> list[MapUpdate]:
    """Return the updates that a run's observations and changes of mind make.

    New poses that a robot tells at the instant of an observation of its own go with that one
    observation, as in the paper; others make an update without a scan. Of several tellings of one
    robot at one instant the last counts.

    Args:
        observations: `{t_s, robot, number, ranges, pose, bearing_start, bearing_step, range_max}`,
            in the order of being taken: ranges (beams,) float32 [m], pose (3,) x, y [m], theta
            [rad] of the laser in the map frame, bearings [rad], range_max [m].
        repositionings: `{t_s, robot, poses}`: poses (m, 3) of the robot's first m observations.
    """
    told = {(float(r["t_s"]), str(r["robot"])): r["poses"] for r in repositionings}
    numbers: dict[str, list[int]] = {}
    # An observation comes before new poses of the same instant, which may speak of it, too.
    happened = [(float(o["t_s"]), 0, k) for k, o in enumerate(observations)]
    happened += [(t, 1, k) for k, (t, _) in enumerate(told)]
    last = {(float(o["t_s"]), str(o["robot"])): k for k, o in enumerate(observations)}
    moments = list(told)
    updates: list[MapUpdate] = []
    count = 0
    for stamp, kind, k in sorted(happened):
        if kind == 1:
            robot = moments[k][1]
            if moments[k] not in last:
                moved = _moved(numbers.get(robot, []), told[moments[k]])
                updates.append(MapUpdate(stamp, None, None, moved))
            continue
        observation = observations[k]
        robot = str(observation["robot"])
        own = numbers.setdefault(robot, [])
        own.append(count)
        joined = told.get((stamp, robot), ()) if last[stamp, robot] == k else ()
        moved = _moved(own, joined)
        pose = moved.pop(count, pose_from(np.asarray(observation["pose"], dtype=np.float64)))
        updates.append(MapUpdate(stamp, _scan_of(observation), pose, moved))
        count += 1
    return updates


def _moved(numbers: Sequence[int], poses: Any) -> dict[int, Pose2]:
    """Return new poses (m, 3) by the numbers of the observations they are of."""
    table = np.asarray(poses, dtype=np.float64).reshape(-1, 3)
    return {number: pose_from(row) for number, row in zip(numbers, table, strict=False)}


def _scan_of(observation: Mapping[str, Any]) -> LaserScan:
    return LaserScan(
        np.asarray(observation["ranges"], dtype=np.float32),
        float(observation["bearing_start"]),
        float(observation["bearing_step"]),
        float(observation["range_max"]),
        float(observation["t_s"]),
    )
