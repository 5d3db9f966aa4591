"""Where the team's map lies in the world: the one transform under which all results are judged."""

from __future__ import annotations

from expedition.results.record import RunRecord
from expedition.results.tracks import as_track
from mapping.geometry import Pose2
from sim_world.truth import fit_team


def transform_to_world(record: RunRecord) -> Pose2 | None:
    """Return the one `T_world_map` of the team, or None where no true trajectory is known."""
    truth = {r.id: as_track(r.track_world) for r in record.robots if r.track_world is not None}
    estimated = {r.id: as_track(r.track_map) for r in record.robots}
    if not any(len(track) and len(estimated[robot]) for robot, track in truth.items()):
        return None
    return fit_team(estimated, truth)
