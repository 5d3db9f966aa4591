"""Who plays in a mission: builds the cores of world, server and robots from a team's settings."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, replace

import numpy as np
from pydantic import ValidationError

from coordination.strategy import StrategyError, load_strategy
from expedition.team import TeamSettings, UsageError, pose_of_start
from mapping.geometry import Pose2, wrap_angle
from mapping.shared_map import SharedMap
from mapping.team_map import TeamMap
from protocol.errors import DamagedLogError
from protocol.host import Host
from protocol.log.observation_log import ObservationLog
from protocol.log.sync import LogSync
from robot_agent.agent import Agent
from robot_agent.decentral.memory import unpack
from robot_agent.decentral.peer import Peer
from robot_agent.decentral.sharing import Sharing
from robot_agent.estimators import EstimatorError, find_estimator
from server.listener import Listener
from server.master import Master
from sim_world.errors import WorldError
from sim_world.judge import Judge
from sim_world.robot_body import RobotSpec
from sim_world.starts import check_starts
from sim_world.truth import CoverageJudge
from sim_world.victims import check_victims
from sim_world.world import World
from sim_world.world_file import World as WorldFile
from sim_world.world_file import load_world, start_poses

SERVER_NAME, WORLD_NAME = "server", "world"


@dataclass(frozen=True, slots=True)
class Stage:
    """The world file of a mission and the robots in it, checked."""

    world: WorldFile
    specs: tuple[RobotSpec, ...]


def generator(seed: int, name: str) -> np.random.Generator:
    """Return the random generator of one process, from the run's seed and the process's name."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def set_stage(team: TeamSettings) -> Stage:
    """Load the world and place the robots.

    Raises:
        UsageError: the world or a start cannot be used; says how to mend it.
    """
    members = team.members()
    radius = max(member.body.radius_m for member in members)
    try:
        world = load_world(team.mission.world, team.mission.seed)
        given = [pose_of_start(start) for start in team.mission.starts[: len(members)]]
        check_starts(world.scene, given, radius)
        # Robots beyond those that were given a start stand around the first one.
        placed = replace(world, starts=tuple(given) or world.starts)
        poses = start_poses(placed, len(members), radius)
        check_starts(world.scene, poses, radius)
        world = replace(world, victims=world.victims + team.world.victims)
        check_victims(world.scene, world.victims)
    except WorldError as error:
        raise UsageError(str(error)) from None
    told = _told_starts(team, poses)
    specs = tuple(
        RobotSpec(member.name, member.body, pose, start)
        for member, pose, start in zip(members, poses, told, strict=True)
    )
    return Stage(world, specs)


def _told_starts(team: TeamSettings, poses: list[Pose2]) -> list[Pose2]:
    """Return the starts that robots are told, off by up to the set errors."""
    if not team.world.perturb_starts:
        return poses
    rng = generator(team.mission.seed, "starts")
    told = []
    for pose in poses:
        distance = team.world.start_error_m * math.sqrt(rng.uniform())
        direction = rng.uniform(-math.pi, math.pi)
        turn = math.radians(team.world.start_error_deg) * rng.uniform(-1.0, 1.0)
        told.append(
            Pose2(
                pose.x + distance * math.cos(direction),
                pose.y + distance * math.sin(direction),
                wrap_angle(pose.theta + turn),
            )
        )
    return told


def check_strategy(team: TeamSettings) -> None:
    """Refuse an unknown strategy or settings that it does not take.

    Raises:
        UsageError: says which strategies there are.
    """
    try:
        load_strategy(team.mission.strategy, team.strategy)
    except StrategyError as error:
        if isinstance(error.__cause__, ValidationError):
            first = error.__cause__.errors()[0]
            key = ".".join(str(part) for part in ("strategy", *first["loc"]))
            raise UsageError(
                f"strategy '{team.mission.strategy}' does not take these settings: "
                f"{key}: {first['msg']}"
            ) from None
        raise UsageError(str(error)) from None


