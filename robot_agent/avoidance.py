"""What the robot may drive right now without touching anything its lidar sees.

The robot is a disc, so turning on the spot is always safe and only the way of its centre matters:
an arc is free as far as no seen point comes nearer to the centre than the radius and a gap.
"""

from __future__ import annotations

import math

import numpy as np

from mapping.compiled import compiled
from mapping.geometry import Floats

# Neighbouring beams whose end points are within this distance see one surface [m].
SAME_SURFACE = 0.12
# How far the check moves along an arc from one look to the next [m].
ARC_STEP = 0.04
# When arcs are compared, what they pass within the first steps is the same for all.
UNAVOIDABLE = 3
# Nearer than this to what is seen, beyond `reach`, an arc is the worse [m], and by how much [m/m].
COMFORT = 0.06
CLOSENESS_COST = 3.0
# What is nearer than wanted already must not come nearer still, but for this much [m].
ESCAPE_SLACK = 0.004
# A body that is predicted to come is looked for at the time the arc gets there; a robot that
# creeps would look too far ahead, so time along an arc passes as at this speed at least [m/s].
SLOWEST_FOR_TIME = 0.25


@compiled
def calmed(points: Floats) -> Floats:
    """Return scan points (n, 2) [m] with part of the range noise averaged out.

    Each point becomes the mean of itself and up to two neighbours on either side that lie on the
    same surface; single beams keep their place. The points must be in the order of their beams.
    """
    count = len(points)
    result = np.empty_like(points)
    for k in range(count):
        x, y, used = points[k, 0], points[k, 1], 1
        for side in (-1, 1):
            for away in (1, 2):
                j = k + side * away
                if j < 0 or j >= count:
                    break
                dx, dy = points[j, 0] - points[k, 0], points[j, 1] - points[k, 1]
                if dx * dx + dy * dy > SAME_SURFACE * SAME_SURFACE:
                    break
                x += points[j, 0]
                y += points[j, 1]
                used += 1
        result[k, 0], result[k, 1] = x / used, y / used
    return result


@compiled
def free_way(
    points_base: Floats,
    reach: float,
    bodies: Floats,
    curvature: float,
    speed: float,
    watch: float,
    skip: int,
) -> tuple[float, float, bool]:
    """Return how far the robot can drive along an arc.

    Args:
        points_base: (n, 2) [m], what the lidar sees, base frame.
        reach: the least distance from the centre to any point [m]: radius and gap.
        bodies: (m, 5) teammates in the base frame: x, y [m], speed vx, vy [m/s], least distance
            between centres [m].
        curvature: of the arc [1/m], positive to the left.
        speed: at which the arc would be driven [m/s].
        watch: how far to look [m].
        skip: for so many steps of the arc, and where the robot is, the distance to points is not
            counted; 0 counts all.

    Returns:
        The free length [m], at most `watch`; the least distance [m] from the centre to any point
        on that length; whether a teammate is what ends it.
    """
    nearest = 1e9
    near = np.empty(len(points_base), dtype=np.int64)
    count = 0
    horizon = watch + reach + 0.5
    for k in range(len(points_base)):
        d2 = points_base[k, 0] ** 2 + points_base[k, 1] ** 2
        if d2 < horizon * horizon:
            near[count] = k
            count += 1
            if skip == 0:
                nearest = min(nearest, d2)
    pace = max(speed, SLOWEST_FOR_TIME)
    steps = math.ceil(watch / ARC_STEP)
    for step in range(1, steps + 1):
        length = step * ARC_STEP
        turned = curvature * length
        if abs(turned) < 1e-6:
            x, y = length, 0.5 * curvature * length * length
        else:
            x, y = math.sin(turned) / curvature, (1.0 - math.cos(turned)) / curvature
        for m in range(len(bodies)):
            when = length / pace
            bx, by = bodies[m, 0] + bodies[m, 2] * when, bodies[m, 1] + bodies[m, 3] * when
            least = bodies[m, 4]
            now_away = math.hypot(bodies[m, 0], bodies[m, 1])
            away = math.hypot(bx - x, by - y)
            if away < min(least, now_away - ESCAPE_SLACK * step):
                return length - ARC_STEP, math.sqrt(nearest), True
        for i in range(count):
            px, py = points_base[near[i], 0], points_base[near[i], 1]
            d2 = (px - x) ** 2 + (py - y) ** 2
            if d2 < reach * reach:
                now_away = math.sqrt(px * px + py * py)
                if now_away >= reach or math.sqrt(d2) < now_away - ESCAPE_SLACK:
                    return length - ARC_STEP, math.sqrt(nearest), False
            if step > skip:
                nearest = min(nearest, d2)
    return watch, math.sqrt(nearest), False


@compiled
def best_curvature(
    points_base: Floats,
    reach: float,
    bodies: Floats,
    curvatures: Floats,
    speed: float,
    watch: float,
    target_x: float,
    target_y: float,
) -> tuple[float, float]:
    """Return the arc that leads best to a target on a free way, and how near it gets.

    An arc is the better the nearer it leads to the target, and the farther from what is seen up to
    a comfortable distance: in a narrow place that draws the robot to the middle.

    Args:
        points_base: (n, 2) [m], base frame.
        reach: as in `free_way` [m].
        bodies: (m, 5), as in `free_way`.
        curvatures: (k,) [1/m], the arcs to choose from; of equally good ones the first.
        speed: at which they would be driven [m/s].
        watch: how far to look [m].
        target_x: where to [m], base frame.
        target_y: [m].

    Returns:
        The curvature [1/m] and the distance [m] left to the target where the arc comes nearest to
        it; no arc that can be driven for less than two steps is chosen, and if none is left the
        distance is that from where the robot stands.
    """
    chosen, least_left, least = 0.0, math.hypot(target_x, target_y), 1e9
    for k in range(len(curvatures)):
        curvature = curvatures[k]
        length, nearest, _ = free_way(
            points_base, reach, bodies, curvature, speed, watch, UNAVOIDABLE
        )
        if length < 2.0 * ARC_STEP:
            continue
        left = 1e9
        for step in range(1, math.ceil(length / ARC_STEP) + 1):
            turned = curvature * step * ARC_STEP
            if abs(turned) < 1e-6:
                x, y = step * ARC_STEP, 0.0
            else:
                x, y = math.sin(turned) / curvature, (1.0 - math.cos(turned)) / curvature
            left = min(left, math.hypot(target_x - x, target_y - y))
        cost = left + CLOSENESS_COST * max(reach + COMFORT - nearest, 0.0)
        if cost < least:
            chosen, least_left, least = curvature, left, cost
    return chosen, least_left
