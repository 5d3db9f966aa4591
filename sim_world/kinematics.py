"""How robots move: differential drive, collisions, and what their wheels say.

A body is a disc with two wheels. Within a step the wheel speeds are constant, so it drives an exact
arc. A body that would hit something moves as far as it can and stops there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry import Floats, Pose2, wrap_angle
from sim_world.scene import Scene

Discs = Sequence[tuple[float, float, float]]  # centre x, y and radius [m] of other bodies

# A body that comes near something is moved by no more than this at a time [m].
SUB_STEP = 0.02
# The last sub-step is halved this often to find the place of contact to a millimetre.
_HALVINGS = 5


@dataclass(frozen=True, slots=True)
class OdometryNoise:
    """How wrong the wheels are; each is a one-sigma error.

    The error is a Wiener process in the distance travelled and the angle turned: its *variance*
    grows linearly with both, so it is the same whether a metre is driven in one step or in fifty.

    Attributes:
        distance_per_metre: error of the distance after 1 m [m].
        heading_per_metre: error of the heading after 1 m [rad].
        heading_per_radian: error of the heading after a turn of 1 rad [rad].
    """

    distance_per_metre: float = 0.05
    heading_per_metre: float = math.radians(2.0)
    heading_per_radian: float = 0.05


@dataclass(frozen=True, slots=True)
class Body:
    """One robot's body.

    Attributes:
        radius: of the disc [m].
        speed_max: forward or backward [m/s].
        turn_rate_max: either way [rad/s].
        acceleration_max: [m/s2]; infinite means at once.
        turn_acceleration_max: [rad/s2]; infinite means at once.
        noise: of the wheel odometry.
    """

    radius: float = 0.25
    speed_max: float = 0.5
    turn_rate_max: float = 1.2
    acceleration_max: float = 1.0
    turn_acceleration_max: float = 3.0
    noise: OdometryNoise = OdometryNoise()


@dataclass(frozen=True, slots=True)
class Motion:
    """Where a body is and how it moves.

    Attributes:
        T_world_base: the true pose.
        speed: [m/s], forward positive.
        turn_rate: [rad/s], counter-clockwise positive.
    """

    T_world_base: Pose2
    speed: float = 0.0
    turn_rate: float = 0.0


@dataclass(frozen=True, slots=True)
class Step:
    """What one step did to one body.

    Attributes:
        motion: after the step.
        T_before_after: the motion in this step as the wheels report it, with their error.
        bumped: the body met a wall or another robot and stopped.
        travelled: true length of the path in this step [m], not negative.
    """

    motion: Motion
    T_before_after: Pose2
    bumped: bool
    travelled: float


def step_bodies(
    motions: Sequence[Motion],
    commands: Sequence[tuple[float, float]],
    dt: float,
    scene: Scene,
    bodies: Sequence[Body],
    rng: np.random.Generator,
) -> list[Step]:
    """Return what a step of `dt` [s] does to each of N bodies, moved one after the other in order.

    A pure function of its arguments. Two random draws are made per body, moving or not, so one
    robot's standing still does not change another's errors.

    Args:
        motions: N bodies as they are.
        commands: N wanted (speed [m/s], turn rate [rad/s]); cut to what each body can do.
        dt: length of the step [s].
        scene: what is solid besides the bodies.
        bodies: N bodies' properties.
        rng: source of the odometry error.
    """
    draws = rng.standard_normal((len(motions), 2))
    discs = [
        (m.T_world_base.x, m.T_world_base.y, body.radius)
        for m, body in zip(motions, bodies, strict=True)
    ]
    steps = []
    for i, (motion, command, body) in enumerate(zip(motions, commands, bodies, strict=True)):
        speed, turn_rate = limited(motion, command, dt, body)
        others = discs[:i] + discs[i + 1 :]
        share = _free_share(motion.T_world_base, speed * dt, turn_rate * dt, body, scene, others)
        bumped = share < 1.0
        distance, turn = share * speed * dt, share * turn_rate * dt
        T_world_base = motion.T_world_base @ arc(distance, turn)
        discs[i] = (T_world_base.x, T_world_base.y, body.radius)
        after = Motion(T_world_base, 0.0, 0.0) if bumped else Motion(T_world_base, speed, turn_rate)
        reported = noisy_arc(distance, turn, body.noise, draws[i])
        steps.append(Step(after, reported, bumped, abs(distance)))
    return steps


def limited(
    motion: Motion, command: tuple[float, float], dt: float, body: Body
) -> tuple[float, float]:
    """Return the (speed, turn rate) a body reaches when told `command`, within its limits."""
    wanted_speed = _clamped(command[0], body.speed_max)
    wanted_rate = _clamped(command[1], body.turn_rate_max)
    return (
        motion.speed + _clamped(wanted_speed - motion.speed, body.acceleration_max * dt),
        motion.turn_rate
        + _clamped(wanted_rate - motion.turn_rate, body.turn_acceleration_max * dt),
    )


def _clamped(value: float, limit: float) -> float:
    """Return `value` cut to [-limit, limit]."""
    return max(-limit, min(limit, value))


def arc(distance: float, turn: float) -> Pose2:
    """Return where a body gets to from the identity on an arc: length [m], turn [rad]."""
    if abs(turn) < 1e-6:
        # The first terms of the series; the next are below 1e-12 of the length.
        return Pose2(distance, 0.5 * distance * turn, turn)
    radius = distance / turn
    return Pose2(radius * math.sin(turn), radius * (1.0 - math.cos(turn)), wrap_angle(turn))


def noisy_arc(distance: float, turn: float, noise: OdometryNoise, draws: Floats) -> Pose2:
    """Return the arc that the wheels report for a true one.

    Args:
        distance: true length, signed [m].
        turn: true turn [rad].
        noise: see `OdometryNoise`.
        draws: two standard normal draws, (2,).
    """
    length, angle = abs(distance), abs(turn)
    distance_sigma = noise.distance_per_metre * math.sqrt(length)
    heading_sigma = math.sqrt(
        noise.heading_per_metre**2 * length + noise.heading_per_radian**2 * angle
    )
    return arc(distance + distance_sigma * float(draws[0]), turn + heading_sigma * float(draws[1]))


def _free_share(
    T_world_base: Pose2, distance: float, turn: float, body: Body, scene: Scene, others: Discs
) -> float:
    """Return the share, 0 to 1, of an arc that a body can drive before it hits something."""
    path = abs(distance)
    if path == 0.0:
        return 1.0
    here = _clearance(T_world_base, scene, others, body.radius + path)
    if here >= body.radius + path:
        return 1.0
    pieces = math.ceil(path / SUB_STEP)
    for piece in range(1, pieces + 1):
        there = _clearance_at(T_world_base, distance, turn, piece / pieces, scene, others, body)
        # A body that overlaps something already may always back out.
        if there < body.radius and there <= here:
            free, blocked = (piece - 1) / pieces, piece / pieces
            for _ in range(_HALVINGS):
                middle = 0.5 * (free + blocked)
                room = _clearance_at(T_world_base, distance, turn, middle, scene, others, body)
                free, blocked = (middle, blocked) if room >= body.radius else (free, middle)
            return free
        here = there
    return 1.0


def _clearance_at(
    T_world_base: Pose2,
    distance: float,
    turn: float,
    share: float,
    scene: Scene,
    others: Discs,
    body: Body,
) -> float:
    """Return the clearance [m], up to the body's radius, after a share of an arc."""
    T_world_there = T_world_base @ arc(share * distance, share * turn)
    return _clearance(T_world_there, scene, others, body.radius)


def _clearance(T_world_base: Pose2, scene: Scene, others: Discs, limit: float) -> float:
    """Return the distance [m] to the nearest wall or other body, at most `limit`."""
    room = scene.clearance(T_world_base.x, T_world_base.y, limit)
    for x, y, radius in others:
        room = min(room, math.hypot(x - T_world_base.x, y - T_world_base.y) - radius)
    return room
