from __future__ import annotations

from typing import Any

import pytest

from expedition import cast
from expedition.team import TeamSettings, UsageError, load_team
from robot_agent.agent import Agent
from robot_agent.decentral.peer import Peer
from server.listener import Listener
from server.master import Master
from sim_world.world import World


def team(name: str = "rescue", **overrides: Any) -> TeamSettings:
    quick = {"robot": {"estimator": "scan_matching"}, "mission": {"robots": 2}}
    return load_team(name, quick | overrides)


def test_who_is_told_what_to_do_has_a_master() -> None:
    auction = team("auction")
    assert isinstance(cast.server_host(auction).core, Master)
    assert isinstance(cast.agent_host(auction, "robot1").core, Agent)


def test_who_decides_for_itself_has_a_listener() -> None:
    rescue = team()
    listener = cast.server_host(rescue).core
    peer = cast.agent_host(rescue, "robot2").core
    assert isinstance(listener, Listener) and isinstance(peer, Peer)
    assert listener.robots == ("robot1", "robot2")
    assert (peer.name, peer.life) == ("robot2", 0)
    assert peer.sharing.shared.team.resolution == rescue.robot.mapping.resolution_m


def test_a_new_life_begins_a_new_log() -> None:
    host = cast.agent_host(team(), "robot1")
    host.restart(2)
    assert isinstance(host.core, Peer)
    assert host.core.life == host.core.sharing.sync.log.me.life == 2


def test_what_cannot_be_used_is_named() -> None:
    with pytest.raises(UsageError, match="strategy"):
        cast.agent_host(team(mission={"strategy": "none"}), "robot1")
    with pytest.raises(UsageError, match="estimator"):
        cast.agent_host(team(robot={"estimator": "none"}), "robot1")


@pytest.mark.parametrize("server", [True, False])
def test_the_world_asks_robots_for_their_map_only_where_there_is_no_server(server: bool) -> None:
    world = {"world": "office_single_corridor", "robots": 2}
    settings = team(mission=world, server={"enabled": server})
    core = cast.world_host(settings, cast.set_stage(settings)).core
    assert isinstance(core, World)
    assert (core._witnesses is None) == server
