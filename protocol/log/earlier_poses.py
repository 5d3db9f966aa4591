"""Where an author's first entries were by one of its revisions: differences are told to that."""

from __future__ import annotations

import numpy as np

from protocol.log.author_log import AuthorLog
from protocol.log.observation_log import ObservationLog
from protocol.log.pose_coding import PoseTable


def poses_of_first(log: AuthorLog, revision: PoseTable, count: int) -> PoseTable | None:
    """Return where the first entries were made, (count, 3), by a revision of an author's poses.

    Entries beyond the revision have the poses they were told with. None if one is not held.
    """
    numbers = range(len(revision) + 1, count + 1)
    if len(numbers) > len(log.entries) or any(n not in log.entries for n in numbers):
        return None
    told = [log.entries[n].what.pose for n in numbers]
    return np.concatenate((revision[:count], np.array(told, dtype=np.int32).reshape(-1, 3)))


def own_poses_at(
    log: ObservationLog, version: int | None, count: int
) -> tuple[int, PoseTable] | None:
    """Return a version and what this robot told then of its first entries, (count, 3).

    None if that is not known any more.
    """
    if version is None or version not in log.past:
        return None
    poses = poses_of_first(log.own, log.past[version], count)
    return None if poses is None else (version, poses)
