from __future__ import annotations

from pathlib import Path

import pytest

from expedition.processes import WITNESSES, begin_record, choose_witness, save_robot, save_server
from expedition.results.record import load_record, save_record_part
from expedition.team import TeamSettings, checked
from mapping.geometry import Pose2
from robot_agent.agent import Agent
from robot_agent.settings import RobotSettings
from tests.unit.robot_agent.decentral.peer_rig import Rig, seen_by
from tests.unit.server.test_listener import begun


def team(server: bool) -> TeamSettings:
    return checked(
        {"name": "t", "robot": {"decides": "itself"}, "server": {"enabled": server}}, "a test"
    )


def robot(**settings: object) -> Rig:
    rig = Rig(**settings)
    rig.join()
    rig.radio("bob", seen_by("bob", Pose2(1.0, 0.0, 0.0)))
    rig.live(0.3)
    return rig


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*.npz"))


@pytest.mark.parametrize("server", [True, False])
def test_a_robot_leaves_its_own_word_and_what_it_knows_of_the_team(
    server: bool, tmp_path: Path
) -> None:
    peer = robot().peer
    held = len(peer.sharing.shared.team)
    for _ in range(2):
        save_robot(tmp_path, peer, team(server))
        assert names(tmp_path) == [f"{held:07}-me.npz", "3-me.npz"]
    choose_witness(tmp_path)
    assert names(tmp_path) == ["2-team.npz", "3-me.npz"]
    record = load_record(tmp_path)
    assert [each.id for each in record.robots] == ["bob", "me"]
    assert record.problems == []


def test_a_robot_that_is_told_what_to_do_leaves_nothing(tmp_path: Path) -> None:
    save_robot(tmp_path, Agent("me", RobotSettings()), team(server=True))
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("there", "chosen"),
    [
        (["0000009-bob", "0000010-cy", "0000002-ann"], "0000010-cy"),
        (["0000009-bob", "0000009-ann-b.c", "0000002-cy"], "0000009-ann-b.c"),
        (["0000009-bob", "0000009-server", "0000002-cy"], "0000009-server"),
        (["0000009-bob", "0000008-server", "0000002-cy"], "0000009-bob"),
        ([], None),
    ],
)
def test_the_one_that_holds_most_is_the_witness(
    there: list[str], chosen: str | None, tmp_path: Path
) -> None:
    for name in there:
        save_record_part(tmp_path / WITNESSES, name, {"reason": name})
    choose_witness(tmp_path)
    assert not (tmp_path / WITNESSES).exists()
    assert names(tmp_path) == ([] if chosen is None else ["2-team.npz"])
    if chosen is not None:
        assert load_record(tmp_path).reason == chosen


def test_what_an_earlier_run_left_goes(tmp_path: Path) -> None:
    save_record_part(tmp_path, "2-team", {"reason": "old"})
    save_record_part(tmp_path / WITNESSES, "0000001-old", {"reason": "old"})
    begin_record(tmp_path, {"team": "t"})
    assert names(tmp_path) == ["0-launch.npz"]


def test_what_a_server_was_told_last_counts_for_its_word(tmp_path: Path) -> None:
    rig = begun()
    rig.says("bob", seen_by("bob", Pose2(1.0, 0.0, 0.0)))
    save_server(tmp_path, rig.listener, rig.now)
    held = len(rig.listener.shared.team)
    assert names(tmp_path) == [f"{held:07}-server.npz", "2-server.npz"]


def test_a_server_that_listened_leaves_the_teams_record(tmp_path: Path) -> None:
    rig = begun()
    save_server(tmp_path, rig.listener, rig.now, last=False)
    save_server(tmp_path, rig.listener, rig.now)
    choose_witness(tmp_path)
    record = load_record(tmp_path)
    assert [each.id for each in record.robots] == ["ann"]
    assert len(record.observations) == 2
    assert record.sim_time_s == rig.now