def check_estimator(team: TeamSettings) -> None:
    """Refuse an unknown estimator.

    Raises:
        UsageError: says which estimators there are.
    """
    try:
        find_estimator(team.robot.estimator)
    except EstimatorError as error:
        raise UsageError(str(error)) from None


def judge_of(team: TeamSettings, stage: Stage) -> Judge:
    """Return the judge that measures the team's map against this world."""
    solid, geometry = stage.world.scene.free_truth()
    starts = [(spec.T_world_start.x, spec.T_world_start.y) for spec in stage.specs]
    radius = max(spec.body.radius_m for spec in stage.specs)
    coverage = CoverageJudge.for_starts(solid, geometry, starts, radius)
    return Judge(coverage, team.server.map.p_obstacle, team.server.map.p_clear)


def world_host(team: TeamSettings, stage: Stage, lockstep: bool = True) -> Host:
    """Return the host of the world's core."""
    judge = judge_of(team, stage)

    def build(_: int) -> World:
        return World(
            stage.world.scene,
            stage.specs,
            team.world,
            judge,
            generator(team.mission.seed, WORLD_NAME),
            lockstep,
            team.mission.max_time_s,
            leaderless=not team.server.enabled,
            agreeing=team.robot.decides == "itself",
            victims=stage.world.victims,
        )

    return Host(WORLD_NAME, build, frozenset({"radio", "uplink"}))


def server_host(team: TeamSettings) -> Host:
    """Return the host of the server's core.

    Raises:
        UsageError: the strategy is unknown or does not take its settings.
    """
    check_strategy(team)
    members = team.members()
    weights = {member.name: member.cost_weight for member in members}
    settings = team.server.model_copy(update={"cost_weights": weights})
    names = [member.name for member in members]

    def master(_: int) -> Master:
        strategy = load_strategy(team.mission.strategy, team.strategy)
        return Master(settings, strategy, team.mission.strategy, names, team.mission.max_time_s)

    def listener(life: int) -> Listener:
        sync, shared = _copy_of_the_log(team, SERVER_NAME, life)
        return Listener(settings, sync, shared, names, team.mission.max_time_s)

    return Host(SERVER_NAME, master if team.robot.decides == "server" else listener)


def agent_host(team: TeamSettings, name: str) -> Host:
    """Return the host of one robot's core.

    Raises:
        UsageError: the robot's estimator or the strategy is unknown.
    """
    check_estimator(team)

    def agent(incarnation: int) -> Agent:
        rng = generator(team.mission.seed, f"{name}.{incarnation}")
        return Agent(name, team.robot, incarnation, rng)

    def peer(
        incarnation: int, log: ObservationLog | None = None, left: Pose2 | None = None
    ) -> Peer:
        strategy = load_strategy(team.mission.strategy, team.strategy)
        sync, shared = _copy_of_the_log(team, name, incarnation, log)
        reference = name == team.members()[0].name
        sharing = Sharing(sync, shared, team.robot.peer, reference, left)
        return Peer(agent(incarnation), team.robot.peer, strategy, sharing, incarnation)

    def restored(incarnation: int, kept: bytes) -> Peer:
        try:
            memory = unpack(kept)
        except DamagedLogError:
            return peer(incarnation)
        return peer(incarnation, memory.log, memory.T_map_base)

    if team.robot.decides == "server":
        return Host(name, agent)
    check_strategy(team)
    return Host(name, peer, rebuild=restored)


def _copy_of_the_log(
    team: TeamSettings, name: str, life: int, kept: ObservationLog | None = None
) -> tuple[LogSync, SharedMap]:
    """Return a member's copy of the observations, empty or as it was kept; and what draws it."""
    settings = team.robot.peer
    rng = generator(team.mission.seed, f"{name}.{life}.log")
    names = tuple(member.name for member in team.members())
    log = kept or ObservationLog(name, life)
    sync = LogSync(log, settings.log, rng, team=names)
    drawn = TeamMap[tuple[str, int]](
        team.robot.mapping.resolution_m, largest_cells=settings.largest_cells
    )
    return sync, SharedMap(drawn)
