"""Where robots start: a world's own places, more beside them, and a check of given ones."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from mapping.geometry import Pose2
from mapping.grid import GridGeometry
from sim_world.errors import WorldError
from sim_world.scene import Scene
from sim_world.truth import Mask, body_places

BODY_RADIUS = 0.25
# Distance between robots that start side by side [m].
SPACING = 0.8
# Room around a body that starts at a place we choose [m].
_ELBOW_ROOM = 0.1


def start_poses(
    scene: Scene, starts: Sequence[Pose2], count: int, body_radius: float = BODY_RADIUS
) -> list[Pose2]:
    """Return `count` start poses, always the same ones for the same world.

    The world's own come first; more robots stand around the first one, `SPACING` apart, nearest
    first as the robot drives. A world without any starts at the left of its largest free part.

    Args:
        scene: what is solid.
        starts: the world's own starts.
        count: number of robots.
        body_radius: [m].

    Raises:
        WorldError: there is no room for so many.
    """
    poses = list(starts[:count])
    if len(poses) == count:
        return poses
    solid, geometry = scene.free_truth()
    places = body_places(solid, geometry, body_radius + _ELBOW_ROOM)
    if not poses:
        poses.append(_leftmost(places, geometry))
    # At least two bodies and a little air apart, however large the bodies are.
    spacing = max(SPACING, 2.0 * body_radius + _ELBOW_ROOM)
    first = poses[0]
    for x, y in _around(places, geometry, first):
        if len(poses) == count:
            break
        if all(math.hypot(x - p.x, y - p.y) >= spacing for p in poses):
            poses.append(Pose2(x, y, first.theta))
    if len(poses) < count:
        raise WorldError(
            f"there is room for {len(poses)} robots around the first start, not for {count}; "
            "start fewer robots or give starts"
        )
    return poses


def _leftmost(places: Mask, geometry: GridGeometry) -> Pose2:
    """Return the leftmost place of the largest connected part, heading right."""
    parts, count = label(places)
    if count == 0:
        raise WorldError("there is no free place large enough for a robot in this world")
    largest = 1 + int(np.bincount(parts.ravel())[1:].argmax())
    columns = np.nonzero((parts == largest).any(axis=0))[0]
    rows = np.nonzero(parts[:, columns[0]] == largest)[0]
    x, y = geometry.centre_of(int(rows[len(rows) // 2]), int(columns[0]))
    return Pose2(x, y, 0.0)


def _around(places: Mask, geometry: GridGeometry, first: Pose2) -> Iterator[tuple[float, float]]:
    """Yield the places (x, y) [m] that can be driven to from `first`, nearest first."""
    start = _nearest(places, geometry, first.x, first.y)
    if start is None:
        return
    seen = np.zeros(geometry.shape, dtype=np.bool_)
    seen[start] = True
    queue = deque([start])
    while queue:
        iy, ix = queue.popleft()
        yield geometry.centre_of(iy, ix)
        for there in ((iy + 1, ix), (iy - 1, ix), (iy, ix + 1), (iy, ix - 1)):
            if geometry.holds(*there) and places[there] and not seen[there]:
                seen[there] = True
                queue.append(there)


def _nearest(places: Mask, geometry: GridGeometry, x: float, y: float) -> tuple[int, int] | None:
    """Return the place nearest to (x, y) [m], the first in grid order of several; None if none."""
    cells = np.argwhere(places)
    if len(cells) == 0:
        return None
    off = geometry.centres_of(cells) - np.array([x, y])
    iy, ix = cells[int((off**2).sum(axis=1).argmin())]
    return int(iy), int(ix)


def check_starts(scene: Scene, poses: Sequence[Pose2], body_radius: float = BODY_RADIUS) -> None:
    """Refuse starts at which robots would stand in a wall or in each other.

    Args:
        scene: what is solid.
        poses: start of robot 1, 2, ...
        body_radius: [m].

    Raises:
        WorldError: names the robot, the place, and the nearest free place.
    """
    for i, pose in enumerate(poses):
        taken = poses[:i]
        if scene.collides(pose.x, pose.y, body_radius):
            reason = "something solid is there"
        elif any(pose.distance_to(other) < 2.0 * body_radius for other in taken):
            reason = "another robot starts there"
        else:
            continue
        raise WorldError(
            f"robot {i + 1} cannot start at ({pose.x:.2f}, {pose.y:.2f}): {reason}; "
            + _advice(scene, pose, taken, body_radius)
        )


def _advice(scene: Scene, pose: Pose2, taken: Sequence[Pose2], body_radius: float) -> str:
    """Return the end of a sentence on where there is a free place."""
    solid, geometry = scene.free_truth()
    places = body_places(solid, geometry, body_radius)
    occupied = np.ones(geometry.shape, dtype=np.bool_)
    for other in taken:
        iy, ix = geometry.cell_at(other.x, other.y)
        if geometry.holds(iy, ix):
            occupied[iy, ix] = False
    if not occupied.all():
        room = 2.0 * body_radius + geometry.resolution
        places &= distance_transform_edt(occupied) * geometry.resolution >= room
    cell = _nearest(places, geometry, pose.x, pose.y)
    if cell is None:
        return "there is no free place in this world"
    x, y = geometry.centre_of(*cell)
    return f"the nearest free place is ({x:.2f}, {y:.2f})"
