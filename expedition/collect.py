"""What each process knows at the end (or at a checkpoint) of a mission, as parts of its record."""

from __future__ import annotations

from typing import Any

import numpy as np

from expedition.cast import Stage
from expedition.pose_graph import pose_graph
from expedition.results.record import TruthRecord
from expedition.team import TeamSettings
from expedition.traffic import traffic_part
from mapping.grid import CLEAR, OccupancyGrid, classify
from mapping.scan_integration import IntegrationSettings, integrate_scan
from protocol.map_cells import map_digest, quantise
from server.frontiers_left import frontiers_left
from server.master import Master
from sim_world.world import World


def server_part(master: Master, now: float, last: bool = True) -> dict[str, Any]:
    """Return what the server knows: map, trajectories, tasks, what is left.

    Args:
        master: the server's core.
        now: mission time [s].
        last: whether this is its last word. What each robot saw by itself is only counted then: it
            takes as long as fusing all scans of the mission again, and everybody would wait.
    """
    merger = master.merger
    single, union = _clear_cells(master) if last else ({}, None)
    robots = {
        name: {
            "ended": master.roster.states[name],
            "track_map": merger.track(name) if name in merger.members else np.empty((0, 4)),
            "map_digest": _digest_told(master, name),
        }
        for name in master.roster.robots
    }
    return {
        "ended": master.ended or "failed",
        "reason": master.reason or "the server ended before the mission did",
        "sim_time_s": master.ended_at if master.ended else now,
        "map_digest": map_digest(quantise(merger.log_odds), merger.geometry) or None,
        "grid": OccupancyGrid(merger.geometry, merger.log_odds) if merger.nodes else None,
        "p_obstacle": master.settings.map.p_obstacle,
        "p_clear": master.settings.map.p_clear,
        "robots": robots,
        "single_clear": single,
        "union_clear": union,
        "tasks": master.executive.happenings,
        "remaining": _frontiers_left(master),
        "pose_graph": pose_graph(merger.nodes, merger.team.graph.edges),
        "events": [
            {"t_s": now, "event": "frames dropped", "peer": peer, "reason": reason, "count": count}
            for (peer, reason), count in sorted(master.faults.counts.items())
        ],
    }


def _frontiers_left(master: Master) -> list[dict[str, object]]:
    """Return every frontier of the final map, and why it was left."""
    merger, settings = master.merger, master.settings.map
    classes = classify(merger.log_odds, settings.p_obstacle, settings.p_clear)
    return frontiers_left(classes, merger.geometry, master.executive.remaining())


def _digest_told(master: Master, name: str) -> str | None:
    """Return the fingerprint of a robot's copy of the map as it told it last, if it did."""
    where = master.roster.where.get(name)
    return where.map_digest or None if where else None


def _clear_cells(master: Master) -> tuple[dict[str, int], int]:
    """Return how many cells each robot's scans alone show as clear, and all scans together."""
    geometry = master.merger.geometry
    single = {}
    union = np.zeros(geometry.shape, dtype=np.bool_)
    thresholds = master.settings.map.p_obstacle, master.settings.map.p_clear
    for name in master.roster.robots:
        grid = OccupancyGrid.unknown(geometry)
        for node in master.merger.nodes:
            if node.robot == name:
                integrate_scan(grid, node.scan, node.T_map_base, IntegrationSettings())
        clear = classify(grid.log_odds, *thresholds) == CLEAR
        single[name] = int(clear.sum())
        union |= clear
    return single, int(union.sum())


def world_part(world: World, stage: Stage, team: TeamSettings) -> dict[str, Any]:
    """Return what the world knows: the truth, the bytes on the air, the coverage over time."""
    solid, geometry = stage.world.scene.free_truth()
    sent, delivered = world.relay.ledger.sent, world.relay.ledger.delivered
    robots = {
        name: {
            "track_world": np.array(robot.track).reshape(-1, 4),
            "radius_m": robot.spec.body.radius_m,
            "path_m": robot.path,
            "scans": len(robot.track),
            "bytes_sent": sum(t.bytes for (a, _, _), t in sent.items() if a == name),
            "bytes_received": sum(t.bytes for (_, b, _), t in delivered.items() if b == name),
            "events": [{"t_s": 0.0, "event": "bumps", "count": robot.bumps}],
        }
        for name, robot in world.robots.items()
    }
    starts = {name: r.spec.T_world_start.as_array() for name, r in world.robots.items()}
    # A team without any detector does not search: nobody is missed by it.
    searched = any(robot.detector is not None for robot in world.robots.values())
    lie = {v.id: np.array([v.x, v.y]) for v in stage.world.victims} if searched else {}
    faults: list[dict[str, Any]] = [
        {"t_s": fault.at_s, "robot": fault.robot, "kind": fault.kind} for fault in team.world.faults
    ]
    if team.robot.decides == "itself":  # a server that listens need not hear all of them
        for name, robot in world.robots.items():
            robots[name]["ended"] = "finished" if robot.connected else "lost"
    leaderless = {}
    if not team.server.enabled:
        ended = world.finished
        leaderless = {
            "ended": ended.ended if ended else "failed",
            "reason": ended.reason if ended else "the world ended before the mission did",
            "sim_time_s": world.now,
        }
    return {
        **leaderless,
        "robots": robots,
        "truth": TruthRecord(geometry, solid, starts, victims=lie),
        "coverage_timeline": np.array(world.judge.timeline).reshape(-1, 2),
        "faults": faults,
        **traffic_part(world.relay),
    }


def launch_part(team: TeamSettings, world: str, version: str) -> dict[str, Any]:
    """Return what is known before the mission begins."""
    return {
        "team": team.name,
        "world": world,
        "strategy": team.mission.strategy,
        "estimator": team.robot.estimator,
        "seed": team.mission.seed,
        "version": version,
        "config": team.model_dump(mode="json"),
        "robots": {m.name: {"radius_m": m.body.radius_m} for m in team.members()},
    }
