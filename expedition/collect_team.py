"""What a member of a team knows that shares its observations: a robot, or a server that listens."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from expedition.results.record import PoseGraphRecord
from mapping.geometry import Floats
from mapping.grid import CLEAR, classify
from mapping.shared_map import Author, SharedMap
from mapping.victim_map import find_victims, sighting_at
from protocol.map_cells import map_digest, quantise
from robot_agent.decentral.peer import Peer
from server.frontiers_left import frontiers_left
from server.listener import Listener
from server.remaining import place_left
from server.settings import MapSettings

# Sightings of one victim lie within this distance of each other [m].
_VICTIM_GATE = 1.5
_THROUGH = "nothing useful is left, and all hold the same"
_BROKEN_OFF = "the server ended before the mission did"


def listener_part(listener: Listener) -> dict[str, Any]:
    """Return what a server that listens knows of how a mission ended."""
    return {
        "ended": listener.ended or ("explored" if listener.through else "failed"),
        "reason": listener.reason or (_THROUGH if listener.through else _BROKEN_OFF),
        "sim_time_s": listener.now,
    }


def listener_witness(listener: Listener) -> dict[str, Any]:
    """Return what a server that listens knows of what the team found."""
    listener.follow(listener.now)
    return team_part(listener.shared, listener.settings.map)


def peer_witness(peer: Peer, settings: MapSettings) -> dict[str, Any]:
    """Return what a robot knows of what the team found, and of what is left."""
    peer.sharing.follow(peer.now)
    part = team_part(peer.sharing.shared, settings)
    grid = part["grid"]
    if grid is not None:
        classes = classify(grid.log_odds, settings.p_obstacle, settings.p_clear)
        part["remaining"] = frontiers_left(classes, grid.geometry, _places_left(peer))
    return part


def peer_part(peer: Peer) -> dict[str, Any]:
    """Return what a robot that decides for itself knows of itself."""
    peer.sharing.follow(peer.now)
    grid = peer.sharing.shared.team.grid()
    robot: dict[str, Any] = {
        "map_digest": map_digest(quantise(grid.log_odds), grid.geometry) or None,
    }
    if peer.choosing.through:  # else the server or the world say how it ended
        robot["ended"] = "finished"
    track = peer.sharing.track()
    if len(track) and peer.life == 0:  # else what it told in its lives so far is more
        robot["track_map"] = track
    return {
        "robots": {peer.name: robot},
        "repositionings": peer.sharing.repositionings,
        "events": [
            {
                "t_s": peer.now,
                "event": "faults of a peer",
                "peer": name,
                "reason": reason,
                "count": count,
            }
            for (name, reason), count in sorted(peer.sharing.sync.standing.book.counts.items())
        ],
    }


def team_part(shared: SharedMap, settings: MapSettings) -> dict[str, Any]:
    """Return the map, and all that was observed, as one member holds it."""
    team = shared.team
    grid = team.grid()
    digest = map_digest(quantise(grid.log_odds), grid.geometry)
    single, union = _clear_cells(shared, settings)
    chains = _chains(shared)
    return {
        "grid": grid if digest else None,
        "map_digest": digest or None,
        "p_obstacle": settings.p_obstacle,
        "p_clear": settings.p_clear,
        "robots": {name: {"track_map": rows} for name, rows in chains.items()},
        "pose_graph": PoseGraphRecord(
            {name: rows[:, 1:] for name, rows in chains.items()},
            stamps={name: rows[:, 0] for name, rows in chains.items()},
        ),
        "single_clear": single,
        "union_clear": union,
        "victims": _victims(shared),
        "observations": _observations(shared),
    }


def _chains(shared: SharedMap) -> dict[str, Floats]:
    """Return where each robot's observations were made, (n, 4) stamp, x, y, theta, by stamp."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    for placed in shared.team.placed():
        row = (placed.scan.stamp, *placed.T_map_base.as_tuple())
        rows.setdefault(placed.author[0], []).append(row)
    return {name: np.array(sorted(own)).reshape(-1, 4) for name, own in rows.items()}


def _clear_cells(shared: SharedMap, settings: MapSettings) -> tuple[dict[str, int], int]:
    """Return how many cells each robot's scans alone show as clear, and all scans together."""
    single: dict[str, int] = {}
    thresholds = settings.p_obstacle, settings.p_clear
    for author, layer in shared.team.layers.items():
        clear = int((classify(layer.grid().log_odds, *thresholds) == CLEAR).sum())
        single[author[0]] = single.get(author[0], 0) + clear
    return single, int((classify(shared.team.grid().log_odds, *thresholds) == CLEAR).sum())


def _victims(shared: SharedMap) -> list[dict[str, Any]]:
    """Return the victims that all sightings together show."""
    poses = {(p.author, p.number): p.T_map_base for p in shared.team.placed()}
    sightings = [
        sighting_at(key[0][0], seen.scan.stamp, poses[key], point)
        for key, seen in sorted(shared.observations.items(), key=lambda item: item[0])
        if key in poses
        for point in seen.victims_base
    ]
    return [
        {
            "x_m": victim.x,
            "y_m": victim.y,
            "seen_by": victim.seen_by,
            "t_s": victim.first_seen,
            "sightings": victim.sightings,
        }
        for victim in find_victims(sightings, _VICTIM_GATE)
    ]


def _observations(shared: SharedMap) -> list[dict[str, Any]]:
    """Return all observations that are drawn, in the order in which they were made."""
    told: list[tuple[tuple[float, Author, int], Mapping[str, Any]]] = []
    for placed in shared.team.placed():
        scan = placed.scan
        fields = {
            "t_s": scan.stamp,
            "robot": placed.author[0],
            "number": placed.number,
            "ranges": np.asarray(scan.ranges, dtype=np.float32),
            "pose": (shared.told[placed.author, placed.number] @ scan.T_base_laser).as_array(),
            "bearing_start": scan.bearing_start,
            "bearing_step": scan.bearing_step,
            "range_max": scan.range_max,
        }
        told.append(((scan.stamp, placed.author, placed.number), fields))
    return [dict(fields) for _, fields in sorted(told, key=lambda each: each[0])]


def _places_left(peer: Peer) -> list[dict[str, object]]:
    """Return what a robot knows of the places along frontiers that are left."""
    bid, tried, least = peer.choosing.last
    if bid is None:
        return []
    rows = zip(bid.places, bid.gains, strict=True)
    left = [place_left(place, float(gain), tried, least) for place, gain in rows]
    return left + [place_left(place, None, tried, least) for place in bid.unreachable]
