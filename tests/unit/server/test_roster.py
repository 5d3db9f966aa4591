from __future__ import annotations

from protocol.body import Body
from protocol.codec import Header
from protocol.messages import Hello
from server.roster import Roster


def roster() -> Roster:
    return Roster(("robot1", "robot2"), 5.0)


def here(team: Roster, name: str, now: float = 0.0) -> None:
    team.admit(name, Hello(role="robot"), now)
    team.enter(name, Body(), now)


def header(name: str, sequence: int) -> Header:
    return Header(type="heartbeat", source=name, to="server", sequence=sequence, stamp=0.0)


def test_only_robots_of_the_team_are_robots() -> None:
    team = roster()
    assert "robot1, robot2" in (team.refusal("robot3", Hello(role="robot")) or "")
    assert "robot's name" in (team.refusal("robot1", Hello(role="operator")) or "")
    assert team.refusal("robot1", Hello(role="robot")) is None
    assert team.refusal("boss", Hello(role="operator")) is None


def test_a_new_life_is_noticed() -> None:
    team = roster()
    assert team.admit("robot1", Hello(role="robot", incarnation=1), 0.0)
    assert not team.enter("robot1", Body(), 0.0)
    assert not team.admit("robot1", Hello(role="robot", incarnation=1), 1.0)
    assert team.admit("robot1", Hello(role="robot", incarnation=2), 2.0)
    assert team.enter("robot1", Body(), 2.0)


def test_frames_count_once_and_only_of_peers_that_said_hello() -> None:
    team = roster()
    assert not team.accept(header("robot1", 1), 0.0)
    here(team, "robot1")
    assert team.accept(header("robot1", 1), 0.0)
    assert not team.accept(header("robot1", 1), 0.0)


def test_silence_is_found_once_and_ends_with_a_word() -> None:
    team = roster()
    here(team, "robot1")
    assert team.deadlines() == [5.0]
    assert team.find_silent(4.0) == []
    assert team.find_silent(6.0) == ["robot1"]
    assert team.find_silent(7.0) == [] and team.deadlines() == []
    assert team.states["robot1"] == "lost at 6.0 s" and team.present() == []
    team.accept(header("robot1", 1), 8.0)
    assert team.find_back("robot1") and not team.find_back("robot1")
    assert team.present() == ["robot1"] and team.states["robot1"] == "at work"


def test_observers_hear_everything_and_are_never_silent() -> None:
    team = roster()
    for _ in range(2):
        team.admit("console", Hello(role="observer"), 0.0)
    here(team, "robot2")
    assert team.find_silent(4.0) == []
    assert team.audience() == ["robot2", "console"]


def test_who_was_at_work_has_finished_at_the_end() -> None:
    team = roster()
    here(team, "robot1")
    team.finish()
    assert team.states == {"robot1": "finished", "robot2": "never seen"}
